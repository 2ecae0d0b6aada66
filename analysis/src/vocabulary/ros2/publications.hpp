// Calls of publish, put together from what several layers of ROS 2 say of each.
#pragma once

#include "message_links.hpp"
#include "process_state.hpp"
#include "ros2_event.hpp"
#include "vocabulary/field.hpp"

#include <optional>

namespace cie::analysis::ros2 {

class Publications {
 public:
  // `links` learns of every publication.
  explicit Publications(MessageLinks& links) noexcept : links_(links) {}

  // Whether the event is part of a publication.
  bool apply(Ros2Event event, const Payload& p, Context& context);
  // The thread did something else: whatever it was writing is written.
  void settle(Context& context) {
    const auto& thread = context.thread;
    if (thread.writing || thread.publishing) complete(context);
  }

 private:
  void complete(Context& context);
  // Events between its parts may have been lost: it is none that is told, but messages may be of it.
  void add_doubtful(const Publishing& publishing, Context& context);
  // A layer below rclcpp's tells whose message it is.
  void name_publisher(Address message, Address publisher, Context& context);
  // rcl does not tell of what is serialized already, as a generic publisher's messages are: whose it is
  // the layer below tells.
  void find_publisher(const Payload& rmw_publish, Context& context);
  void begin(Address message, std::optional<Address> publisher, Context& context);
  // A message that has a source timestamp from after the event that tells of it: CLOCK_REALTIME was set
  // forward. What was written later is not put before that by more than the call took.
  static void note_clock(std::int64_t source_timestamp, const Publishing& publishing,
                         Context& context);
  MessageLinks::Origin tell(const Publishing& publishing, WrittenMessage publication,
                            Context& context,
                            const std::optional<AgnocastMessage>& agnocast = std::nullopt);
  // Of a message that no layer below will speak of.
  MessageLinks::Origin tell_in_process(Address publisher, Context& context,
                                       const std::optional<AgnocastMessage>& agnocast);

  MessageLinks& links_;
};

}  // namespace cie::analysis::ros2
