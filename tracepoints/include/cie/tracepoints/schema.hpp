// The event contract as types: names, numbers and labels that the executor writes and the analyzers
// read. tracepoints/README.md is the prose of it. This header is all that both sides share.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace cie {

// Version of the events' meaning. Fields may be added at the end of an event without a new one.
inline constexpr std::uint32_t kContractVersion = 1;

// LTTng-UST provider; an event's full name is "cie:callback_start".
inline constexpr std::string_view kProvider = "cie";

// LTTng sessions whose names begin so are flight recorders: what their buffers held before a
// recording begins was overwritten on purpose. Their metadata carries the name ("trace_name").
inline constexpr std::string_view kSnapshotSession = "cie-snapshot";

// While it is traced, a process tells its clocks (clock_sync) so often. Who is silent for longer is
// gone, or not heard.
inline constexpr std::chrono::nanoseconds kClockSyncPeriod = std::chrono::seconds(1);

// Ids are given by the executor at registration, unique in a process, never reused.
enum class NodeId : std::uint32_t {};
enum class GroupId : std::uint32_t {};
enum class CallbackId : std::uint32_t {};
enum class PublisherId : std::uint32_t {};

// "No such thing", for ids of any kind.
inline constexpr std::uint32_t kNoId = 0xffffffffU;
inline constexpr CallbackId kNoCallback{kNoId};
inline constexpr GroupId kNoGroup{kNoId};
inline constexpr NodeId kNoNode{kNoId};

template <typename Id>
constexpr std::uint32_t to_number(Id id) noexcept {
  return static_cast<std::uint32_t>(id);
}

// Enumerations of the contract. Numbers are the order of the contract; readers go by label.
enum class RunMoment : std::uint8_t { start, announce };
enum class GroupType : std::uint8_t { mutually_exclusive, reentrant };
enum class CallbackKind : std::uint8_t { timer, subscription, service, client, waitable };
enum class ThreadRole : std::uint8_t { callback, pool, dispatcher, worker };
enum class SchedMoment : std::uint8_t { initial, applied, audit };
enum class WakeupReason : std::uint8_t { timer, data, guard, spurious };
enum class ReleaseKind : std::uint8_t { timer, data, none };
enum class CallbackStatus : std::uint8_t { ok, exception };
enum class ExecutorKind : std::uint8_t { isolated, single_threaded, multi_threaded, events };

// Labels, indexed by the enumeration's number.
template <typename Enum>
struct Labels;
template <>
struct Labels<RunMoment> {
  static constexpr std::array<std::string_view, 2> kValues{"start", "announce"};
};
template <>
struct Labels<GroupType> {
  static constexpr std::array<std::string_view, 2> kValues{"mutually_exclusive", "reentrant"};
};
template <>
struct Labels<CallbackKind> {
  static constexpr std::array<std::string_view, 5> kValues{"timer", "subscription", "service",
                                                           "client", "waitable"};
};
template <>
struct Labels<ThreadRole> {
  static constexpr std::array<std::string_view, 4> kValues{"callback", "pool", "dispatcher",
                                                           "worker"};
};
template <>
struct Labels<SchedMoment> {
  static constexpr std::array<std::string_view, 3> kValues{"initial", "applied", "audit"};
};
template <>
struct Labels<WakeupReason> {
  static constexpr std::array<std::string_view, 4> kValues{"timer", "data", "guard", "spurious"};
};
template <>
struct Labels<ReleaseKind> {
  static constexpr std::array<std::string_view, 3> kValues{"timer", "data", "none"};
};
template <>
struct Labels<CallbackStatus> {
  static constexpr std::array<std::string_view, 2> kValues{"ok", "exception"};
};
template <>
struct Labels<ExecutorKind> {
  static constexpr std::array<std::string_view, 4> kValues{"isolated", "single_threaded",
                                                           "multi_threaded", "events"};
};

// The contract's label of an enumerator; empty for a number outside the enumeration.
template <typename Enum>
constexpr std::string_view label(Enum value) noexcept {
  const auto index = static_cast<std::size_t>(value);
  return index < Labels<Enum>::kValues.size() ? Labels<Enum>::kValues[index] : std::string_view{};
}

}  // namespace cie
