// SIGINT and SIGTERM end all contexts, on a thread of their own.
#include <atomic>
#include <thread>

#include <rclcpp/rclcpp.hpp>
#include <semaphore.h>
#include <signal.h>

namespace rclcpp {
namespace {

class Signals {
 public:
  static Signals& get() {
    static Signals& signals = *new Signals;
    return signals;
  }
  void install(SignalHandlerOptions which) {
    const std::lock_guard lock{mutex_};
    if (which == SignalHandlerOptions::None || thread_.joinable()) return;
    is_installed_.store(true);
    sem_init(&semaphore_, 0, 0);
    struct sigaction action {};
    action.sa_handler = [](int) {
      get().is_received_.store(true);
      sem_post(&get().semaphore_);
    };
    if (which != SignalHandlerOptions::SigTerm) sigaction(SIGINT, &action, &of_sigint_);
    if (which != SignalHandlerOptions::SigInt) sigaction(SIGTERM, &action, &of_sigterm_);
    which_ = which;
    thread_ = std::thread{[this] { run(); }};
  }
  void uninstall() {
    const std::lock_guard lock{mutex_};
    if (!thread_.joinable()) return;
    if (which_ != SignalHandlerOptions::SigTerm) sigaction(SIGINT, &of_sigint_, nullptr);
    if (which_ != SignalHandlerOptions::SigInt) sigaction(SIGTERM, &of_sigterm_, nullptr);
    is_installed_.store(false);
    sem_post(&semaphore_);
    thread_.join();
  }

 private:
  void run() {
    while (is_installed_.load()) {
      while (sem_wait(&semaphore_) != 0) {
      }
      if (!is_received_.exchange(false)) continue;
      for (const auto& context : get_contexts())
        context->shutdown("signal handler");
    }
  }

  std::mutex mutex_;
  std::thread thread_;
  SignalHandlerOptions which_ = SignalHandlerOptions::None;
  std::atomic<bool> is_installed_{false};
  std::atomic<bool> is_received_{false};
  sem_t semaphore_{};
  struct sigaction of_sigint_ {};
  struct sigaction of_sigterm_ {};
};

}  // namespace

void init(int argc, const char* const* argv, SignalHandlerOptions signals) {
  contexts::get_global_default_context()->init(argc, argv);
  Signals::get().install(signals);
}

bool shutdown(const Context::SharedPtr& context, const std::string& reason) {
  const auto global = contexts::get_global_default_context();
  const bool was_valid = (context ? context : global)->shutdown(reason);
  if (!context || context == global) Signals::get().uninstall();
  return was_valid;
}

}  // namespace rclcpp
