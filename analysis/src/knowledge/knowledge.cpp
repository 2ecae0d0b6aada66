#include "knowledge.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

// So many gaps and expected events are looked at for room. Behind them there is taken to be some.
constexpr std::size_t kMostLookedAt = 64;

template <typename Value>
bool may_be_same(const std::optional<Value>& a, const std::optional<Value>& b) {
  return !a || !b || *a == *b;
}

TimeWindow meet(TimeWindow a, TimeWindow b) {
  return {.from = std::max(a.from, b.from), .to = std::min(a.to, b.to)};
}

// The order in which gaps are named as reasons: whichever file was read first.
bool comes_before(const Gap& a, const Gap& b) {
  return std::tie(a.window.from, a.reason.cause, a.scope.cpu, a.reason.about) <
         std::tie(b.window.from, b.reason.cause, b.scope.cpu, b.reason.about);
}

bool is_empty(TimeWindow window) { return window.to < window.from; }

std::uint64_t key_of(CallbackIndex callback) {
  constexpr unsigned kCallback = 32;
  return (std::uint64_t{1} + at(callback)) << kCallback;
}
std::uint64_t key_of(ThreadIndex thread) { return at(thread); }

// Of the callback if one is named, else of the thread. Nothing if neither is.
std::optional<std::uint64_t> key_of(const Scope& scope) {
  if (scope.callback) {
    return key_of(*scope.callback);
  }
  return scope.thread ? std::optional{key_of(*scope.thread)} : std::nullopt;
}

}  // namespace

Knowledge::Knowledge(MayBeOn may_be_on, std::size_t most_gaps_of_a_scope)
    : may_be_on_{std::move(may_be_on)}, most_gaps_{most_gaps_of_a_scope} {}

Knowledge::Knowledge(const Knowledge& other, MayBeOn may_be_on) : Knowledge{other} {
  may_be_on_ = std::move(may_be_on);
}

void Knowledge::add(const Gap& gap) {
  const auto& scope = gap.scope;
  const LaneKey key{scope.host, scope.cpu, scope.process, scope.thread, scope.callback, gap.kinds};
  const auto [found, is_new] = lane_of_.try_emplace(key, lanes_.size());
  if (is_new) {
    lanes_.push_back({.scope = scope, .kinds = gap.kinds, .gaps = GapLane{most_gaps_}});
    lanes_of(scope).push_back(found->second);
    if (scope.callback) {
      of_callbacks_ = of_callbacks_ | gap.kinds;
    } else if (scope.thread) {
      of_threads_ = of_threads_ | gap.kinds;
    }
  }
  lanes_[found->second].gaps.add(gap);
}

std::vector<std::size_t>& Knowledge::lanes_of(const Scope& scope) {
  if (const auto key = key_of(scope)) {
    return subject_lanes_[*key];
  }
  return scope.process ? process_lanes_[static_cast<std::uint32_t>(*scope.process)] : wide_lanes_;
}

void Knowledge::discharge(EventKinds kinds, const Scope& subject, TimeWindow window) {
  proofs_.add(kinds, subject, window);
}

void Knowledge::expect(const Hidden& hidden) {
  if (const auto key = key_of(hidden.scope)) {
    expected_of_[*key].push_back(expected_.size());
  }
  expected_.push_back(hidden);
}

void Knowledge::settle() {
  for (auto& lane : lanes_) {
    lane.gaps.forget_use();
  }
  uses_.clear();
  for (auto hidden : expected_) {
    hidden.is_unnumbered = true;  // that it is hidden is proven
    std::vector<Place> places;
    for_each_place(hidden, [&](const Place& place) {
      places.push_back(place);
      return places.size() < 2;
    });
    if (places.size() == 1) {
      lanes_[places[0].lane].gaps.use(places[0].held->gap.window.from);
    }
    uses_.push_back(places.size() == 1);
  }
}

const Gap* Knowledge::any_gap(std::span<const Conjunction> each) const {
  for (const auto& all : each) {
    if (const auto* possible = gap(all)) {
      return possible;
    }
  }
  return nullptr;
}

const Gap* Knowledge::gap(std::span<const Hidden> all) const {
  const Gap* first = nullptr;
  std::vector<std::vector<Choice>> limited;  // of events that find room in few places
  for (const auto& hidden : all) {
    const Gap* found = nullptr;
    for_each_lane(hidden, [&](std::size_t lane) {
      visit_lane(lane, hidden, [&](const Place& place) {
        const auto& gap = place.held->gap;
        if (found == nullptr || comes_before(gap, *found)) {
          found = &gap;
        }
        return false;  // the others of the lane are later
      });
      return found == nullptr ||
             first == nullptr;  // of further events it is enough that there is one
    });
    if (found == nullptr) {
      return nullptr;
    }
    if (first == nullptr) {
      first = found;
    }
    bool is_unbounded = false;
    auto places = choices(hidden, all.size(), is_unbounded);
    if (!is_unbounded) {
      limited.push_back(std::move(places));
    }
  }
  std::vector<Choice> taken;
  const auto is_free = [&](const Choice& choice) {
    std::uint64_t same = 0;
    for (const auto& other : taken) {
      same +=
          other.held == choice.held && (choice.held != nullptr || other.expected == choice.expected)
              ? 1U
              : 0U;
    }
    return choice.held == nullptr ? same == 0
                                  : choice.held->used + same < *choice.held->gap.at_most;
  };
  const auto find_room = [&](const auto& self, std::size_t next) -> bool {
    if (next == limited.size()) {
      return true;
    }
    return std::any_of(limited[next].begin(), limited[next].end(), [&](const Choice& choice) {
      if (!is_free(choice)) {
        return false;
      }
      taken.push_back(choice);
      const bool is_room = self(self, next + 1);
      taken.pop_back();
      return is_room;
    });
  };
  return find_room(find_room, 0) ? first : nullptr;
}

std::vector<std::optional<std::int32_t>> Knowledge::cpus(const Hidden& hidden) const {
  std::vector<std::optional<std::int32_t>> found;
  for_each_lane(hidden, [&](std::size_t lane) {
    const auto cpu = lanes_[lane].scope.cpu;
    const bool is_new = std::find(found.begin(), found.end(), cpu) == found.end();
    if (is_new && !visit_lane(lane, hidden, [](const Place&) { return false; })) {
      found.push_back(cpu);
    }
    return true;
  });
  return found;
}

TimeWindow Knowledge::bounds(const Hidden& hidden) const {
  std::optional<TimeWindow> bounds;
  const auto widen = [&](const GapLane::Held* held) {
    if (held == nullptr) {
      return;
    }
    const auto within = meet(held->gap.window, hidden.window);
    if (is_empty(within)) {
      return;
    }
    bounds = bounds ? TimeWindow{.from = std::min(bounds->from, within.from),
                                 .to = std::max(bounds->to, within.to)}
                    : within;
  };
  for (const auto& lane : lanes_) {
    if (reaches(lane, hidden)) {
      widen(lane.gaps.from(hidden.window.from));
      widen(lane.gaps.until(hidden.window.to));
    }
  }
  return bounds.value_or(hidden.window);
}

// Until `visit` returns false.
template <typename Visit>
void Knowledge::for_each_place(const Hidden& hidden, const Visit& visit) const {
  for_each_lane(hidden, [&](std::size_t lane) { return visit_lane(lane, hidden, visit); });
}

// Those that may hold it. Until `visit` returns false.
template <typename Visit>
void Knowledge::for_each_lane(const Hidden& hidden, const Visit& visit) const {
  const auto visit_all = [&visit](const std::vector<std::size_t>& lanes) {
    return std::all_of(lanes.begin(), lanes.end(), visit);
  };
  const auto visit_of = [&visit_all](const auto& lanes, auto key) {
    const auto found = lanes.find(key);
    return found == lanes.end() || visit_all(found->second);
  };
  const auto visit_each = [&visit_all](const auto& lanes) {
    return std::all_of(lanes.begin(), lanes.end(),
                       [&visit_all](const auto& of_one) { return visit_all(of_one.second); });
  };
  const auto& scope = hidden.scope;
  if (!visit_all(wide_lanes_)) {
    return;
  }
  const bool is_going_on =
      scope.process ? visit_of(process_lanes_, static_cast<std::uint32_t>(*scope.process))
                    : visit_each(process_lanes_);
  if (!is_going_on) {
    return;
  }
  // Of what the event does not name, the gap of any may hide it.
  const bool is_any = (!scope.callback && of_callbacks_.has_any(hidden.kinds)) ||
                      (!scope.thread && of_threads_.has_any(hidden.kinds));
  if (is_any) {
    visit_each(subject_lanes_);
    return;
  }
  if (scope.callback && !visit_of(subject_lanes_, key_of(*scope.callback))) {
    return;
  }
  if (scope.thread) {
    visit_of(subject_lanes_, key_of(*scope.thread));
  }
}

template <typename Visit>
bool Knowledge::visit_lane(std::size_t number, const Hidden& hidden, const Visit& visit) const {
  const auto& lane = lanes_[number];
  if (!reaches(lane, hidden)) {
    return true;
  }
  const auto& window = hidden.window;
  for (auto time = window.from; time <= window.to;) {
    const auto unproven = first_unproven(hidden, lane.kinds, {.from = time, .to = window.to});
    const auto* held = unproven ? lane.gaps.from(*unproven) : nullptr;
    if (held == nullptr || held->gap.window.from > window.to) {
      return true;
    }
    const auto& gap = held->gap.window;
    if (gap.from >
        *unproven) {  // what lies before it hides nothing, and a proof may hold within it
      const auto within = first_unproven(hidden, lane.kinds, {.from = gap.from, .to = window.to});
      if (!within) {
        return true;
      }
      if (*within > gap.to) {
        time = *within;
        continue;
      }
    }
    if (!visit(Place{.lane = number, .held = held})) {
      return false;
    }
    if (gap.to == kLatest) {
      return true;
    }
    time = Timestamp{gap.to.ns + 1};
  }
  return true;
}

std::optional<Timestamp> Knowledge::first_unproven(const Hidden& hidden, EventKinds kinds,
                                                   TimeWindow window) const {
  if (hidden.is_unnumbered) {
    return window.from;
  }
  std::optional<Timestamp> first;
  (kinds & hidden.kinds).for_each([&](EventKind kind) {
    const auto time = proofs_.first_unproven(kind, hidden.scope, window);
    first = first && time ? std::min(first, time) : (time ? time : first);
  });
  return first;
}

bool Knowledge::reaches(const Lane& lane, const Hidden& hidden) const {
  if (!lane.kinds.has_any(hidden.kinds) || !may_be_same(lane.scope.host, hidden.scope.host) ||
      !may_be_same(lane.scope.process, hidden.scope.process) ||
      !may_be_same(lane.scope.thread, hidden.scope.thread) ||
      !may_be_same(lane.scope.callback, hidden.scope.callback) ||
      !may_be_same(lane.scope.cpu, hidden.scope.cpu)) {
    return false;
  }
  // Who waits for a lock emits that its owner inherits a priority, on whatever CPU.
  const bool is_emitted_by_another = hidden.kinds == EventKinds{EventKind::priority_inheritance};
  return !lane.scope.cpu || !hidden.scope.thread || is_emitted_by_another || !may_be_on_ ||
         may_be_on_(hidden, *lane.scope.cpu);
}

bool Knowledge::may_be(const Hidden& hidden, const Hidden& expected) const {
  if (!hidden.kinds.has_any(expected.kinds) ||
      !may_be_same(hidden.scope.thread, expected.scope.thread) ||
      !may_be_same(hidden.scope.process, expected.scope.process)) {
    return false;
  }
  auto both = hidden;
  both.window = meet(hidden.window, expected.window);
  bool is_possible = false;
  for_each_place(both, [&](const Place& place) {
    is_possible = reaches(lanes_[place.lane], expected);
    return !is_possible;
  });
  return is_possible;
}

// No more than `enough` gaps: as many events have room in as many gaps whichever way the others go.
std::vector<Knowledge::Choice> Knowledge::choices(const Hidden& hidden, std::size_t enough,
                                                  bool& is_unbounded) const {
  std::vector<Choice> found;
  std::size_t looked_at = 0;
  for_each_place(hidden, [&](const Place& place) {
    is_unbounded = !place.held->gap.at_most || ++looked_at > kMostLookedAt;
    if (!place.held->is_full()) {
      found.push_back({.held = place.held});
    }
    return !is_unbounded && found.size() < enough;
  });
  const auto key = key_of(hidden.scope);
  is_unbounded = is_unbounded || (!key && !expected_.empty());
  if (is_unbounded || !key || found.size() >= enough) {
    return found;
  }
  if (const auto expected = expected_of_.find(*key); expected != expected_of_.end()) {
    for (const auto number : expected->second) {
      if (number < uses_.size() && uses_[number] && may_be(hidden, expected_[number])) {
        found.push_back({.expected = number});
        is_unbounded = is_unbounded || ++looked_at > kMostLookedAt;
      }
    }
  }
  return found;
}

}  // namespace cie::analysis
