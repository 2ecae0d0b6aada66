// A service's client as a callback.
#pragma once

#include <cie/executor/client.hpp>
#include <cie/scheduling/clock.hpp>
#include <cie/tracepoints/priority_mutex.hpp>

#include "reader_callback.hpp"
#include "services/service_ends.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace cie::executor {

// Its instances are the completions of requests: by a response, or by a timeout. A response that
// nobody waits for any more is no instance.
class ClientCallback final : public ReaderCallback {
 public:
  // `timeout_ns` 0: none.
  ClientCallback(std::shared_ptr<GroupState> group, const trace::CallbackInfo& info, ClientEnd end,
                 std::int64_t timeout_ns);
  ~ClientCallback() override { end(); }

  // Puts the header before it and sends. Any thread.
  void send(const void* request, Completion completion);
  bool is_ready() const;
  std::size_t pending() const;
  const std::string& service() const noexcept { return service_; }

  std::int64_t next_due() const noexcept override {
    return std::min(ReaderCallback::next_due(), next_due_ns_.load(std::memory_order_relaxed));
  }
  bool has_timer() const noexcept override { return true; }

 private:
  bool run_one() override;
  void dispose() noexcept override;

  struct Request {
    Completion completion;
    std::int64_t deadline_ns = kNever;
  };
  std::optional<Request> remove(std::int64_t seq);
  std::optional<Request> remove_overdue();
  void update_next_due();  // with mutex_ held

  std::string service_;
  std::unique_ptr<Writer> writer_;
  std::uint64_t guid_;  // in the header of each request
  std::int64_t timeout_ns_;
  std::atomic<std::int64_t> next_due_ns_{kNever};
  mutable PriorityMutex mutex_;               // of what follows
  std::map<std::int64_t, Request> requests_;  // by seq, and so by deadline
  std::int64_t last_seq_ = 0;
};

}  // namespace cie::executor
