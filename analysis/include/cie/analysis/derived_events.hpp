// Events that no tracer records: what the translator of ROS 2 finds out of processes and the contract has
// no event for. They only follow from other events.
#pragma once

#include <cie/analysis/event_head.hpp>
#include <cie/analysis/time.hpp>
#include <cie/tracepoints/schema.hpp>

#include <cstdint>
#include <optional>
#include <string_view>

namespace cie::analysis {

struct Ros2ProcessBegin {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName = "rcl_init";
};  // nothing of the process came before
// The process spoke before a gap between two sessions, and does so behind it.
struct ProcessContinued {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
  Timestamp since;       // its last event before
  StreamIndex stream{};  // of that
};
// Instances on a thread overlap and do not nest, which those of one thread cannot.
struct InterleavedInstances {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
};
// In a process that tells in this project's events, ROS 2's tell of an instance since another rcl_init.
struct ForeignInstance {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName{};
};
// In a process that tells in this project's events, ROS 2's tell of a callback that none of these tells of,
// or of an instance that is none of theirs: another executor runs there.
struct ForeignCallback {
  static constexpr EventCategory kCategory = EventCategory::system;
  static constexpr std::string_view kName{};
  std::string_view logical_id;
  std::optional<Timestamp> ran{};  // empty: it was made
  StreamIndex stream{};            // of that
};
// What the process's tracepoints are of.
struct Ros2Tracer {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
  std::string_view version;  // of tracetools, "4.1.1"
};
// A callback whose runs no event shows. Told again when its group is known.
struct UntracedEntity {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
  std::uint32_t hidden = 0;  // in its process, counted from 0
  GroupId group{};
  bool is_client = false;  // else a service
  bool is_action = false;  // its part in an action
  bool is_pooled = false;  // the executor of its group is told to have several threads
  std::string_view what;   // "the client of /car/enable"
  std::string_view node;
};
// Somebody whose publications are not recorded writes on the topic, and publications there tell no
// source timestamps: which one a message was taken of is not proven.
struct UntracedWriter {
  static constexpr EventCategory kCategory = EventCategory::state;
  static constexpr std::string_view kName{};
  std::string_view topic;
};
// The thread took a response of a hidden client.
struct UntracedInstance {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName{};
  std::uint32_t hidden = 0;
};
// The thread took a service's response, by what names its publication.
struct ResponseTaken {
  static constexpr EventCategory kCategory = EventCategory::callback;
  static constexpr std::string_view kName{};
  std::uint64_t writer_gid = 0;
  std::int64_t source_timestamp_realtime_ns = 0;
};

}  // namespace cie::analysis
