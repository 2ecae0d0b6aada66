#include "native_reader.hpp"

#include <cie/analysis/analyzer.hpp>
#include <cie/tracepoints/recording_manifest.hpp>

#include "base/uuid.hpp"
#include "ctf/metadata/metadata_file.hpp"
#include "ctf/metadata/metadata_parser.hpp"
#include "ctf/metadata/uuid.hpp"
#include "ctf/salvage/metadata_rebuild.hpp"
#include "ctf/stream/coverage.hpp"
#include "ctf/stream/merge_offsets.hpp"
#include "ctf/stream/packet_memory.hpp"
#include "ctf/stream/stream_reader.hpp"
#include "ctf/stream/tournament.hpp"
#include "recording/discovery.hpp"
#include "vocabulary/pid_namespaces.hpp"
#include "vocabulary/vocabulary.hpp"

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::analysis::ctf {
namespace {

namespace fs = std::filesystem;

// Of packets that are held whole: those of 64 streams, of 512 KiB each.
constexpr std::uint64_t kMostBytesHeld = std::uint64_t{32} << 20U;
constexpr const char* kOtherUuid = ": its packets have another uuid than its metadata";

// What to do about a trace that cannot be read, from a directory or file of it. Only recordings by
// `cie record` have a manifest, in one of the directories around.
std::string advice(fs::path place) {
  constexpr int kLevels = 8;
  for (int level = 0; level < kLevels && place.has_relative_path(); ++level) {
    std::error_code ignored;
    if (fs::is_regular_file(place / kManifestName, ignored)) {
      return "; compare its files with the recording's manifest, or record again";
    }
    place = place.parent_path();
  }
  return "; see whether all of its files were copied whole";
}

// What tells streams apart and orders them.
struct StreamKey {
  std::string trace;
  bool is_unknown = false;  // no packet says which stream it is
  std::uint64_t stream_class = 0;
  std::int64_t cpu = -1;
  std::uint64_t instance = 0;
  std::string file{};  // where there is no instance
  friend auto operator<=>(const StreamKey&, const StreamKey&) = default;
};

// Recorded with `perf record -k CLOCK_MONOTONIC`, converted by `perf data convert --to-ctf`.
bool is_perf_on_monotonic_clock(const Metadata& metadata) {
  const auto tracer = metadata.environment.find("tracer_name");
  return tracer != metadata.environment.end() && tracer->second == "perf" &&
         metadata.clocks.size() == 1 && metadata.clocks.front().description == "monotonic";
}

// Both count nanoseconds, and the machine was booted at the same time, as far as they can tell.
bool are_of_one_boot(const Clock& a, const Clock& b) {
  constexpr std::uint64_t kNanoseconds = 1'000'000'000;
  if (a.frequency != kNanoseconds || b.frequency != kNanoseconds) return false;
  __extension__ using Wide = __int128;
  const auto offset = [](const Clock& clock) {
    return static_cast<Wide>(clock.offset_s) * kNanoseconds + clock.offset;
  };
  const Wide difference = offset(a) - offset(b);
  return difference > -static_cast<Wide>(kNanoseconds) &&
         difference < static_cast<Wide>(kNanoseconds);
}

// What tells a clock from another one: its uuid, else its offset. A trace has one clock.
std::string text_of(const ClockPlan& clock) {
  const auto which = clock.uuid.empty() ? std::to_string(clock.offset_ns) : clock.uuid;
  return which + '/' + std::to_string(clock.frequency);
}

}  // namespace

class TraceReader::Streams {
 public:
  Streams(std::span<const fs::path> traces, const ReadOptions& options)
      : metadata_from_(options.metadata_from),
        progress_(options.progress),
        translator_(options.translator),
        choice_(options.choice),
        window_(options.window),
        counts_others_(options.counts_others) {
    std::set<fs::path> seen;
    for (const auto& path : traces) {
      for (const auto& directory : find_traces(path)) {
        std::error_code error;
        const auto canonical = fs::weakly_canonical(directory, error);
        if (seen.insert(error ? directory : canonical).second) add_directory(directory);
      }
    }
    for (auto& [directory, metadata] : perfs_)
      add_perf(directory, metadata);
    // Last, because the clock of a sound trace is theirs as well.
    for (const auto& [directory, reason] : unreadable_)
      salvage_directory(directory, reason);
    make_streams();
  }

  std::uint64_t bytes() const noexcept { return bytes_; }

  // One packet of a stream whose turn it is.
  bool scan_ahead() {
    for (std::size_t i = 0; i < streams_.size(); ++i) {
      next_scanned_ = next_scanned_ + 1 < streams_.size() ? next_scanned_ + 1 : 0;
      if (streams_[next_scanned_]->scan_ahead()) return true;
    }
    return false;
  }

  // `most_held`: bytes of packets that all streams together may hold whole.
  void read(EventBatch& first, const EventWriter::Exchange& exchange, std::uint64_t most_held) {
    begin(most_held);
    EventWriter writer(first, [this, &exchange](EventBatch& filled) -> EventBatch& {
      late_.complete(filled);
      return exchange(filled);
    });
    for (const auto& stream : streams_)
      stream->emit_begin(writer);
    for (const auto& [stream, reason] : salvaged_) {
      auto& event = writer.add();
      event.head = {.time = {}, .stream = stream, .cpu = {}, .pid = {}, .tid = {}};
      event.body = DamagedPacket{
          .reason = reason, .begin = kBoot, .end = kLatest, .has_foreign_metadata = true};
      writer.keep(event);
    }
    merge(writer);
    writer.flush();
    packets_ = {};
    check_anything_read();
    if (translator_ == nullptr) return;
    translator_->finish(writer.batch());
    writer.flush();
  }

 private:
  // Streams hold packets that are small or no larger than their share.
  void begin(std::uint64_t most_held) {
    const auto share = most_held / std::max<std::size_t>(streams_.size(), 1);
    const auto most = std::max<std::uint64_t>(share, StreamReader::kSmallestPiece);
    const auto holds = [most](const StreamReader& stream) { return stream.packet_bytes() <= most; };
    std::size_t bytes = 0;
    for (const auto& stream : streams_) {
      if (holds(*stream)) bytes += stream->memory_for_packets();
    }
    packets_ = PacketMemory(bytes);
    for (const auto& stream : streams_)
      stream->begin(holds(*stream) ? &packets_ : nullptr);
  }

  void add_directory(const fs::path& directory) {
    try {
      auto metadata =
          parse_metadata(metadata_text(read_metadata(directory / "metadata")), is_wanted());
      if (is_perf_on_monotonic_clock(metadata)) {
        perfs_.emplace_back(directory, std::move(metadata));
        return;
      }
      add_files(directory, std::make_shared<const TracePlan>(metadata, choice_));
      if (metadata.clocks.empty()) return;
      if (!clock_) clock_ = metadata.clocks.front();
      clocks_.try_emplace(host_of(metadata), metadata.clocks.front());
    } catch (const MetadataError& error) {
      const auto reason =
          "cannot read trace " + directory.string() + ": its metadata: " + error.what();
      unreadable_.emplace_back(directory, reason);
    }
  }

  // Of whose classes the metadata need not be read to the last word.
  std::function<bool(std::string_view)> is_wanted() const {
    if (choice_ != nullptr) return {};
    return [](std::string_view event) { return find_translation(event) != nullptr; };
  }

  // perf names no boot and measures the offset from the epoch anew, but its clock is LTTng's.
  void add_perf(const fs::path& directory, Metadata& metadata) {
    auto& clock = metadata.clocks.front();
    const auto other = clocks_.find(host_of(metadata));
    if (other != clocks_.end() && are_of_one_boot(clock, other->second)) {
      clock.uuid = other->second.uuid;
      clock.offset_s = other->second.offset_s;
      clock.offset = other->second.offset;
    }
    add_files(directory, std::make_shared<const TracePlan>(metadata, choice_));
  }

  // Reads a directory without its own metadata. The clock is that of the sound traces beside it.
  void salvage_directory(const fs::path& directory, const std::string& reason) {
    auto metadata = metadata_from_.empty() ? own_schema(directory, reason) : foreign_metadata();
    metadata.uuid.clear();  // differs between recordings
    if (clock_ && !metadata.clocks.empty()) {
      auto& clock = metadata.clocks.front();
      clock.uuid = clock_->uuid;
      clock.offset_s = clock_->offset_s;
      clock.offset = clock_->offset;
    }
    try {
      add_files(directory, std::make_shared<const TracePlan>(metadata, choice_));
    } catch (const MetadataError& error) {
      throw UnreadableTrace("cannot read metadata " + metadata_from_.string() + ": " +
                            error.what());
    }
    salvaged_traces_[directory.string()] =
        reason + "; read with " +
        (metadata_from_.empty() ? "the schema of `cie record`" : metadata_from_.string()) +
        " instead";
  }

  Metadata foreign_metadata() const {
    try {
      return parse_metadata(metadata_text(read_metadata(metadata_from_)));
    } catch (const MetadataError& error) {
      throw UnreadableTrace("cannot read metadata " + metadata_from_.string() + ": " +
                            error.what());
    }
  }

  static Metadata own_schema(const fs::path& directory, const std::string& reason) {
    const auto remedy =
        advice(fs::absolute(directory)) + "; or read it with --metadata, that of a trace like it";
    if (!looks_recorded(directory)) throw UnreadableTrace(reason + remedy);
    try {
      return parse_metadata(rebuild_metadata(directory));
    } catch (const MetadataError& error) {
      throw UnreadableTrace(reason + ", and the schema of `cie record` does not fit (" +
                            error.what() + ")" + remedy);
    }
  }

  void add_files(const fs::path& directory, const std::shared_ptr<const TracePlan>& plan) {
    // Directories that share a uuid are one trace: rotation chunks, snapshots.
    const auto name =
        plan->uuid ? uuid_text(*plan->uuid) + '/' + text_of(plan->clock()) : directory.string();
    auto& state = states_[name];
    state.priority_offset = plan->priority_offset;
    const auto trace = std::make_shared<LateFields::OfTrace>(
        late_, plan, state, namespaces_[{plan->host, plan->clock().uuid}]);
    std::error_code listing;
    const auto paths = stream_files(directory, listing);
    if (listing) {
      throw UnreadableTrace("cannot read trace " + directory.string() + ": " + listing.message());
    }
    for (const auto& path : paths) {
      std::error_code error;
      const auto absolute = fs::absolute(path, error).lexically_normal();
      StreamFile file{
          .file = File(error ? path.string() : absolute.string()), .trace = trace, .first = {}};
      if (!file.file.is_readable()) {
        throw UnreadableTrace("cannot read " + path.string() + ": " + file.file.error());
      }
      if (file.file.size() == 0) continue;
      bytes_ += file.file.size();
      if (progress_ != nullptr) progress_->total += file.file.size();
      file.first = PacketScanner(file.file, *plan, PacketScanner::kHeaderPiece).next_header();
      files_[key_of(name, file, path)].push_back(std::move(file));
    }
  }

  static StreamKey key_of(const std::string& trace, const StreamFile& file, const fs::path& path) {
    StreamKey key{.trace = trace};
    if (!file.first) {
      key.is_unknown = true;
      key.file = path.string();
      return key;
    }
    key.stream_class = file.first->stream->id;
    key.cpu = file.first->cpu.value_or(-1);
    if (file.first->instance) {
      key.instance = *file.first->instance;
    } else {
      key.file = path.filename().string();
    }
    return key;
  }

  void make_streams() {
    std::map<std::tuple<std::string, bool, std::uint64_t>, std::uint32_t> channels;
    std::map<std::string, std::uint32_t> traces;
    std::vector<Stream> streams;
    MergeOffsets offsets;
    for (auto& [key, files] : files_) {
      std::stable_sort(files.begin(), files.end(), [](const StreamFile& a, const StreamFile& b) {
        const auto order = [](const StreamFile& file) {
          if (!file.first) return std::tuple(std::uint64_t{0}, std::uint64_t{0});
          return std::tuple(file.first->begin.value_or(0),
                            file.first->sequence ? file.first->sequence->value : 0);
        };
        return order(a) < order(b);
      });
      StreamIdentity identity{.index = StreamIndex{static_cast<std::uint32_t>(streams.size())},
                              .channel = static_cast<std::uint32_t>(channels.size()),
                              .trace = static_cast<std::uint32_t>(traces.size()),
                              .is_first_of_trace = !traces.contains(key.trace),
                              .merge_offset_ns = 0,
                              .progress = progress_,
                              .window = window_,
                              .counts_others = counts_others_};
      identity.channel =
          channels.try_emplace({key.trace, key.is_unknown, key.stream_class}, identity.channel)
              .first->second;
      identity.trace = traces.try_emplace(key.trace, identity.trace).first->second;
      if (const auto& first = files.front().first) {
        identity.merge_offset_ns =
            offsets.of(first->stream->clock, files.front().trace->plan().host);
      }
      if (const auto salvaged = salvaged_traces_.extract(key.trace)) {
        salvaged_.emplace_back(identity.index, salvaged.mapped());
      } else if (files.front().first && files.front().first->other_uuid) {
        salvaged_.emplace_back(identity.index, files.front().file.path() + kOtherUuid);
      }
      identity.is_idle = !PacketTimes(files).has_events();
      streams.emplace_back(std::move(files), identity);
    }
    files_.clear();
    leave_out(streams);
    for (auto& [files, identity] : streams)
      streams_.push_back(std::make_unique<StreamReader>(std::move(files), identity));
  }

  using Stream = std::pair<std::vector<StreamFile>, StreamIdentity>;

  // A channel's window is what all of its streams cover. Where they have nothing in common, it is
  // what most of them have. The others are named, and no losses: LTTng writes no packet for a CPU
  // on which nothing happened between two flushes.
  void leave_out(std::vector<Stream>& streams) {
    std::map<std::uint32_t, std::vector<Stream*>> channels;
    for (auto& stream : streams) {
      const auto& first = stream.first.front().first;
      const bool has_times = first && first->begin && first->stream->has_packet_times;
      if (has_times) channels[stream.second.channel].push_back(&stream);
    }
    for (auto& [number, members] : channels) {
      const auto idle =
          std::stable_partition(members.begin(), members.end(),
                                [](const Stream* stream) { return !stream->second.is_idle; });
      if (idle != members.begin()) leave_out({members.begin(), idle}, {idle, members.end()});
    }
  }

  // `idle` streams cover everything up to their ends.
  void leave_out(std::span<Stream* const> busy, std::span<Stream* const> idle) {
    Timestamp latest = kEarliest;
    for (const auto* stream : busy) {
      const auto& first = *stream->first.front().first;
      latest = std::max(latest, first.stream->clock.time_of(*first.begin));
    }
    const auto times_of = [](const Stream* stream, Timestamp enough) {
      return PacketTimes(stream->first).times(enough).value_or(TimeWindow{});
    };
    // Most streams reach the latest begin within a packet or two, so that little is read twice.
    const auto reaches = [&](const Stream* stream) {
      return times_of(stream, latest).to >= latest;
    };
    if (std::ranges::all_of(busy, reaches) && std::ranges::all_of(idle, reaches)) return;
    std::vector<TimeWindow> times;
    for (const auto* stream : busy)
      times.push_back(times_of(stream, TimeWindow{}.to));
    auto [without, common] = left_out(times);
    for (const auto* stream : idle) {
      const auto [begin, end] = times_of(stream, TimeWindow{}.to);
      // A flush alone, at whichever end of a chunk LTTng put it, covers as much as the others.
      without.push_back(end < common.from && begin != end);
    }
    for (std::size_t i = 0; i < without.size(); ++i) {
      if (!without[i]) continue;
      auto& stream = *(i < busy.size() ? busy[i] : idle[i - busy.size()]);
      stream.second.is_left_out = true;
    }
  }

  void merge(EventWriter& writer) {
    std::vector<std::int64_t> keys;
    std::vector<Lane> lanes;
    for (const auto& stream : streams_) {
      keys.push_back(stream->key());
      lanes.push_back(stream->lane());
    }
    Tournament tournament(keys);
    while (!tournament.is_over()) {
      const auto winner = tournament.winner();
      auto& lane = lanes[winner];
      if (lane.has_another()) {
        // First, since to find out which stream is next is one long chain of operations, which
        // others go beside.
        tournament.move_winner();
        if (!lane.emit(writer)) streams_[winner]->count_instead(writer.batch());
        lane.go_on();
        tournament.prepare(winner, lane.key_after());
        continue;
      }
      auto& stream = *streams_[winner];
      advance(lane, stream, writer);
      if (stream.has_ended()) {
        tournament.remove_winner();
        continue;
      }
      lane = stream.lane();
      tournament.move_winner(stream.key());
      if (lane.has_another()) tournament.prepare(winner, lane.key_after());
    }
  }

  // By the last step that is known, to the one after it.
  void advance(const Lane& lane, StreamReader& stream, EventWriter& writer) {
    if (lane.has_next()) {
      if (!lane.emit(writer)) stream.count_instead(writer.batch());
      stream.finish_lane();
      if (stream.look_ahead()) return;
      late_.complete(writer.batch());
      stream.find_event();
    } else {
      late_.complete(writer.batch());
      stream.step(writer);
    }
  }

  void check_anything_read() const {
    const StreamReader* damaged = nullptr;
    for (const auto& stream : streams_) {
      if (stream->packets() > 0) return;
      if (damaged == nullptr && stream->first_damage()) damaged = stream.get();
    }
    if (damaged == nullptr) return;  // metadata without any packet: an empty recording
    throw UnreadableTrace("cannot read any packet of the trace: " +
                          damaged->first_damage()->reason + advice(damaged->path()));
  }

  fs::path metadata_from_;
  Progress* progress_;
  Translator* translator_;
  EventChoice* choice_;
  TimeWindow window_;
  bool counts_others_;
  std::uint64_t bytes_ = 0;                                   // of files
  std::optional<Clock> clock_;                                // of the first sound trace
  std::vector<std::pair<fs::path, Metadata>> perfs_;          // to read once clocks_ is complete
  std::map<std::string, Clock> clocks_;                       // by host, the first one seen
  std::vector<std::pair<fs::path, std::string>> unreadable_;  // directories, and why
  std::map<std::string, std::string> salvaged_traces_;        // by name: what to tell of them
  std::vector<std::pair<StreamIndex, std::string>> salvaged_;
  std::map<std::string, VocabularyState> states_;                            // by name of the trace
  std::map<std::pair<std::string, std::string>, PidNamespaces> namespaces_;  // by host and clock
  LateFields late_{translator_};
  std::map<StreamKey, std::vector<StreamFile>> files_;
  PacketMemory packets_;  // of the streams, while they are read
  std::vector<std::unique_ptr<StreamReader>> streams_;
  std::size_t next_scanned_ = 0;
};

TraceReader::TraceReader(std::span<const fs::path> traces, const ReadOptions& options)
    : streams_(std::make_unique<Streams>(traces, options)) {}
TraceReader::~TraceReader() = default;

bool TraceReader::scan_ahead() { return streams_->scan_ahead(); }

std::uint64_t TraceReader::bytes() const noexcept { return streams_->bytes(); }

void TraceReader::read(EventBatch& first, const EventWriter::Exchange& exchange) {
  streams_->read(first, exchange, 0);
}

void TraceReader::read(const BatchSink& sink) {
  EventBatch batch(kEventsPerBatch);
  const auto exchange = [&sink](EventBatch& filled) -> EventBatch& {
    sink(filled);
    filled.clear();
    return filled;
  };
  streams_->read(batch, exchange, kMostBytesHeld);
}

void read_traces(std::span<const fs::path> traces, const EventSink& sink,
                 const ReadOptions& options) {
  TraceReader(traces, options).read([&sink](const EventBatch& batch) { batch.each(sink); });
}

}  // namespace cie::analysis::ctf
