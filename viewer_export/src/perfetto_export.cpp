#include <cie/viewer_export/perfetto_export.hpp>

#include "external_sorter.hpp"
#include "gzip_stream.hpp"
#include "name_table.hpp"
#include "perfetto_packets.hpp"
#include "perfetto_sched.hpp"
#include "perfetto_tracks.hpp"
#include "utf8.hpp"

#include <algorithm>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace cie::viewer_export {
namespace {

using analysis::Instance;
using analysis::InstanceState;
using analysis::Publication;
using analysis::ReleaseSource;
using perfetto::Annotations;
using perfetto::Category;
using perfetto::Note;
using perfetto::PacketBuffer;

constexpr std::size_t kBlock = 1U << 18U;  // bytes encoded before they are written
constexpr std::size_t kMostFlows = 4096;   // leaving one publication
constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

struct InstanceRecord {
  Instance instance;        // its logical_id is a view and not kept
  std::uint32_t name = 0;   // of the logical id
  std::uint64_t index = 0;  // in order of arrival
};

// Outer instances before those they contain.
struct ByStart {
  bool operator()(const InstanceRecord& a, const InstanceRecord& b) const {
    const auto key = [](const InstanceRecord& r) {
      const auto end = r.instance.end ? r.instance.end->ns : kNever;
      return std::tuple(r.instance.start, -end, r.instance.pid, r.instance.tid, r.name,
                        r.instance.seq);
    };
    return key(a) < key(b);
  }
};

// A message published, or taken by an instance.
struct MessageRecord {
  std::uint64_t writer_gid = 0;
  std::int64_t source_timestamp = 0;
  bool is_take = false;
  std::int64_t time = 0;
  std::uint64_t instance = 0;  // take: index of the instance
  Publication publication{};   // else; its topic is a view and not kept
  std::uint32_t topic = 0;
};

// The publication of a message before those who took it.
struct ByMessage {
  bool operator()(const MessageRecord& a, const MessageRecord& b) const {
    const auto key = [](const MessageRecord& r) {
      return std::tuple(r.writer_gid, r.source_timestamp, r.is_take, r.time, r.instance,
                        r.publication.pid, r.publication.tid, r.publication.seq);
    };
    return key(a) < key(b);
  }
};

bool is_same_message(const MessageRecord& a, const MessageRecord& b) {
  return a.writer_gid == b.writer_gid && a.source_timestamp == b.source_timestamp &&
         a.writer_gid != 0;
}

std::string_view label_of(InstanceState state) {
  switch (state) {
    case InstanceState::complete:
      return "complete";
    case InstanceState::open:
      return "open";
    case InstanceState::cut_by_window:
      break;
  }
  return "cut by window";
}

// Which bound of the response time "end - release" is (definitions: "Missing release").
Note response_note(ReleaseSource source) {
  switch (source) {
    case ReleaseSource::exact:
      return Note::response_time_ns;
    case ReleaseSource::source_timestamp:
      return Note::response_time_upper_ns;
    case ReleaseSource::wakeup:
    case ReleaseSource::start:
    case ReleaseSource::mixed:
      break;
  }
  return Note::response_time_lower_ns;
}

Annotations notes_of(const Instance& i) {
  Annotations notes;
  notes.add(Note::seq, i.seq);
  notes.add(Note::release_source, analysis::label(i.release_source));
  if (i.end && i.release) {
    notes.add(response_note(i.release_source), (*i.end - *i.release).ns);
  }
  if (i.release && i.release_source == ReleaseSource::exact) {
    notes.add(Note::start_latency_ns, (i.start - *i.release).ns);
  }
  notes.add(Note::missed, std::uint64_t{i.missed});
  notes.add(Note::status, label(i.status));
  notes.add(Note::state, label_of(i.state));
  if (i.cpu_start) {
    notes.add(Note::cpu_start, std::int64_t{*i.cpu_start});
  }
  if (i.cpu_end) {
    notes.add(Note::cpu_end, std::int64_t{*i.cpu_end});
  }
  notes.add_time(Note::execution_ns, i.execution);
  notes.add_time(Note::preempted_ns, i.preempted);
  notes.add_time(Note::blocked_ns, i.blocked);
  notes.add_time(Note::wake_delay_ns, i.wake_delay);
  return notes;
}

Annotations notes_of(const Publication& p) {
  Annotations notes;
  notes.add(Note::seq, p.seq);
  notes.add(Note::publisher_id, std::uint64_t{p.publisher_id});
  notes.add(Note::writer_gid, p.writer_gid);
  notes.add(Note::source_timestamp_realtime_ns, p.source_timestamp_realtime_ns);
  return notes;
}

}  // namespace

struct PerfettoExport::State {
  explicit State(const PerfettoOptions& options)
      : gzip(options.gzip),
        instances(options.records_in_memory, options.spill_directory),
        messages(options.records_in_memory, options.spill_directory),
        publish_packets(options.spill_directory),
        sched(options.spill_directory) {}

  bool gzip = false;
  NameTable callbacks;
  NameTable topics;
  perfetto::Tracks tracks;
  std::int64_t first_time = kNever;
  std::uint64_t next_index = 0;
  ExternalSorter<InstanceRecord, ByStart> instances;
  ExternalSorter<MessageRecord, ByMessage> messages;
  std::vector<bool> has_flow;  // by index of the instance
  Spool publish_packets;
  perfetto::SchedRecorder sched;
  PacketBuffer packets;
  PerfettoCounts counts;
  analysis::Progress* progress = nullptr;

  void write_packets(std::ostream& out, const analysis::Report& report);
  void write_preamble(std::ostream& out, const analysis::Report& report);
  void draw_publications();
  void draw_publication(const MessageRecord& record, const std::vector<std::uint64_t>& flows);
  void draw_instance(const InstanceRecord& record);
  void draw_wait(const InstanceRecord& record);
  void flush(std::ostream& out) {
    out.write(packets.bytes().data(), static_cast<std::streamsize>(packets.bytes().size()));
    packets.clear();
  }
};

void PerfettoExport::State::write_preamble(std::ostream& out, const analysis::Report& report) {
  const auto begin = report.trace.begin ? report.trace.begin->ns : kNever;
  const auto time = std::min(std::max<std::int64_t>(begin, 0), first_time);
  const auto known = time == kNever ? 0 : time;
  packets.preamble(known, report.trace.clock_offset_ns);
  tracks.describe(packets, report, known);
  std::vector<std::string> names;
  for (std::uint32_t i = 0; i < callbacks.size(); ++i) {
    names.push_back(valid_utf8(callbacks.name(i)));
  }
  for (std::uint32_t i = 0; i < topics.size(); ++i) {
    names.push_back("publish " + valid_utf8(topics.name(i)));
  }
  packets.interned(known, names);
  flush(out);
}

// Joins publications and takes of the same message. A flow's id is the number of the instance that
// took the message, so every pair of publication and subscriber has one of its own.
void PerfettoExport::State::draw_publications() {
  has_flow.resize(next_index);
  std::optional<MessageRecord> publication;
  std::vector<std::uint64_t> flows;
  const auto finish = [&] {
    if (publication) {
      draw_publication(*publication, flows);
    }
    flows.clear();
  };
  messages.drain([&](const MessageRecord& record) {
    if (!record.is_take) {
      // A second publication of the same message (a damaged trace) has no flows of its own.
      if (publication && is_same_message(*publication, record)) {
        draw_publication(record, {});
        return;
      }
      finish();
      publication = record;
    } else if (publication && is_same_message(*publication, record)) {
      if (record.time < publication->time) {
        ++counts.backward_flows;
      } else if (flows.size() < kMostFlows) {
        flows.push_back(record.instance + 1);
        has_flow[record.instance] = true;
        ++counts.flows;
      }
    }
  });
  finish();
  publish_packets.append(packets.bytes());
  packets.clear();
}

void PerfettoExport::State::draw_publication(const MessageRecord& record,
                                             const std::vector<std::uint64_t>& flows) {
  const auto& p = record.publication;
  const perfetto::Slice slice{.track = tracks.thread_track(p.pid, p.tid),
                              .category = Category::publish,
                              .name_iid = callbacks.size() + record.topic + 1};
  packets.instant(p.time.ns, slice, notes_of(p), flows);
  ++counts.publications;
  if (packets.bytes().size() >= kBlock) {
    publish_packets.append(packets.bytes());
    packets.clear();
  }
}

void PerfettoExport::State::draw_instance(const InstanceRecord& record) {
  const auto& i = record.instance;
  const auto end = i.end ? std::optional(i.end->ns) : std::nullopt;
  const auto track = tracks.instance_track(packets, {i.pid, i.tid}, i.start.ns, end);
  if (!track) {
    ++counts.skipped;
    return;
  }
  const perfetto::Slice slice{
      .track = *track, .category = Category::callback, .name_iid = std::uint64_t{record.name} + 1};
  packets.slice_begin(i.start.ns, slice, notes_of(i),
                      has_flow[record.index] ? record.index + 1 : 0);
  if (end) {
    packets.slice_end(*end, *track);  // an instance without an end is drawn to the end of the trace
  }
  ++counts.callback_slices;
  draw_wait(record);
}

void PerfettoExport::State::draw_wait(const InstanceRecord& record) {
  const auto& i = record.instance;
  if (!i.release || i.release->ns < 0 || !(*i.release < i.start)) {
    return;
  }
  const auto track = tracks.wait_track(packets, {i.pid, i.tid}, i.release->ns, i.start.ns);
  if (!track) {
    ++counts.skipped;
    return;
  }
  Annotations notes;
  notes.add(Note::seq, i.seq);
  notes.add(Note::release_source, analysis::label(i.release_source));
  const perfetto::Slice slice{
      .track = *track, .category = Category::wait, .name_iid = std::uint64_t{record.name} + 1};
  packets.slice_begin(i.release->ns, slice, notes);
  packets.slice_end(i.start.ns, *track);
  ++counts.waits;
}

PerfettoExport::PerfettoExport(const PerfettoOptions& options)
    : state_(std::make_unique<State>(options)) {}
PerfettoExport::~PerfettoExport() = default;

void PerfettoExport::on_instance(const Instance& instance) {
  auto& s = *state_;
  if (instance.start.ns < 0 || (instance.end && *instance.end < instance.start)) {
    ++s.counts.skipped;
    return;
  }
  const auto earliest =
      instance.release ? std::min(*instance.release, instance.start) : instance.start;
  s.first_time = std::min(s.first_time, std::max<std::int64_t>(earliest.ns, 0));
  s.tracks.see(instance.pid, instance.tid);
  InstanceRecord record{instance, s.callbacks.number(instance.logical_id, instance.callback),
                        s.next_index++};
  record.instance.logical_id = {};
  record.instance.preempted_by = {};
  s.instances.add(record);
  if (instance.writer_gid != 0) {
    s.messages.add({.writer_gid = instance.writer_gid,
                    .source_timestamp = instance.source_timestamp_realtime_ns,
                    .is_take = true,
                    .time = instance.start.ns,
                    .instance = record.index});
  }
}

void PerfettoExport::on_publication(const Publication& publication) {
  auto& s = *state_;
  if (publication.time.ns < 0) {
    ++s.counts.skipped;
    return;
  }
  s.first_time = std::min(s.first_time, publication.time.ns);
  s.tracks.see(publication.pid, publication.tid);
  MessageRecord record{.writer_gid = publication.writer_gid,
                       .source_timestamp = publication.source_timestamp_realtime_ns,
                       .time = publication.time.ns,
                       .publication = publication,
                       .topic = s.topics.number(publication.topic)};
  record.publication.topic = {};
  s.messages.add(record);
}

void PerfettoExport::on_sched_slice(const analysis::SchedSlice& slice) {
  auto& s = *state_;
  if (slice.begin == slice.end) {
    return;  // switched in and out within one tick of the clock: nothing to draw
  }
  if (s.sched.add(slice)) {
    s.first_time = std::min(s.first_time, slice.begin.ns);
    ++s.counts.sched_slices;
  } else {
    ++s.counts.skipped;
  }
}

void PerfettoExport::State::write_packets(std::ostream& out, const analysis::Report& report) {
  write_preamble(out, report);
  draw_publications();
  if (progress != nullptr) progress->total = instances.size();
  instances.drain([&](const InstanceRecord& record) {
    draw_instance(record);
    if (progress != nullptr) progress->add(1);
    if (packets.bytes().size() >= kBlock) {
      flush(out);
    }
  });
  flush(out);
  // After the callbacks: of two events at the same time Perfetto takes the first in the file first,
  // and a publication lies inside the callback that starts with it.
  publish_packets.copy_to(out);
  sched.finish(out);
}

void PerfettoExport::show_progress(analysis::Progress* progress) { state_->progress = progress; }

PerfettoCounts PerfettoExport::write(std::ostream& out, const analysis::Report& report) {
  if (state_->gzip) {
    GzipStream compressed(out);
    state_->write_packets(compressed.stream(), report);
    compressed.finish();
  } else {
    state_->write_packets(out, report);
  }
  return state_->counts;
}

}  // namespace cie::viewer_export
