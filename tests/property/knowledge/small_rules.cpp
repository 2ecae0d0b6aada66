#include "small_rules.hpp"

#include "small_facts.hpp"

#include <algorithm>
#include <map>
#include <set>

namespace cie::test::small {
namespace {

using analysis::Verdict;

// Claims with the reason of a need in words, which the tally of the undecided shows.
class NamedClaims {
 public:
  explicit NamedClaims(const analysis::Knowledge& knowledge) : claims_{knowledge} {}

  void checked(std::size_t count = 1) { claims_.checked(count); }
  void violation(const char* witness, const std::vector<Conjunction>& excuses = {}) {
    claims_.violation(std::string{witness}, excuses);
  }
  void needs(const char* why, const Conjunction& hidden) {
    const bool was_undecided = claims_.verdict() == Verdict::inconclusive;
    claims_.needs(hidden);
    if (!was_undecided && claims_.verdict() == Verdict::inconclusive) {
      why_ = why;
    }
  }
  Judged judged() const { return {claims_.verdict(), claims_.witness().value_or(why_)}; }

 private:
  analysis::Claims<std::string> claims_;
  std::string why_;
};

struct RanOn {
  int time;
  int callback;
  auto operator<=>(const RanOn&) const = default;
};

// By start, or by end where the start is hidden.
std::vector<RanOn> runs_on(const Facts& facts, int tid) {
  std::vector<RanOn> found;
  for (int c = 0; c < kCallbacks; ++c) {
    for (const auto& instance : facts.instances(c)) {
      if (instance.tid == tid) {
        found.push_back({instance.shown().time, c});
      }
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

void m2(const Facts& facts, int tid, NamedClaims& claims) {
  const auto runs = runs_on(facts, tid);
  claims.checked(runs.size());
  for (std::size_t i = 0; i + 1 < runs.size(); ++i) {
    const auto& [t, a] = runs[i];
    const auto& [u, b] = runs[i + 1];
    if (a != b && facts.life_of(tid, t) == facts.life_of(tid, u)) {
      claims.violation("two callbacks", {facts.replaced(tid, t, u)});
    }
  }
  std::vector<int> lives{-1};
  for (const auto* event : facts.of(EventKind::announcement, {.tid = tid})) {
    if (facts.life_of(tid, event->time) != facts.life_of(tid, event->time + 1)) {
      lives.push_back(event->time);
    }
  }
  lives.push_back(kForever);
  for (std::size_t i = 0; i + 1 < lives.size(); ++i) {
    std::set<int> ran;
    for (const auto& run : runs) {
      if (lives[i] < run.time && run.time < lives[i + 1]) {
        ran.insert(run.callback);
      }
    }
    std::vector<Conjunction> lost;
    for (int c = 0; c < kCallbacks; ++c) {
      if (!ran.contains(c) || ran.size() > 1) {
        if (auto run = facts.lost_run(c, tid, between(lives[i], lives[i + 1]))) {
          lost.push_back(*std::move(run));
        }
      }
    }
    for (std::size_t a = 0; a < lost.size(); ++a) {
      if (!ran.empty()) {
        claims.needs("lost run of another callback", lost[a]);
      }
      for (std::size_t b = a + 1; ran.empty() && b < lost.size(); ++b) {
        claims.needs("lost runs of two callbacks", lost[a] + lost[b]);
      }
    }
  }
}

// Where a lost run may be: between two known runs, on that thread.
struct LostMove {
  int begin;
  int end;
  int former;  // thread of the known run before
  int later;   // of that behind
  int tid;
  Conjunction run;
};

std::vector<LostMove> lost_moves(const Facts& facts, int callback) {
  std::vector<std::pair<int, int>> known{{-1, kNone}};
  for (const auto& instance : facts.instances(callback)) {
    known.emplace_back(instance.shown().time, instance.tid);
  }
  known.emplace_back(kForever, kNone);
  std::vector<LostMove> found;
  for (std::size_t i = 0; i + 1 < known.size(); ++i) {
    for (int tid = 0; tid < kThreads; ++tid) {
      if (auto run = facts.lost_run(callback, tid, {known[i].first, known[i + 1].first})) {
        found.push_back({known[i].first, known[i + 1].first, known[i].second, known[i + 1].second,
                         tid, *std::move(run)});
      }
    }
  }
  return found;
}

std::vector<Conjunction> ran_elsewhere(const Facts& facts, int callback, Window window) {
  std::vector<Conjunction> found;
  for (int tid = 0; tid < kThreads; ++tid) {
    if (auto run = facts.lost_run(callback, tid, between(window.begin, window.end))) {
      found.push_back(*std::move(run));
    }
  }
  return found;
}

Conjunction start_within(const Instance& instance) {
  return {Facts::of_callback(EventKind::run_start, {instance.since, instance.until},
                             instance.callback, true)};
}

void m4(const Facts& facts, int callback, NamedClaims& claims) {
  const auto& instances = facts.instances(callback);
  claims.checked(instances.size());
  for (std::size_t i = 0; i + 1 < instances.size(); ++i) {
    const auto& a = instances[i];
    const auto& b = instances[i + 1];
    const int t = a.since;  // the former at the earliest, the latter at the latest
    const int u = b.until;
    if (!facts
             .of(EventKind::registration,
                 {.callback = callback, .after = a.until, .before = b.since})
             .empty()) {
      continue;
    }
    const int ran = a.shown().time;
    const int ran_again = b.shown().time;
    const bool is_same =
        a.tid == b.tid && facts.life_of(a.tid, ran) == facts.life_of(b.tid, ran_again);
    const bool is_gone = facts.is_gone(a.tid, ran, b.since);
    if (!is_same && is_gone != facts.is_gone(a.tid, ran, b.until)) {
      claims.needs("when it started", start_within(b));
    }
    if (is_same) {
      claims.needs("the tid may be another's", facts.replaced(a.tid, ran, ran_again));
    } else if (is_gone && a.until < b.since) {
      auto excuses = ran_elsewhere(facts, callback, {t, u});
      excuses.push_back({Facts::of_callback(EventKind::registration, between(t, u), callback)});
      if (a.tid != b.tid) {
        const int off = facts.off_since(a.tid, u).value_or(ran);
        excuses.push_back({Facts::of_thread(EventKind::announcement, between(off, u), a.tid)});
      }
      claims.violation("moved", excuses);
    } else {
      claims.needs("exit of the former thread",
                   {Facts::of_thread(EventKind::thread_exit, {facts.last_on(a.tid, t), u}, a.tid)});
    }
  }
  for (const auto& [begin, end, former, later, tid, run] : lost_moves(facts, callback)) {
    const auto exit = [&facts, begin = begin, end = end](int left) {
      return facts.ends_between(left, begin, end)
                 ? Conjunction{}
                 : Conjunction{Facts::of_thread(EventKind::thread_exit, between(-1, end), left)};
    };
    if (former != kNone && former != tid) {
      claims.needs("lost run on another thread", run + exit(former));
    }
    if (later != kNone && later != tid) {
      claims.needs("lost run on another thread", run + exit(tid));
    }
    for (int other = 0; other < kThreads; ++other) {
      if (other != tid) {
        if (const auto more = facts.lost_run(callback, other, {begin, end})) {
          claims.needs("lost runs on two threads", run + *more + exit(tid));
        }
      }
    }
    if (tid == former || tid == later) {  // under the number of the same thread
      claims.needs("lost run on a replaced thread", run + facts.replaced(tid, begin, end));
    }
  }
}

void m3(const Facts& facts, int callback, NamedClaims& claims) {
  const auto& instances = facts.instances(callback);
  claims.checked(instances.size());
  for (std::size_t i = 0; i + 1 < instances.size(); ++i) {
    const auto& a = instances[i];
    const auto& b = instances[i + 1];
    if (a.tid == b.tid) {
      continue;
    }
    const int ran = a.shown().time;
    const bool is_gone = facts.is_gone(a.tid, ran, b.since);
    if (is_gone != facts.is_gone(a.tid, ran, b.until)) {
      claims.needs("when it started", start_within(b));
    } else if (!is_gone) {
      auto excuses = ran_elsewhere(facts, callback, {a.since, b.until});
      excuses.push_back({Facts::of_thread(EventKind::thread_exit,
                                          {facts.last_on(a.tid, a.since), b.until}, a.tid)});
      claims.violation("both live", excuses);
    } else {
      claims.needs("the former may spin again",
                   {Facts::of_thread(EventKind::announcement, {-1, b.until}, a.tid)});
    }
  }
  for (const auto& [begin, end, former, later, tid, run] : lost_moves(facts, callback)) {
    if ((former != kNone && former != tid) || (later != kNone && later != tid)) {
      claims.needs("lost run on another thread", run);
    }
    for (int other = 0; other < kThreads; ++other) {
      if (other != tid) {
        if (const auto more = facts.lost_run(callback, other, {begin, end})) {
          claims.needs("lost runs on two threads", run + *more);
        }
      }
    }
  }
}

void m7(const Facts& facts, int id, NamedClaims& claims) {
  const char name = static_cast<char>('a' + id);
  std::vector<const Event*> registrations;
  for (const auto* event : facts.of(EventKind::registration)) {
    if (facts.world().ids.at(event->callback) == name) {
      registrations.push_back(event);
    }
  }
  claims.checked(registrations.size());
  for (const auto* later : registrations) {
    std::set<int> others;
    for (const auto* event : registrations) {
      if (event->time < later->time && event->callback != later->callback) {
        others.insert(event->callback);
      }
    }
    for (const int c : others) {
      if (!facts.of(EventKind::callback_exit, {.callback = c, .before = later->time}).empty()) {
        continue;
      }
      int last = -1;
      int before = -1;
      for (const auto* sign : facts.of({EventKind::registration, EventKind::run_start,
                                        EventKind::run_end, EventKind::callback_exit},
                                       {.callback = c})) {
        last = sign->kind == EventKind::run_end ? last : std::max(last, sign->time);
        before = sign->time < later->time ? std::max(before, sign->time) : before;
      }
      std::vector<Conjunction> excuses;
      if (last <= later->time) {
        excuses.push_back(
            {Facts::of_callback(EventKind::callback_exit, between(before, later->time), c)});
      }
      claims.violation("both live", excuses);
    }
  }
  for (int c = 0; c < kCallbacks; ++c) {
    if (facts.world().ids.at(c) != name) {  // (ids of unseen callbacks are known here)
      continue;
    }
    const auto own = facts.of(EventKind::registration, {.callback = c});
    if (own.empty()) {
      claims.needs("registration of any id",
                   {Facts::of_callback(EventKind::registration, facts.life(), c)});
      continue;
    }
    const auto other =
        std::find_if(registrations.begin(), registrations.end(), [&](const Event* event) {
          return event->callback != c && event->time < own.front()->time;
        });
    if (other != registrations.end()) {
      claims.needs(
          "registered before",
          {Facts::of_callback(EventKind::registration, {(*other)->time, own.front()->time}, c)});
    }
  }
}

// When the thread number was not announced.
std::vector<Window> off_windows(const Facts& facts, int tid) {
  std::vector<Window> found;
  std::optional<int> begin = -1;
  for (const auto* event : facts.of(
           {EventKind::announcement, EventKind::thread_exit, EventKind::applied, EventKind::audit},
           {.tid = tid})) {
    if (begin) {  // until its announcement, which is hidden if this is another mark of it
      found.push_back({*begin, event->time});
    }
    begin = event->kind == EventKind::thread_exit ? std::optional{event->time} : std::nullopt;
  }
  if (begin) {
    found.push_back({*begin, kForever});
  }
  return found;
}

void m9(const Facts& facts, int tid, NamedClaims& claims) {
  const auto off_all = off_windows(facts, tid);
  for (int c = 0; c < kCallbacks; ++c) {
    for (const auto& instance : facts.instances(c)) {
      if (instance.tid != tid) {
        continue;
      }
      claims.checked();
      const auto off = std::find_if(off_all.begin(), off_all.end(), [&](Window window) {
        return window.begin <= instance.until && instance.since <= window.end;
      });
      if (off != off_all.end() && off->begin < instance.since && instance.until < off->end) {
        claims.violation("unknown thread",
                         {{Facts::of_thread(EventKind::announcement,
                                            between(off->begin, instance.until), tid)}});
      } else if (off != off_all.end()) {
        claims.needs(
            "start before the announcement",
            {Facts::of_thread(EventKind::run_start, {instance.since, instance.until}, tid, true)});
      }
      const int begin = facts.last_on(tid, instance.until);
      const auto later = facts.of(
          {EventKind::announcement, EventKind::thread_exit, EventKind::applied, EventKind::audit},
          {.tid = tid, .after = instance.until});
      Conjunction exit{
          Facts::of_thread(EventKind::thread_exit, between(begin, instance.until), tid)};
      if (!later.empty() && later.front()->kind != EventKind::announcement) {
        exit.push_back(
            Facts::of_thread(EventKind::announcement, between(begin, later.front()->time), tid));
      }
      claims.needs("exit before", exit);
    }
  }
  for (int c = 0; c < kCallbacks; ++c) {
    for (const auto& [begin, end] : off_all) {
      if (const auto run = facts.lost_run(c, tid, between(begin, end))) {
        claims.needs("lost run while not announced", *run);
      }
    }
    if (const auto run = facts.lost_run(c, tid, facts.life())) {
      claims.needs("lost run behind a lost exit",
                   *run + Conjunction{Facts::of_thread(EventKind::thread_exit, facts.life(), tid)});
    }
  }
}

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
