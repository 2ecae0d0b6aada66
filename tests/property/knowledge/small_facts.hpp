// What a recording of the small system shows, with all proofs that follow from it.
#pragma once

#include "knowledge/claims.hpp"
#include "knowledge/knowledge.hpp"
#include "small_system.hpp"

#include <array>
#include <optional>
#include <utility>
#include <vector>

namespace cie::test::small {

using analysis::Conjunction;
using analysis::Hidden;

// Ticks, both ends included.
struct Window {
  int begin = 0;
  int end = 0;
};
inline Window between(int begin, int end) { return {begin + 1, end - 1}; }

constexpr EventKinds kReadBacks{EventKind::applied, EventKind::audit};

// An instance as far as it is known. since, until: when it started, exactly or within which bounds.
struct Instance {
  int callback = 0;
  int seq = 0;
  int tid = 0;
  int since = 0;
  int until = 0;
  const Event* start = nullptr;
  const Event* end = nullptr;
  const Event& shown() const { return start != nullptr ? *start : *end; }
};

class Facts {
 public:
  Facts(const Recording& recording, bool at_home);

  const analysis::Knowledge& knowledge() const { return knowledge_; }
  const World& world() const { return recording_->world; }
  const std::vector<Instance>& instances(int callback) const { return instances_.at(callback); }

  struct Of {
    int callback = kNone;
    int tid = kNone;
    int after = -1;
    int before = kForever;
  };
  std::vector<const Event*> of(EventKinds kinds, Of of) const;
  std::vector<const Event*> of(EventKinds kinds) const { return of(kinds, Of{}); }

  static Hidden hidden(EventKinds kinds, Window window, int callback, int tid,
                       bool is_unnumbered = false);
  static Hidden of_thread(EventKinds kinds, Window window, int tid, bool is_unnumbered = false) {
    return hidden(kinds, window, kNone, tid, is_unnumbered);
  }
  static Hidden of_callback(EventKinds kinds, Window window, int callback,
                            bool is_unnumbered = false) {
    return hidden(kinds, window, callback, kNone, is_unnumbered);
  }

  Window life() const { return {0, run_end_ != nullptr ? run_end_->time - 1 : kForever}; }
  bool is_seen(int callback) const;
  // Which life of the thread number it is then; kNone: of none that was announced.
  int life_of(int tid, int time) const;
  // The exit, or the begin, since which the thread was not announced by then. Nothing: it is.
  std::optional<int> off_since(int tid, int time) const;
  // What would have to be hidden for a run there. Of a callback never seen: its registration, too. Nothing: no run is
  // presumed there.
  std::optional<Conjunction> lost_run(int callback, int tid, Window window) const;
  std::vector<Conjunction> lost_runs(int callback) const;
  // What would have to be hidden for another thread to have the number.
  Conjunction replaced(int tid, int begin, int end) const;
  // When it was last seen to be announced, for a run at that time.
  int last_on(int tid, int time) const;
  // A run of it then may be followed by one on another thread, itself having ended.
  bool ends_between(int tid, int begin, int end) const;
  // It was seen to end, or its number to be given to another thread.
  bool is_gone(int tid, int ran, int time) const;

 private:
  void discharge(EventKinds kinds, Window window, int callback, int tid);
  void expect_announcements();
  void discharge_exits(int tid);
  void discharge_reads(int tid);
  void discharge_runs(int callback);
  void discharge_ends_and_registrations();

  const Recording* recording_;
  bool at_home_;
  analysis::Knowledge knowledge_;
  const Event* run_end_ = nullptr;
  Per<std::vector<Instance>, kCallbacks> instances_;
};

inline Conjunction operator+(Conjunction a, const Conjunction& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace cie::test::small
