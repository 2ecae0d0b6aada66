// What readers push and analyses consume: one small, trivially copyable value per event, the same
// for every vocabulary. Views are valid only during consume(); whoever keeps a string interns it.
#pragma once

#include <cie/analysis/cie_events.hpp>
#include <cie/analysis/derived_events.hpp>
#include <cie/analysis/event_head.hpp>
#include <cie/analysis/other_event.hpp>
#include <cie/analysis/structure_events.hpp>
#include <cie/analysis/system_events.hpp>

#include <array>
#include <cstddef>
#include <string_view>
#include <variant>

namespace cie::analysis {

// All kinds, each with its category and name: of the recording itself, of the contract, derived ones, of the
// kernel and of tracers, and all others.
using EventBody =
    std::variant<StreamBegin, StreamEnd, PacketBegin, PacketEnd, Discarded, DamagedPacket,
                 SessionGap, TimeRegression, RunBegin, RunEnd, NodeInit, GroupInit, CallbackInit,
                 CallbackFini, PublisherInit, PublisherFini, ThreadInit, ThreadFini, ThreadSched,
                 CallbackRelease, ThreadWakeup, CallbackStart, CallbackEnd, Publish, PublishFailed,
                 SampleLost, ClockSync, Ros2ProcessBegin, ProcessContinued, InterleavedInstances,
                 ForeignInstance, ForeignCallback, Ros2Tracer, UntracedEntity, UntracedWriter,
                 UntracedInstance, ResponseTaken, SchedSwitch, SchedWaking, SchedWakeup,
                 SchedProcessFork, SchedProcessExit, SchedProcessExec, SchedMigrateTask,
                 SchedPiSetprio, ProcessName, OtherEvent>;

namespace detail {
template <typename... Bodies>
constexpr std::array<EventCategory, sizeof...(Bodies)> categories_of(
    const std::variant<Bodies...>*) {
  return {Bodies::kCategory...};
}
template <typename... Bodies>
constexpr std::array<std::string_view, sizeof...(Bodies)> names_of(const std::variant<Bodies...>*) {
  return {Bodies::kName...};
}
}  // namespace detail

// By index of EventBody.
inline constexpr auto kEventCategories =
    detail::categories_of(static_cast<const EventBody*>(nullptr));
inline constexpr auto kEventNames = detail::names_of(static_cast<const EventBody*>(nullptr));

constexpr EventCategory category_of(const EventBody& body) noexcept {
  return kEventCategories[body.index()];
}

// Threads pass events on to each other: no two share a cache line.
struct alignas(64) Event {
  EventHead head;
  EventBody body;
};

// Visits an EventBody with lambdas (the deduction guide is for clang 14).
template <typename... Visitors>
struct Overloaded : Visitors... {
  using Visitors::operator()...;
};
template <typename... Visitors>
Overloaded(Visitors...) -> Overloaded<Visitors...>;

}  // namespace cie::analysis
