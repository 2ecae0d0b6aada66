#include "small_rules.hpp"

#include "named_claims.hpp"

#include <algorithm>
#include <map>

namespace cie::test::small {
namespace {

void s1(const Facts& facts, int tid, NamedClaims& claims) {
  const Event* applied = nullptr;
  const Event* spin = nullptr;
  bool has_matched = false;
  for (const auto* event : facts.of(
           {EventKind::announcement, EventKind::applied, EventKind::run_start}, {.tid = tid})) {
    if (event->kind == EventKind::announcement) {
      applied = nullptr;
      has_matched = false;
      spin = event;
    } else if (event->kind == EventKind::applied) {
      applied = event;
      has_matched = has_matched || event->value == kAsSpecified;
    } else if (applied != nullptr || spin != nullptr) {
      claims.checked();
      const int since = (applied != nullptr ? applied : spin)->time;
      const auto hidden = Facts::of_thread(EventKind::applied, between(since, event->time), tid);
      if (has_matched && applied->value != kAsSpecified) {
        claims.violation("ran otherwise", {{hidden}, facts.replaced(tid, since, event->time)});
      } else {  // what was hidden may differ; where the spec's was not seen before, so was that
        Conjunction lost{hidden};
        if (!has_matched) {
          lost.push_back(Facts::of_thread(
              EventKind::applied, between(spin != nullptr ? spin->time : -1, event->time), tid));
        }
        claims.needs("lost read-back", lost);
      }
    } else {
      claims.checked();
      const auto lost = Facts::of_thread(EventKind::applied, between(-1, event->time), tid, true);
      claims.needs("lost read-backs before", {lost, lost});
    }
  }
  const auto life = facts.life();
  const auto unnumbered = Facts::of_thread(EventKind::applied, life, tid, true);
  for (const auto* event : facts.of(EventKind::run_start, {.tid = tid})) {
    claims.needs("lost spin",
                 {Facts::of_thread(EventKind::announcement, between(-1, event->time), tid),
                  unnumbered, unnumbered});
  }
  const auto changes = facts.of(EventKind::applied, {.tid = tid});
  for (int c = 0; c < kCallbacks; ++c) {
    const auto run = facts.lost_run(c, tid, life);
    if (!run) {
      continue;
    }
    claims.needs("lost run and read-back",
                 *run + Conjunction(changes.empty() ? 2 : 1,
                                    Facts::of_thread(EventKind::applied, life, tid)));
    claims.needs("lost run in a lost spin",
                 *run + Conjunction{Facts::of_thread(EventKind::announcement, life, tid),
                                    unnumbered, unnumbered});
    bool has_been_as_specified = false;
    for (const auto* change : changes) {
      if (change->value != kAsSpecified && has_been_as_specified) {
        const auto next = facts.of({EventKind::applied, EventKind::announcement},
                                   {.tid = tid, .after = change->time});
        const int end = next.empty() ? kForever : next.front()->time;
        if (const auto then = facts.lost_run(c, tid, between(change->time, end))) {
          claims.needs("lost run with other parameters", *then);
        }
      }
      has_been_as_specified = has_been_as_specified || change->value == kAsSpecified;
    }
  }
}

// By read-back, or by the kernel's switches: two kinds of evidence, each judged by itself.
void s3(const Facts& facts, int tid, NamedClaims& claims, bool by_kernel) {
  const Event* applied = nullptr;
  bool is_boosted = false;
  for (const auto* event : facts.of({EventKind::announcement, EventKind::applied, EventKind::audit,
                                     EventKind::context_switch, EventKind::priority_inheritance},
                                    {.tid = tid})) {
    const bool is_switch = event->kind == EventKind::context_switch;
    if (event->kind == EventKind::priority_inheritance) {
      is_boosted = event->value != 0;
    } else if (event->kind == EventKind::announcement || event->kind == EventKind::applied) {
      applied = event->kind == EventKind::applied ? event : nullptr;
    } else if (applied != nullptr && !(is_switch && is_boosted) && is_switch == by_kernel) {
      claims.checked();
      if (event->value == applied->value) {
        continue;
      }
      const auto window = between(applied->time, event->time);
      auto spun = facts.replaced(tid, applied->time, event->time);
      spun.insert(spun.end(), is_switch ? 0U : static_cast<std::size_t>(std::min(event->n, 2)),
                  Facts::of_thread(EventKind::applied, window, tid, true));
      std::vector<Conjunction> excuses{{Facts::of_thread(EventKind::applied, window, tid)}, spun};
      if (by_kernel) {
        excuses.push_back(
            {Facts::of_thread(EventKind::priority_inheritance, {0, event->time}, tid)});
      }
      claims.violation("changed", excuses);
    }
  }
  const auto life = facts.life();
  const auto unnumbered = [&](EventKind kind) { return Facts::of_thread(kind, life, tid, true); };
  if (by_kernel) {
    const auto lost_switch = Facts::of_thread(EventKind::context_switch, {0, kForever}, tid);
    if (facts.of(EventKind::applied, {.tid = tid}).empty()) {
      Conjunction lost{unnumbered(EventKind::applied)};
      if (facts.of(EventKind::context_switch, {.tid = tid}).empty()) {
        lost.push_back(lost_switch);
      }
      claims.needs("lost read-back and switch", lost);
    } else {
      claims.needs("lost switch", {lost_switch});
      claims.needs("lost boost",
                   {Facts::of_thread(EventKind::priority_inheritance, {0, kForever}, tid)});
    }
  }
  const auto of_life = [&](EventKind kind) { return Facts::of_thread(kind, life, tid); };
  for (const auto kind : {EventKind::applied, EventKind::audit}) {
    if (!facts.of(kReadBacks, {.tid = tid}).empty()) {
      claims.needs("lost read-back", {of_life(kind)});
    }
  }
  claims.needs("lost read-backs", {of_life(EventKind::applied), of_life(EventKind::audit)});
  claims.needs("lost spin", {of_life(EventKind::announcement), unnumbered(EventKind::applied),
                             unnumbered(EventKind::audit)});
}

void e2(const Facts& facts, int callback, NamedClaims& claims) {
  const auto& instances = facts.instances(callback);
  claims.checked(instances.size());
  for (std::size_t i = 0; i < instances.size(); ++i) {
    for (std::size_t j = i + 1; j < instances.size(); ++j) {
      const auto& a = instances[i];
      const auto& b = instances[j];
      if (a.end == nullptr) {
        claims.violation(
            "no end before the next start",
            {{Facts::hidden(EventKind::run_end, between(a.since, b.until), callback, a.tid)}});
      } else if (b.until < a.end->time) {
        claims.violation("overlap");
      } else if (b.since < a.end->time) {
        claims.needs("when the later one started", start_within(b));
      }
    }
  }
  const auto lost = facts.lost_runs(callback);
  for (const auto& run : lost) {
    if (!instances.empty()) {
      claims.needs("lost run", run);
      continue;
    }
    for (const auto& more : lost) {
      claims.needs("lost runs", run + more);
    }
  }
}

void e3(const Facts& facts, int tid, NamedClaims& claims) {
  std::vector<Instance> here;
  for (int c = 0; c < kCallbacks; ++c) {
    for (const auto& instance : facts.instances(c)) {
      if (instance.tid == tid) {
        here.push_back(instance);
      }
    }
  }
  claims.checked(here.size());
  for (const auto& a : here) {
    for (const auto& b : here) {
      if (a.callback == b.callback) {
        continue;
      }
      if (a.until < b.since) {
        if (a.end == nullptr) {
          claims.violation(
              "no end before it",
              {{Facts::hidden(EventKind::run_end, between(a.until, b.until), a.callback, tid)}});
        } else if (b.until < a.end->time) {
          claims.violation("nests");
        } else if (b.since < a.end->time) {
          claims.needs("when the inner one started", start_within(b));
        }
      } else if (a.since < b.until && (a.end == nullptr || a.end->time >= b.since)) {
        claims.needs("which of the two started first", start_within(b));
      }
    }
  }
  std::map<int, Conjunction> lost;
  for (int c = 0; c < kCallbacks; ++c) {
    if (auto run = facts.lost_run(c, tid, facts.life())) {
      lost.emplace(c, *std::move(run));
    }
  }
  for (const auto& [c, run] : lost) {
    const bool is_beside =
        std::any_of(here.begin(), here.end(),
                    [callback = c](const Instance& other) { return other.callback != callback; });
    if (is_beside) {
      claims.needs("lost run beside others", run);
    }
    for (auto other = lost.upper_bound(c); other != lost.end(); ++other) {
      claims.needs("lost runs of two", run + other->second);
    }
  }
}

// That there was an instance is known by its end; what its start shows is not.
void needs_starts_of_known(const Facts& facts, int callback, NamedClaims& claims) {
  for (const auto& instance : facts.instances(callback)) {
    if (instance.start == nullptr) {
      claims.needs("start not seen", start_within(instance));
    }
  }
}

void r2(const Facts& facts, int callback, NamedClaims& claims) {
  int missed = 0;
  for (const auto* start : facts.of(EventKind::run_start, {.callback = callback})) {
    claims.checked();
    missed += start->value;
  }
  if (missed > kAllowed) {
    claims.violation("skipped");
  }
  needs_starts_of_known(facts, callback, claims);
  for (const auto& run : facts.lost_runs(callback)) {
    claims.needs("lost run", run);
  }
}

void r3(const Facts& facts, int callback, NamedClaims& claims) {
  needs_starts_of_known(facts, callback, claims);
  constexpr auto kUserKinds = analysis::kStateKinds | analysis::kRunKinds;
  for (const auto& instance : facts.instances(callback)) {
    claims.checked();
    if (instance.start == nullptr) {
      continue;
    }
    const int due = instance.start->release + kDeadline;
    if (instance.end != nullptr) {
      if (instance.end->time > due) {
        claims.violation("late");
      }
      continue;
    }
    const int start = instance.start->time;
    const auto later = facts.of(kUserKinds, {.after = std::max(due, start)});
    if (start > due) {
      claims.violation("late at its start");
    } else if (!later.empty()) {
      claims.violation("open beyond it",
                       {{Facts::of_callback(EventKind::run_end, between(start, later.front()->time),
                                            callback)}});
    }
    claims.needs("what its process did later",
                 {Facts::hidden(kUserKinds, {due + 1, facts.life().end}, kNone, kNone)});
  }
  for (const auto& run : facts.lost_runs(callback)) {
    claims.needs("lost run", run);
  }
}

}  // namespace

Judged judge(const Recording& recording, Rule rule, int subject, bool at_home) {
  const Facts facts{recording, at_home};
  NamedClaims claims{facts.knowledge()};
  switch (rule) {
    case Rule::m2:
      m2(facts, subject, claims);
      break;
    case Rule::m3:
      m3(facts, subject, claims);
      break;
    case Rule::m4:
      m4(facts, subject, claims);
      break;
    case Rule::m7:
      m7(facts, subject, claims);
      break;
    case Rule::m9:
      m9(facts, subject, claims);
      break;
    case Rule::s1:
      s1(facts, subject, claims);
      break;
    case Rule::s3: {
      s3(facts, subject, claims, false);
      NamedClaims by_kernel{facts.knowledge()};
      s3(facts, subject, by_kernel, true);
      const auto user = claims.judged();
      const auto kernel = by_kernel.judged();
      const auto verdict = analysis::of_both(user.verdict, kernel.verdict);
      return verdict == user.verdict ? user : kernel;
    }
    case Rule::s3_by_read_back:
      s3(facts, subject, claims, false);
      break;
    case Rule::e2:
      e2(facts, subject, claims);
      break;
    case Rule::e3:
      e3(facts, subject, claims);
      break;
    case Rule::r2:
      r2(facts, subject, claims);
      break;
    case Rule::r3:
      r3(facts, subject, claims);
      break;
  }
  return claims.judged();
}

}  // namespace cie::test::small
