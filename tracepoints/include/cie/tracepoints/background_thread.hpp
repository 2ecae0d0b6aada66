// Threads for what has time, beside real-time ones.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <thread>

namespace cie {

// SCHED_OTHER and nice 10 whatever its creator is, all signals blocked, on its creator's CPUs. Its
// owner makes the function return; the destructor waits for that.
class BackgroundThread {
 public:
  static constexpr std::size_t kSmallStack = 256UL * 1024;
  static constexpr std::size_t kLargeStack = 8UL * 1024 * 1024;

  // `name` has at most 15 bytes; `function` must not throw. Throws std::system_error.
  // For functions of others the stack should be larger.
  BackgroundThread(std::string name, std::function<void()> function,
                   std::size_t stack_bytes = kSmallStack);
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
