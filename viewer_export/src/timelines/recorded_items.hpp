// An instance and a publication as RecordedRun tells them, and how it keeps a publication: small,
// and trivially copyable.
#pragma once

#include <cie/analysis/instance.hpp>

#include "output/kept_instance.hpp"
#include "thread_table.hpp"

#include <cstdint>
#include <span>

namespace cie::viewer_export {

struct RecordedInstance {
  // Without its views (the name stands below) and its declared deadline.
  analysis::Instance instance;
  std::uint32_t name = 0;    // of the logical id, in RecordedRun::callbacks()
  std::uint32_t thread = 0;  // in RecordedRun::threads()
  std::uint64_t index = 0;   // in order of arrival
  // One whose publication is told before it, or, if its time is the same, right after it.
  bool takes_seen_message = false;
};

RecordedInstance restored(const KeptInstance& kept, const ThreadTable& threads);

struct RecordedPublication {
  analysis::Publication publication;         // without its view and its CPU
  std::uint32_t topic = 0;                   // in RecordedRun::topics()
  std::uint32_t thread = 0;                  // in RecordedRun::threads()
  std::span<const std::uint64_t> receivers;  // index of each instance that took the message
};

struct KeptPublication {
  std::int64_t time = 0;
  std::uint64_t index = 0;
  std::uint32_t thread = 0;
  std::uint32_t topic = 0;
  std::uint32_t publisher_id = 0;
  analysis::ProcessIndex process{};
  std::uint64_t seq = 0;
  std::uint64_t writer_gid = 0;
  std::int64_t source_timestamp = 0;

  static KeptPublication of(const analysis::Publication& publication);
  // Without receivers.
  RecordedPublication restored(const ThreadTable& threads) const;
};

}  // namespace cie::viewer_export
