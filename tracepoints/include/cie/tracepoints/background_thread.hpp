// Threads for what has time, beside real-time ones.
#pragma once

#include <functional>
#include <string>
#include <thread>

namespace cie {

// SCHED_OTHER and nice 10 whatever its creator is, all signals blocked, on its creator's CPUs, with
// a small stack. Its owner makes the function return; the destructor waits for that.
class BackgroundThread {
 public:
  // `name` has at most 15 bytes; `function` must not throw. Throws std::system_error.
  BackgroundThread(std::string name, std::function<void()> function);
  ~BackgroundThread();
  BackgroundThread(const BackgroundThread&) = delete;
  BackgroundThread& operator=(const BackgroundThread&) = delete;

 private:
  static void* enter(void* self) noexcept;

  std::string name_;
  std::function<void()> function_;
  std::thread::native_handle_type thread_{};
};

}  // namespace cie
