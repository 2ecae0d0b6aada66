// An instance and a publication as RecordedRun tells them, and as it keeps them: small, and
// trivially copyable.
#pragma once

#include <cie/analysis/instance.hpp>

#include "output/optional_numbers.hpp"
#include "thread_table.hpp"

#include <cstdint>
#include <span>

namespace cie::viewer_export {

struct RecordedInstance {
  // Without its views (the name stands below), wake-up, waking and declared deadline.
  analysis::Instance instance;
  std::uint32_t name = 0;    // of the logical id, in RecordedRun::callbacks()
  std::uint32_t thread = 0;  // in RecordedRun::threads()
  std::uint64_t index = 0;   // in order of arrival
  // One whose publication is told before it, or, if its time is the same, right after it.
  bool takes_seen_message = false;
};

struct RecordedPublication {
  analysis::Publication publication;         // without its view and its CPU
  std::uint32_t topic = 0;                   // in RecordedRun::topics()
  std::uint32_t thread = 0;                  // in RecordedRun::threads()
  std::span<const std::uint64_t> receivers;  // index of each instance that took the message
};

struct KeptInstance {
  enum Number : std::uint8_t {
    release,
    end,
    cpu_start,
    cpu_end,
    execution,
    preempted,
    blocked,
    wake_delay
  };

  std::int64_t start = 0;
  std::uint64_t index = 0;
  analysis::CallbackIndex callback{};
  analysis::ProcessIndex process{};
  std::uint32_t name = 0;
  std::uint32_t thread = 0;
  std::uint32_t missed = 0;
  std::uint64_t seq = 0;
  std::int64_t source_timestamp = 0;
  std::uint64_t writer_gid = 0;
  analysis::ReleaseSource release_source{};
  analysis::InstanceState state{};
  std::optional<CallbackStatus> status{};
  OptionalNumbers<Number, wake_delay + 1> numbers;

  static KeptInstance of(const analysis::Instance& instance);
  RecordedInstance restored(const ThreadTable& threads) const;
};

struct KeptPublication {
  std::int64_t time = 0;
  std::uint64_t index = 0;
  std::uint32_t thread = 0;
  std::uint32_t topic = 0;
  std::uint32_t publisher_id = 0;
  std::uint64_t seq = 0;
  std::uint64_t writer_gid = 0;
  std::int64_t source_timestamp = 0;

  static KeptPublication of(const analysis::Publication& publication);
  // Without receivers.
  RecordedPublication restored(const ThreadTable& threads) const;
};

}  // namespace cie::viewer_export
