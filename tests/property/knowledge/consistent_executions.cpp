#include "consistent_executions.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace cie::test::small {
namespace {

constexpr int kMostHidden = 4;  // in a gap without a count
constexpr std::size_t kMostStates = 4000;

// Where an execution may have come to. Executions that reach the same are one.
struct Reached {
  State state;
  Memory memory{};
  unsigned violated = 0;
  std::vector<int> left;  // how many events each gap may hide yet
  friend auto operator<=>(const Reached&, const Reached&) = default;
};

std::optional<Reached> step(const Recording& recording, Rule rule, const Reached& from,
                            const Event& event) {
  auto state = from.state.after(recording.world, event);
  if (!state) {
    return std::nullopt;
  }
  auto to = from;
  to.violated |= violated(rule, recording.world, to.memory, from.state, event);
  to.state = *std::move(state);
  return to;
}

// Those that go on from one of them by a hidden event, or by none.
void go_on(const Recording& recording, Rule rule, bool at_home, int time, const Reached& from,
           std::set<Reached>& following) {
  following.insert(from);
  for (std::size_t place = 0; place < recording.losses.size(); ++place) {
    const auto& loss = recording.losses[place];
    if (time < loss.begin || time > loss.end || from.left[place] == 0) {
      continue;
    }
    for (int cpu = 0; cpu < kCpus; ++cpu) {
      if (loss.cpu != kNone && loss.cpu != cpu) {
        continue;
      }
      for (const auto& event : from.state.possible(recording.world, time, cpu, rule, at_home)) {
        if (!loss.kinds.has(event.kind) ||
            (analysis::kKernelKinds.has(event.kind) && rule != Rule::s3)) {
          continue;
        }
        if (auto to = step(recording, rule, from, event)) {
          --to->left[place];
          following.insert(*std::move(to));
        }
      }
    }
  }
}

// The sets of violated subjects, one of each execution.
std::optional<std::set<unsigned>> outcomes(const Recording& recording, Rule rule, bool at_home) {
  std::map<int, Event> recorded;
  int last = 0;
  for (const auto& event : recording.events) {
    recorded.emplace(event.time, event);
    last = std::max(last, event.time);
  }
  Reached begin;
  for (const auto& loss : recording.losses) {
    begin.left.push_back(loss.at_most.value_or(kMostHidden));
    last = std::max(last, loss.end);
  }
  std::set<Reached> reached{begin};
  for (int time = 0; time <= last; ++time) {
    std::set<Reached> following;
    const auto event = recorded.find(time);
    for (const auto& from : reached) {
      if (event == recorded.end()) {
        go_on(recording, rule, at_home, time, from, following);
      } else if (auto to = step(recording, rule, from, event->second)) {
        following.insert(*std::move(to));
      }
      if (following.size() > kMostStates) {
        return std::nullopt;
      }
    }
    reached = std::move(following);
  }
  std::set<unsigned> found;
  for (const auto& end : reached) {
    found.insert(end.violated);
  }
  return found;
}

bool was_applied_before(const Recording& recording, const Event& audit) {
  return std::any_of(recording.events.begin(), recording.events.end(), [&](const Event& event) {
    return event.kind == EventKind::applied && event.tid == audit.tid && event.time < audit.time;
  });
}

}  // namespace

std::optional<std::map<int, analysis::Verdict>> verdicts_by_definition(const Recording& recording,
                                                                       Rule rule, bool at_home) {
  const auto every = outcomes(recording, rule, at_home);
  if (!every || every->empty()) {
    return std::nullopt;
  }
  std::map<int, analysis::Verdict> found;
  for (const int subject : subjects(recording, rule)) {
    const auto violating = std::count_if(every->begin(), every->end(), [&](unsigned subjects) {
      return (subjects & (1U << static_cast<unsigned>(subject))) != 0;
    });
    found[subject] = violating == 0 ? analysis::Verdict::pass
                     : violating == static_cast<long>(every->size())
                         ? analysis::Verdict::fail
                         : analysis::Verdict::inconclusive;
  }
  if (rule != Rule::s3) {
    return found;
  }
  // More evidence never decides less: the kernel's part decides what user space did not judge.
  const auto by_read_back = verdicts_by_definition(recording, Rule::s3_by_read_back, at_home);
  if (!by_read_back) {
    return std::nullopt;
  }
  for (const auto& event : recording.events) {
    if (event.kind == EventKind::audit && was_applied_before(recording, event) &&
        found.at(event.tid) == analysis::Verdict::inconclusive) {
      found[event.tid] = by_read_back->at(event.tid);
    }
  }
  return found;
}

}  // namespace cie::test::small
