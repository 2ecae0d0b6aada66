// The thread of a process that answers the parameter services of all its nodes.
#pragma once

#include <cie/tracepoints/background_thread.hpp>
#include <cie/tracepoints/trace.hpp>

#include "wakeup.hpp"

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace cie::executor {

// Parameters are set and asked for at any time, by anybody on the network. On a thread of its own
// that takes no time of a callback's thread, adds no callback to a trace, and can be given
// parameters as any other thread; without any it is an ordinary one of low weight. Thread-safe.
class ParameterServer {
 public:
  // Literally in traces and scheduling specs.
  static constexpr const char* kThreadName = "cie-parameters";

  // The services of one node.
  class Endpoint {
   public:
    Endpoint() = default;
    Endpoint(const Endpoint&) = delete;
    Endpoint& operator=(const Endpoint&) = delete;
    virtual ~Endpoint() = default;
    // Answers what waits. On the server's thread; must not throw.
    virtual void serve() noexcept = 0;
  };

  // Returns when the thread is there and announced. Throws std::system_error.
  ParameterServer();
  ParameterServer(const ParameterServer&) = delete;
  ParameterServer& operator=(const ParameterServer&) = delete;
  ~ParameterServer();

  void add(Endpoint& endpoint);
  // Returns when the endpoint is not being served and will not be; at once on the server's thread.
  void remove(Endpoint& endpoint);
  // To be notified when there is something to answer.
  Wakeup& wakeup() noexcept { return wakeup_; }
  const std::shared_ptr<trace::Thread>& thread() const noexcept { return trace_; }

 private:
  void run();
  void serve_all();

  Wakeup wakeup_;
  std::atomic<bool> is_stopped_{false};
  std::atomic<std::thread::id> runner_{};
  std::shared_ptr<trace::Thread> trace_;
  std::mutex mutex_;  // of what follows, and of trace_ until the constructor returns
  std::condition_variable changed_;
  std::vector<Endpoint*> endpoints_;
  Endpoint* serving_ = nullptr;
  // Users' functions run on it. Last: it uses the others.
  std::optional<BackgroundThread> thread_;
};

}  // namespace cie::executor
