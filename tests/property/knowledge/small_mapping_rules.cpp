#include "named_claims.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace cie::test::small {
namespace {

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

}  // namespace

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

namespace {

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

}  // namespace

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

namespace {

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

}  // namespace

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

}  // namespace cie::test::small
