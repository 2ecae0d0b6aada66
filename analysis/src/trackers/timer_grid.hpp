// When a timer of rcl expired. Its expiries lie on a grid that begins as the timer is made: each
// call of the timer leaves the first of them that is yet to come as the next one, and skips the
// others. No event tells of calls; an executor calls a timer shortly before the callback's start.
//
// Nor does any event tell of a reset, or of the timer's clock. So an expiry is believed only if it
// is the one that can be meant and the start follows at once, or as soon as what ran before it
// lets it, which a start at once has to prove later; and a grid before whose expiry an instance starts, that too many instances are late for
// without a reason, or that prompt starts have left for good, is refuted.
#pragma once

#include <cie/analysis/report.hpp>
#include <cie/analysis/time.hpp>

#include "latency_step.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace cie::analysis {

class TimerGrid {
 public:
  // Expiries are this one and those that follow; all may be up to kTimerError later.
  TimerGrid(Timestamp first_expiry, Duration period) : first_(first_expiry), period_(period) {}
  // Whether expiries so near to each other can be told apart.
  static bool is_possible(std::uint64_t period_ns) noexcept;

  struct Start {
    Timestamp time;
    std::optional<Timestamp> called_after;  // the timer was called since then
    std::optional<Timestamp> busy_since;    // what let it start only now; empty: nothing did
    // When an instance before it started or ended on its thread.
    std::optional<Timestamp> after{};
    // Callbacks run on its thread since then, or the timer's own may on another one.
    std::optional<Timestamp> served_since{};
    // It is in the window that was asked for: of others nothing is counted but what tells of the grid.
    bool is_inside = true;
  };
  struct Release {
    Timestamp expiry;
    // Periods skipped since the last instance whose release is known. Empty: it is not known.
    std::optional<std::uint32_t> missed{};
    bool is_missed_its_own = true;  // there was no instance in between
    // Whether the start followed at once: if not, a later one that does has to prove that the grid
    // did not move before.
    bool is_prompt = true;
  };
  // The release of the next instance. Empty: unknown.
  std::optional<Release> on_start(const Start& start);
  // Before the first start that is told there were others. The last one started then, and none went
  // unseen since; empty: that is not known.
  void begin_after(const std::optional<Timestamp>& start) noexcept;
  // Instances may have gone unseen.
  void lose() noexcept;

  bool is_refuted() const noexcept { return is_refuted_; }
  // Whether, all instances seen, it is believed.
  bool holds() const noexcept { return !is_refuted_ && !is_mostly_late() && !step_.is_open(); }
  // Whether the latest start was prompt: had the timer been reset it was not, unless that moved the
  // grid by no more than error().
  bool is_steady() const noexcept { return is_steady_; }
  // A reset moves the grid for all that follow, and none starts before its release: the grid is
  // off by at most what all of some consecutive starts lie behind it.
  Duration error() const noexcept;
  // How many starts were prompt.
  std::uint64_t prompt_starts() const noexcept { return prompt_; }
  // What was told of releases inside since the last one: they are not proven.
  struct Unproven {
    std::uint64_t releases = 0;
    std::uint32_t missed = 0;
    Timestamp since;  // when the first of these instances started
  };
  const Unproven& unproven() const noexcept { return unproven_; }
  // Instances inside, the first one only where callbacks ran on its thread before, before which periods may have been skipped unnoticed.
  std::uint64_t unresolved() const noexcept { return unresolved_ + since_anchor_; }

  // So soon after its release an instance starts that waits for nothing.
  static constexpr Duration kPrompt = kMostTimerError;
  // The same of this timer: where most of a period is prompt, a start says nothing of the grid.
  Duration prompt() const noexcept { return std::min(kPrompt, Duration{period_.ns / 4}); }

 private:
  std::int64_t last_until(Timestamp time) const noexcept;
  std::int64_t first_from(Timestamp time) const noexcept;
  void begin_inside() noexcept;
  bool is_believed(Timestamp expiry, const Start& start);
  // Of few starts some are prompt by chance.
  bool is_mostly_late() const noexcept {
    return late_ > (prompt_ < kEnoughPrompt ? prompt_ / 4 : prompt_);
  }
  std::optional<std::uint32_t> skipped_until(std::int64_t release, bool is_known);

  static constexpr std::uint64_t kEnoughPrompt = 8;
  Timestamp first_;
  Duration period_;
  // The next release, by number of expiry.
  std::int64_t earliest_ = 0;
  std::optional<std::int64_t> latest_;
  // From which on skipped periods are counted, and how many instances ago that was.
  std::optional<std::int64_t> anchor_;
  std::uint64_t since_anchor_ = 0;
  std::uint64_t unresolved_ = 0;
  bool is_inside_ = true;  // the latest start
  bool has_started_ = false;
  bool is_cut_ = false;        // what the first instance was released by is not known at all
  bool is_confirmed_ = false;  // by a prompt start since the last late one
  std::uint64_t prompt_ = 0;
  Duration floor_ = prompt();  // of the latest prompt starts, up to kEnoughPrompt of them
  Duration highest_floor_;
  Duration last_prompt_;
  LatencyStep step_{kTimerError};  // of prompt starts
  bool is_steady_ = false;
  Unproven unproven_;
  std::uint64_t late_ = 0;  // without a reason
  bool is_refuted_ = false;
};

}  // namespace cie::analysis
