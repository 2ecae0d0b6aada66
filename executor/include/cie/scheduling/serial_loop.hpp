// Callbacks served one after the other, in the order in which they were added.
#pragma once

#include <cie/scheduling/one_thread_loop.hpp>

#include <cstdint>

namespace cie::scheduling {

// The dispatch of a callback's own thread, of a group's, and of the single-threaded executor: looks
// at each callback in turn.
class SerialLoop final : public OneThreadLoop {
 public:
  using OneThreadLoop::OneThreadLoop;
  void on_ready(Callback& callback) noexcept override;

 private:
  bool pass() override;
  std::int64_t next_due() const noexcept override;
};

}  // namespace cie::scheduling
