// Messages that were taken for instances which did not begin.
#pragma once

#include <cie/executor/message.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include "dds/message_pool.hpp"

#include <atomic>
#include <cstddef>
#include <deque>
#include <mutex>
#include <utility>

namespace cie::executor {

// A cancel() came between: they are the first of the next spin. Thread-safe; asking an empty one takes
// no lock.
class KeptMessages {
 public:
  void add(const MessagePool::Loan& message, const MessageInfo& info) {
    const std::lock_guard lock{mutex_};
    kept_.emplace_back(message.handle(), info);
    size_.store(kept_.size(), std::memory_order_release);
  }
  // The oldest, if there is one.
  bool take(MessagePool::Loan& message, MessageInfo& info) {
    if (size() == 0) return false;
    const std::lock_guard lock{mutex_};
    if (kept_.empty()) return false;
    message.refer_to(std::move(kept_.front().first));
    info = kept_.front().second;
    kept_.pop_front();
    size_.store(kept_.size(), std::memory_order_release);
    return true;
  }
  std::size_t size() const noexcept { return size_.load(std::memory_order_acquire); }

 private:
  std::atomic<std::size_t> size_{0};
  PriorityMutex mutex_;  // of what follows
  std::deque<std::pair<MessagePool::MessageHandle, MessageInfo>> kept_;
};

}  // namespace cie::executor
