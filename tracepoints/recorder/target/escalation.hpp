// How a command that is asked to end, and goes on, is made to.
#pragma once

#include <chrono>
#include <optional>

namespace cie::record {

// The first that asks is left to the command; the second has it terminated, and killed some time
// later; the third has it killed at once.
class Escalation {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Step { none, say_so, terminate, kill };

  // Who asks again sooner is taken for the same one: timeout(1) signals the recorder, and then its
  // whole group.
  static constexpr std::chrono::seconds kSame{1};
  // For a command's orderly end, before it is said what is waited for.
  static constexpr std::chrono::seconds kSilent{2};
  static constexpr std::chrono::seconds kUntilKilled{5};

  // Somebody asks for the end.
  Step ask(Clock::time_point now) noexcept;
  // It was terminated without being asked.
  void terminated(Clock::time_point now) noexcept;
  // Nobody does, and time passes.
  Step pass(Clock::time_point now) noexcept;

 private:
  std::optional<Clock::time_point> asked_;       // last
  std::optional<Clock::time_point> terminated_;  // since the second time
  bool has_said_so_ = false;
  bool is_killed_ = false;
};

}  // namespace cie::record
