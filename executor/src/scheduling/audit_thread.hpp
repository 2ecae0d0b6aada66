// The ordinary thread that audits the parameters of the others from time to time.
#pragma once

#include <cie/scheduling/thread_configurator.hpp>
#include <cie/tracepoints/background_thread.hpp>

#include <chrono>
#include <condition_variable>
#include <mutex>

namespace cie::scheduling {

// Runs from construction to destruction; the configurator outlives it.
class AuditThread {
 public:
  AuditThread(ThreadConfigurator& configurator, std::chrono::nanoseconds period)
      : configurator_(configurator), period_(period) {}
  AuditThread(const AuditThread&) = delete;
  AuditThread& operator=(const AuditThread&) = delete;
  ~AuditThread() {
    {
      const std::lock_guard lock{mutex_};
      is_stopping_ = true;
    }
    changed_.notify_all();
  }

 private:
  void run() noexcept;

  ThreadConfigurator& configurator_;
  const std::chrono::nanoseconds period_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_stopping_ = false;
  BackgroundThread thread_{"cie-audit", [this] { run(); }};  // last: it uses all of them
};

}  // namespace cie::scheduling
