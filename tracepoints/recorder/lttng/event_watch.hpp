// Tells of an event as processes emit it: a trigger of LTTng on it, and the notifications that it
// sends. Independent of what a session records.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

struct lttng_condition;
struct lttng_notification_channel;
struct lttng_trigger;

namespace cie::record {

// What a notification carries of its event: a field, or a context of LTTng.
struct Capture {
  const char* name = nullptr;
  bool is_context = false;
};

// A number or a text; neither where LTTng could not tell.
using Captured = std::variant<std::monostate, std::int64_t, std::string>;
std::int64_t number_of(const Captured& value) noexcept;  // 0 for what is no number
// Of the context `vpid`. LTTng-UST before 2.13.2 captures contexts with their bytes in either order,
// as its memory happens to be: what is no pid and is one the other way round was reversed.
std::int64_t pid_of(const Captured& value) noexcept;

// Belongs to this process's session daemon; the destructor takes the trigger away.
class EventWatch {
 public:
  // `trigger` is a name that no trigger of this daemon has; `purpose` goes with errors. Throws
  // RecordError when LTTng refuses.
  EventWatch(const std::string& trigger, const char* event, const std::vector<Capture>& captures,
             const char* purpose);
  ~EventWatch();
  EventWatch(const EventWatch&) = delete;
  EventWatch& operator=(const EventWatch&) = delete;

  // The captures of the next event, in their order; empty: none came since. Never waits.
  std::optional<std::vector<Captured>> poll();
  // Asks LTTng whether it discarded what processes had to tell, because too much came at once.
  void look_for_losses();
  // LTTng dropped notifications, because too many came between two questions, or discarded some
  // before.
  bool has_missed() const noexcept { return has_missed_; }

 private:
  struct Destroy {
    void operator()(lttng_condition* condition) const noexcept;
    void operator()(lttng_notification_channel* channel) const noexcept;
    void operator()(lttng_trigger* trigger) const noexcept;
  };
  std::size_t captures_;
  std::unique_ptr<lttng_condition, Destroy> condition_;
  std::unique_ptr<lttng_trigger, Destroy> trigger_;
  std::unique_ptr<lttng_notification_channel, Destroy> channel_;
  bool is_registered_ = false;
  bool has_missed_ = false;
};

}  // namespace cie::record
