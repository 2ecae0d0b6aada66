#include "target/escalation.hpp"

namespace cie::record {

Escalation::Step Escalation::ask(Clock::time_point now) noexcept {
  if (asked_ && now - *asked_ < kSame) return Step::none;
  const bool is_first = !asked_;
  asked_ = now;
  if (is_first || is_killed_) return Step::none;
  if (terminated_) {
    is_killed_ = true;
    return Step::kill;
  }
  terminated_ = now;
  return Step::terminate;
}

void Escalation::terminated(Clock::time_point now) noexcept {
  if (!asked_) asked_ = now;
  if (!terminated_) terminated_ = now;
}

Escalation::Step Escalation::pass(Clock::time_point now) noexcept {
  if (terminated_) {
    if (is_killed_ || now - *terminated_ < kUntilKilled) return Step::none;
    is_killed_ = true;
    return Step::kill;
  }
  if (!asked_ || has_said_so_ || now - *asked_ < kSilent) return Step::none;
  has_said_so_ = true;
  return Step::say_so;
}

}  // namespace cie::record
