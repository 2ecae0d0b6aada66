#include <cie/scheduling/background_server.hpp>
#include <cie/scheduling/clock.hpp>

#include <algorithm>
#include <utility>

namespace cie::scheduling {

BackgroundServer::BackgroundServer(const std::string& name) {
  thread_.emplace(
      name, [this, name] { run(name); }, BackgroundThread::kLargeStack);
  std::unique_lock lock{mutex_};
  changed_.wait(lock, [this] { return trace_ != nullptr; });
}

BackgroundServer::~BackgroundServer() {
  trace_.reset();  // while the thread lives: its last read-back is of what it ran as
  is_stopped_ = true;
  wakeup_.notify();
}

void BackgroundServer::add(Endpoint& endpoint) {
  {
    const std::lock_guard lock{mutex_};
    endpoints_.push_back(&endpoint);
  }
  wakeup_.notify();
}

void BackgroundServer::remove(Endpoint& endpoint) {
  std::unique_lock lock{mutex_};
  std::erase(endpoints_, &endpoint);
  wakeup_.notify();  // whom serve_all() passes over, because they moved up
  if (std::this_thread::get_id() == runner_) return;
  changed_.wait(lock, [this, &endpoint] { return serving_ != &endpoint; });
}

void BackgroundServer::wait_until_idle() {
  std::unique_lock lock{mutex_};
  if (std::this_thread::get_id() == runner_) return;
  changed_.wait(lock, [this] { return serving_ == nullptr; });
}

void BackgroundServer::serve_all() {
  std::unique_lock lock{mutex_};
  for (std::size_t i = 0; i < endpoints_.size(); ++i) {
    serving_ = endpoints_[i];
    lock.unlock();
    serving_->serve();
    lock.lock();
    serving_ = nullptr;
    changed_.notify_all();
  }
}

void BackgroundServer::run(const std::string& name) {
  runner_ = std::this_thread::get_id();
  {
    auto trace = std::make_shared<trace::Thread>(ThreadRole::worker, kNoCallback, kNoGroup, name);
    trace->emit_sched(SchedMoment::initial, 0);
    const std::lock_guard lock{mutex_};
    trace_ = std::move(trace);
    changed_.notify_all();
  }
  while (!is_stopped_) {
    serve_all();
    wakeup_.wait_until(kNever);
  }
}

}  // namespace cie::scheduling
