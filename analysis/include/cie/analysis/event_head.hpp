// What every event has, whatever its kind: when, where and of whom it is, and what it is about.
#pragma once

#include <cie/analysis/context_number.hpp>
#include <cie/analysis/time.hpp>

#include <cstdint>

namespace cie::analysis {

// Dense numbers given by the reader: one stream is one sequence of packets (usually one CPU's
// buffer of one channel of one trace).
enum class StreamIndex : std::uint32_t {};

// A field that the trace does not have stays empty; it is never 0.
struct EventHead {
  Timestamp time;
  StreamIndex stream{};
  ContextNumber<std::int32_t> cpu;
  ContextNumber<std::int64_t> pid;  // vpid, as the tracer knows it
  ContextNumber<std::int64_t> tid;  // vtid
  bool is_derived = false;          // follows from other events: none of the trace's own
  // Derived, and in the place of the event that it follows from, which counts as the trace's own.
  bool stands_for_cause = false;
};

// What a kind of event is about. Each kind says its category (`kCategory`), and the name of its event
// class (`kName`; empty: no single one).
enum class EventCategory : std::uint8_t {
  structure,  // streams and packets: no event of the trace itself
  state,      // who there is: processes, nodes, callbacks, threads and their parameters
  callback,   // what callbacks do
  clock,      // of our provider, about its clock
  system      // of the kernel and of tracers, whatever thread was running
};

// Whose events a stream has: applications', or the kernel's.
enum class Domain : std::uint8_t { user, kernel };

}  // namespace cie::analysis
