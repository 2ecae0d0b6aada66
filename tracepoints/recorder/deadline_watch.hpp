// Tells when a callback of a traced process missed its deadline: a trigger of LTTng on the event
// cie:deadline_miss, and the notifications that it sends.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

struct lttng_condition;
struct lttng_notification_channel;
struct lttng_trigger;

namespace cie::record {

struct DeadlineMiss {
  std::uint64_t callback_id = 0;
  std::uint64_t response_ns = 0;
  std::uint64_t deadline_ns = 0;
};

// Belongs to this process's session daemon; the destructor takes the trigger away.
class DeadlineWatch {
 public:
  // Throws RecordError when LTTng refuses.
  explicit DeadlineWatch(const std::string& name);
  ~DeadlineWatch();
  DeadlineWatch(const DeadlineWatch&) = delete;
  DeadlineWatch& operator=(const DeadlineWatch&) = delete;

  // Takes what came since the last call; the first of it. Never waits.
  std::optional<DeadlineMiss> poll();

 private:
  struct Destroy {
    void operator()(lttng_condition* condition) const noexcept;
    void operator()(lttng_notification_channel* channel) const noexcept;
    void operator()(lttng_trigger* trigger) const noexcept;
  };
  std::unique_ptr<lttng_condition, Destroy> condition_;
  std::unique_ptr<lttng_trigger, Destroy> trigger_;
  std::unique_ptr<lttng_notification_channel, Destroy> channel_;
  bool is_registered_ = false;
};

}  // namespace cie::record
