// What really happened in a simulation, by the simulator's own account: nothing here is read from
// events.
#pragma once

#include "machine.hpp"
#include "system.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cie::sim {

struct InstanceTruth {
  int callback = 0;        // index in System
  std::size_t thread = 0;  // index in Truth
  std::uint64_t seq = 0;
  Ns release = 0;
  std::uint32_t missed = 0;  // periods skipped before it
  Ns start = 0;
  std::optional<Ns> end{};
  std::int32_t cpu_start = 0;
  std::int32_t cpu_end = 0;
  std::optional<Ns> wakeup{};             // when its thread last returned from a wait
  std::int32_t cpu_wakeup = 0;            // and where
  WakeUp kernel_wakeup{};                 // of its thread, as known at its start
  Ns execution_before = 0;                // of its thread, until its start
  Account parts{};                        // of its duration
  std::optional<std::size_t> message{};   // that it took
  std::optional<std::size_t> previous{};  // instance of its thread
};

struct MessageTruth {
  int topic = 0;
  std::uint64_t writer = 0;
  Ns published = 0;
  Ns stamp = 0;              // CLOCK_REALTIME, as its writer wrote it
  std::size_t instance = 0;  // that published it
};

struct ThreadTruth {
  std::int64_t pid = 0;
  std::int64_t tid = 0;
  std::string name{};
  Ns busy = 0;
  Ns first_wait = 0;        // when it blocked first
  Ns execution_before = 0;  // until then
  Ns end = 0;               // its thread_fini
  Ns execution = 0;         // until then
};

// A sample that was put into a queue, the tracer having been told.
struct ArrivalTruth {
  Ns time = 0;
  std::uint64_t waiting = 0;  // in the queue, or taken for an instance yet to begin
};

struct Truth {
  std::vector<InstanceTruth> instances{};  // by start
  std::vector<MessageTruth> messages{};
  std::vector<ThreadTruth> threads{};                 // announced ones
  std::vector<std::int64_t> pids{};                   // by process
  std::vector<std::uint64_t> overwritten{};           // samples, by callback
  std::vector<std::vector<ArrivalTruth>> arrivals{};  // by callback
  std::vector<Ns> announced;                          // when each announcement was complete
  std::uint64_t inherited = 0;                        // priorities, through mutexes
};

}  // namespace cie::sim
