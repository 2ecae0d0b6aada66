// One thread of low weight for work that is asked for at any time.
#pragma once

#include <cie/scheduling/wakeup.hpp>
#include <cie/tracepoints/background_thread.hpp>
#include <cie/tracepoints/trace.hpp>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace cie::scheduling {

// What others ask of the process (its parameters, say) takes no time of a callback's thread here,
// and adds no callback to a trace. The thread is announced as a worker and can be given parameters
// as any other; without any it is an ordinary one. Thread-safe.
class BackgroundServer {
 public:
  // Somebody with work for the thread.
  class Endpoint {
   public:
    Endpoint() = default;
    Endpoint(const Endpoint&) = delete;
    Endpoint& operator=(const Endpoint&) = delete;
    virtual ~Endpoint() = default;
    // Does what waits. On the server's thread; must not throw.
    virtual void serve() noexcept = 0;
  };

  // `name` has at most 15 bytes. Returns when the thread is there and announced. Throws
  // std::system_error.
  explicit BackgroundServer(const std::string& name);
  BackgroundServer(const BackgroundServer&) = delete;
  BackgroundServer& operator=(const BackgroundServer&) = delete;
  ~BackgroundServer();

  void add(Endpoint& endpoint);
  // Returns when the endpoint is not being served and will not be; at once on the server's thread.
  void remove(Endpoint& endpoint);
  // Returns when no endpoint is being served; at once on the server's thread.
  void wait_until_idle();
  // To be notified when there is something to do.
  Wakeup& wakeup() noexcept { return wakeup_; }
  const std::shared_ptr<trace::Thread>& thread() const noexcept { return trace_; }

 private:
  void run(const std::string& name);
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

}  // namespace cie::scheduling
