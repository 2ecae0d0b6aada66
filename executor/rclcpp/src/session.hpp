// The threads of callbacks between calls of spin_some() and the like.
#pragma once

#include <cie/scheduling/cancellation.hpp>
#include <cie/scheduling/executor_core.hpp>

#include "admission.hpp"

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

namespace cie_rclcpp {

// They are started by the first such call and stay for the next one, so that a loop of calls costs no threads; while
// nobody calls, none begins an instance. The thread "cie-spin" is their dispatcher. For the spinning thread.
class Session {
 public:
  Session(std::shared_ptr<cie::scheduling::ExecutorCore> core,
          std::shared_ptr<Admission> admission);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session() { abandon(); }

  // Unless it goes on: starts it, and returns when the threads serve. Throws what spin() throws.
  void begin();
  // Whether nobody cancelled it, and nothing failed.
  bool goes_on() const;
  // Throws what ended it, if that was a failure.
  void rethrow();
  // Returns when its threads have ended. Throws what ended it before.
  void end();
  void abandon() noexcept;

 private:
  enum class Stage : std::uint8_t { none, starting, serving, leaving, ended };

  void run() noexcept;
  void set(Stage stage);

  const std::shared_ptr<cie::scheduling::ExecutorCore> core_;
  const std::shared_ptr<Admission> admission_;
  std::thread thread_;
  mutable std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  Stage stage_ = Stage::none;
  const cie::scheduling::Cancellation* cancellation_ = nullptr;  // while it serves
  std::exception_ptr failure_;
};

}  // namespace cie_rclcpp
