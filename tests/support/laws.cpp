#include "support/laws.hpp"

#include "words/note_words.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <variant>

namespace cie::test {
namespace {

using analysis::Event;
using analysis::SubjectVerdict;
using analysis::Verdict;

// By process.
using Named = std::set<std::pair<std::int64_t, std::int64_t>>;

Named callbacks_named(const TextTrace& trace) {
  Named named;
  for (const auto& event : trace.events) {
    std::visit(
        [&named, &event](const auto& body) {
          using Body = std::decay_t<decltype(body)>;
          if constexpr (requires { body.seq, body.callback; } ||
                        std::is_same_v<Body, analysis::CallbackInit> ||
                        std::is_same_v<Body, analysis::CallbackFini>) {
            named.emplace(event.head.pid.value_or(0), to_number(body.callback));
          }
        },
        event.body);
  }
  return named;
}

// Without its run_end a process looks as if it had crashed there, and is judged as far as seen.
bool looks_crashed(const TextTrace& before, const TextTrace& after) {
  const auto ends = [](const TextTrace& trace) {
    return std::ranges::count_if(trace.events, [](const Event& event) {
      return std::holds_alternative<analysis::RunEnd>(event.body);
    });
  };
  return ends(before) != ends(after);
}

bool has_kernel_lost(const TextTrace& before, const TextTrace& after) {
  const auto count = [](const TextTrace& trace) {
    return std::ranges::count_if(trace.events, [](const Event& event) {
      const auto index = event.body.index();
      return index >= analysis::EventBody(analysis::SchedSwitch{}).index() &&
             index <= analysis::EventBody(analysis::SchedPiSetprio{}).index();
    });
  };
  return count(before) != count(after);
}

// Threads that were announced, read back, ended or seen to begin an instance.
Named threads_named(const TextTrace& trace) {
  Named named;
  for (const auto& event : trace.events) {
    std::visit(
        [&named, &event](const auto& body) {
          using Body = std::decay_t<decltype(body)>;
          if constexpr (std::is_same_v<Body, analysis::ThreadInit> ||
                        std::is_same_v<Body, analysis::ThreadSched> ||
                        std::is_same_v<Body, analysis::ThreadFini>) {
            named.emplace(event.head.pid.value_or(0), body.tid);
          } else if constexpr (std::is_same_v<Body, analysis::CallbackStart>) {
            if (event.head.tid) named.emplace(event.head.pid.value_or(0), *event.head.tid);
          }
        },
        event.body);
  }
  return named;
}

// Incarnations of a thread have one name.
std::map<std::string, Verdict> worst_by_subject(const analysis::RuleVerdict& rule) {
  std::map<std::string, Verdict> worst;
  for (const auto& subject : rule.subjects) {
    auto& of_subject = worst.try_emplace(subject.subject, subject.verdict).first->second;
    of_subject = std::max(of_subject, subject.verdict);
  }
  return worst;
}

}  // namespace

bool is_structural(const Event& event) {
  return event.body.index() < analysis::EventBody(analysis::RunBegin{}).index();
}

std::string explain(const Verified& verified, const std::string& rule) {
  std::string text;
  for (const auto& subject : verified.rule(rule).subjects) {
    text += rule + ' ' + subject.subject + ' ' + std::string(label(subject.verdict)) + '\n' +
            verified.evidence(rule, subject.subject);
  }
  return text;
}

std::string explain(const Verified& verified) {
  std::string text;
  for (const auto& rule : verified.result.verdicts.rules)
    text += explain(verified, rule.id);
  return text;
}

std::string unfounded(const Verified& verified) {
  std::string lacking;
  for (const auto& rule : verified.result.verdicts.rules) {
    auto worst = Verdict::not_applicable;
    for (const SubjectVerdict& subject : rule.subjects) {
      worst = std::max(worst, subject.verdict);
      const auto lacks = [&](const char* what) {
        lacking += rule.id + ' ' + subject.subject + ' ' + std::string(label(subject.verdict)) +
                   " without " + what + '\n';
      };
      if (subject.verdict >= Verdict::inconclusive && subject.evidence.empty()) lacks("evidence");
      const bool needs_check = subject.verdict == Verdict::pass || subject.verdict == Verdict::fail;
      if (needs_check && subject.checked == 0) lacks("anything checked");
      for (const auto& item : subject.evidence) {
        if (item.note.empty() || !viewer_export::is_worded(item.note))
          lacks("words in its evidence");
      }
    }
    if (rule.verdict != worst) lacking += rule.id + " is not as bad as its worst subject\n";
  }
  return lacking;
}

std::string broken_by(const Deletion& deletion, const Verified& full, const Verified& reduced,
                      const Verified& user) {
  const auto& [trace, less, has_crashed] = deletion;
  const bool is_cut_short = looks_crashed(trace, less);
  // A callback or thread of which nothing is left has no subject any more; T4 counts it. Nor does
  // anything tell what a crashed process did after its last event.
  const bool may_vanish = has_crashed || is_cut_short ||
                          threads_named(trace) != threads_named(less) ||
                          callbacks_named(trace) != callbacks_named(less);
  for (const auto& rule : full.result.verdicts.rules) {
    const auto before = rule.verdict;
    const auto after = reduced[rule.id];
    const bool was_proven = before != Verdict::fail && before != Verdict::inconclusive;
    // Nothing promises that the last `applied` of a process that was cut short was its last one.
    if (rule.id == "S1" && is_cut_short) continue;
    if (was_proven && after == Verdict::fail) {
      return "false FAIL: " + explain(reduced, rule.id) + "was:\n" + explain(full, rule.id);
    }
    // Without kernel events CPUs are only sampled, by the events themselves. A lost instance leaves
    // M4 standing (L5), unless a thread is known that it may have moved to.
    if (rule.id == "S4" || rule.id == "M4" || may_vanish) continue;
    const bool is_of_kernel = user[rule.id] != Verdict::fail && has_kernel_lost(trace, less);
    if (is_of_kernel && after == user[rule.id]) continue;
    if (before == Verdict::fail && after != Verdict::fail && after != Verdict::inconclusive) {
      return "lost FAIL: " + explain(full, rule.id) + "is:\n" + explain(reduced, rule.id);
    }
  }
  return {};
}

TextTrace without_kernel(const TextTrace& trace) {
  std::set<analysis::StreamIndex> kernel;
  for (const auto& event : trace.events) {
    const auto* stream = std::get_if<analysis::StreamBegin>(&event.body);
    if (stream != nullptr && stream->domain == analysis::Domain::kernel) {
      kernel.insert(event.head.stream);
    }
  }
  TextTrace user = trace;
  std::erase_if(user.events,
                [&kernel](const Event& event) { return kernel.contains(event.head.stream); });
  return user;
}

std::string broken_by_kernel(const Verified& user, const Verified& both) {
  for (const auto& rule : user.result.verdicts.rules) {
    if (rule.id == "T1" || rule.id == "T6") continue;  // they judge the traces themselves
    const auto report = [&](const char* what) {
      return std::string(what) + ":\n" + explain(both, rule.id) + "without the kernel:\n" +
             explain(user, rule.id);
    };
    const bool was_open = rule.verdict == Verdict::inconclusive;
    if (!was_open && both[rule.id] == Verdict::inconclusive) return report("undecided again");
    const auto with_kernel = worst_by_subject(both.rule(rule.id));
    for (const auto& [subject, before] : worst_by_subject(rule)) {
      const auto found = with_kernel.find(subject);
      const auto after = found != with_kernel.end() ? found->second : Verdict::not_applicable;
      if (before == Verdict::fail && after != Verdict::fail) return report("lost FAIL");
      if (before == Verdict::pass && after != Verdict::pass && after != Verdict::fail) {
        return report("lost PASS");
      }
    }
  }
  return {};
}

}  // namespace cie::test
