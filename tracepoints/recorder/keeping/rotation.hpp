// Divides a recording into chunks while it goes on: each a recording of its own that can be read,
// copied and removed while the next one is written.
#pragma once

#include <cie/tracepoints/recording_manifest.hpp>

#include "kernel/kernel_recording.hpp"
#include "lttng/process_watch.hpp"
#include "lttng/tracing_session.hpp"
#include "options/options.hpp"
#include "system/instant.hpp"
#include "system/long_call.hpp"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace cie::record {

// Chunks are DIR/chunk-000001, -000002, …; each appears when it is complete and has its manifest.
// One thread calls; hashing has a thread of its own.
class Rotation {
 public:
  // The session of these options, which have `rotate`. `kernel` is borrowed until finish() and null
  // where no kernel events are recorded; it began in kernel_part_directory(…, 1). `processes`,
  // borrowed likewise, is null where nobody tells which processes there are. `begin`: before the
  // session was started.
  Rotation(const Options& options, std::shared_ptr<TracingSession> session, KernelRecording* kernel,
           ProcessWatch* processes, const Instant& begin);

  // Begins a chunk if one is due, and seals the one before when LTTng has written it out. Waits for
  // LTTng a second at most, and asks later what it answered. `about` is what a chunk's manifest says
  // besides. Throws what went wrong since the last call; the next one may succeed.
  void poll(const RecordingManifest& about);
  // LTTng has not answered yet: until then nobody else may ask it, either. And since when.
  bool is_asking() const noexcept;
  std::chrono::steady_clock::time_point asked() const noexcept { return asked_; }
  // Before the session ends: waits for that answer. False: there was none. Throws what went wrong.
  bool settle(std::chrono::seconds patience);
  // Once, when the session and the kernel's recording have ended: seals what is left. Returns what
  // is wrong with it. `until`: when the session's end began.
  std::vector<std::string> finish(const RecordingManifest& about, const Instant& until);

  std::uint64_t sealed() const noexcept { return sealed_; }
  std::uint64_t removed() const noexcept { return removed_; }
  // An application emitted something, in chunks that are kept or not.
  bool has_events() const noexcept { return has_events_; }
  // Those of the chunks that are kept.
  std::vector<RecordedProcess> processes() const;

 private:
  using Clock = std::chrono::steady_clock;
  // Where a stream stood at the end of the chunk before.
  struct StreamEnd {
    std::uint64_t next_packet = 0;
    std::uint64_t discarded_events = 0;
  };

  // The kernel's part of a chunk, until that is sealed.
  struct KernelPart {
    std::filesystem::path directory;
    RecordedKernel measured;
  };

  // What LTTng says of a chunk that it writes out.
  struct Answer {
    std::optional<std::filesystem::path> chunk;  // where it lies, if it is complete
    std::string problem;                         // with the new chunk's description; empty: none
  };
  struct Begun {
    PendingChunk before;
    std::int64_t at_ns = 0;
  };

  void begin_chunk();
  void note_begun();
  void ask_for_chunk(const RecordingManifest& about);
  void seal_chunk(const std::filesystem::path& chunk, const RecordingManifest& about);
  // What was recorded since the part before, given all that was.
  KernelPart end_kernel_part(const RecordedKernel& total);
  struct Sealed {
    bool is_kept = false;     // there was something in it
    bool has_events = false;  // an application emitted them
    std::vector<RecordedProcess> processes{};
    std::string problem;  // why it is not what it should be; empty: it is
  };
  Sealed seal(const std::filesystem::path& chunk, const std::optional<KernelPart>& kernel,
              RecordingManifest manifest);
  void describe_streams(const std::filesystem::path& chunk, RecordingManifest& manifest);
  void remove_old() noexcept;
  void note_sealed();
  // Who is in the chunk that ends at `end`.
  void note_processes(RecordingManifest& manifest, const Instant& end);

  RotateOptions options_;
  std::filesystem::path directory_;
  std::shared_ptr<TracingSession> session_;
  Clock::time_point next_;
  Instant chunk_begin_;
  Instant chunk_end_;  // of the one that is being written out or sealed
  Clock::time_point asked_;
  std::optional<LongCall<Begun>> beginning_;
  std::shared_ptr<PendingChunk> pending_;  // shared with who asks for it
  bool is_described_ = true;               // the chunk that is being recorded
  std::optional<LongCall<Answer>> asking_;
  std::future<Sealed> sealing_;
  std::map<std::string, StreamEnd> streams_;  // by path within a chunk; of the thread that seals
  KernelRecording* kernel_;
  std::uint64_t kernel_parts_ = 1;         // the number of the one that is being written
  RecordedKernel kernel_before_;           // in the parts before it
  std::optional<KernelPart> kernel_part_;  // of the chunk that is being written out
  ProcessWatch* processes_;
  // From here on the chunk that is being written has all that is emitted: what is emitted between
  // the end of the one before and this is in either.
  std::int64_t settled_ns_;
  std::int64_t settled_next_ns_;  // of the one after the one that is being written out
  // Of the chunks that are kept, by number: who began in it, and who did while it ended.
  std::map<std::uint64_t, std::vector<RecordedProcess>> begun_;
  std::map<std::uint64_t, std::vector<RecordedProcess>> passing_;
  bool has_events_ = false;
  std::uint64_t sealed_ = 0;
  std::uint64_t removed_ = 0;
};

}  // namespace cie::record
