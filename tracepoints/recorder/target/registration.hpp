// Whether anybody is recorded.
#pragma once

#include "lttng/tracing_session.hpp"
#include "options/options.hpp"
#include "system/console.hpp"
#include "system/long_call.hpp"
#include "target/target.hpp"

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace cie::record {

class Registration {
 public:
  // After `options.registration_timeout` it says that nobody has registered.
  Registration(Console& console, const Options& options)
      : console_(console),
        patience_(options.registration_timeout),
        is_ros2_(options.ros2 == Ros2Events::applications) {}

  // Asks until an application is registered at that moment: each question costs every one some time. `is_any_told`:
  // one told that it begins, though it may be gone since, so nobody is missed.
  // Waits a tenth of a second at most; what LTTng answers later is taken at the next call.
  void look(const std::shared_ptr<TracingSession>& session, const Target& target, bool is_any_told);
  // LTTng has not answered yet: nobody else may ask it.
  bool is_asking() const noexcept { return asking_ && !asking_->is_done(); }
  // Waits for that so long. False: it did not.
  bool settle(std::chrono::seconds patience) const;
  // Of those that registered first: says so if one is none of the command's.
  void warn_of_others(const Target& target);

  bool is_anybody() const noexcept { return !first_.empty(); }
  const std::vector<TracedProcess>& first() const noexcept { return first_; }
  // How many registered first.
  std::size_t count() const noexcept { return first_.size(); }

 private:
  Console& console_;
  std::chrono::milliseconds patience_;
  bool is_ros2_;
  std::vector<TracedProcess> first_;
  bool has_warned_of_nobody_ = false;
  bool has_warned_of_others_ = false;
  std::chrono::steady_clock::time_point next_look_{};
  std::optional<LongCall<std::vector<TracedProcess>>> asking_{};
};

}  // namespace cie::record
