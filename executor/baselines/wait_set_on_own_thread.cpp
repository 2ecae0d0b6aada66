#include "wait_set_on_own_thread.hpp"

#include <cie/scheduling/threads.hpp>

#include "wait_set_loop.hpp"

#include <thread>

namespace cie::executor {

WaitSetOnOwnThread::WaitSetOnOwnThread(const LoopParts& parts)
    : OwnThread(std::make_unique<WaitSetLoop>(parts)) {}

// cancel() may be called where DDS must not be: somebody else tells the wait set. So does rclcpp.
void WaitSetOnOwnThread::run(std::int64_t deadline_ns, Cancellation& cancellation) {
  std::jthread canceller{[this, &cancellation] {
    set_current_thread_name("cie-cancel");
    cancellation.wait_until(kNever);
    loop().wake();
  }};
  try {
    loop().run(deadline_ns);
  } catch (...) {
    cancellation.cancel();
    throw;
  }
  cancellation.cancel();
}

}  // namespace cie::executor
