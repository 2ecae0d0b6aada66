#include <cie/tracepoints/utf8.hpp>
#include <cie/viewer_export/perfetto_export.hpp>

#include "output/background_stream.hpp"
#include "output/gzip_stream.hpp"
#include "perfetto_counters.hpp"
#include "perfetto_enforcement.hpp"
#include "perfetto_packets.hpp"
#include "perfetto_sched.hpp"
#include "perfetto_tracks.hpp"
#include "timelines/notes.hpp"
#include "timelines/recorded_run.hpp"
#include "words/callback_names.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace cie::viewer_export {
namespace {

using analysis::Instance;
using analysis::Publication;
using perfetto::Annotations;
using perfetto::Category;
using perfetto::PacketBuffer;

// CLOCK_REALTIME - CLOCK_MONOTONIC of a host.
std::optional<std::int64_t> offset_of(const analysis::Report& report, analysis::HostIndex host) {
  const bool is_known = at(host) < report.hosts.size() && report.hosts[at(host)].clock_offset_ns;
  return is_known ? report.hosts[at(host)].clock_offset_ns : report.trace.clock_offset_ns;
}

constexpr std::size_t kBlock = 1U << 18U;  // bytes encoded before they are written

}  // namespace

struct PerfettoExport::State {
  explicit State(const PerfettoOptions& options)
      : gzip(options.gzip),
        run(options.records_in_memory, options.spill_directory),
        counters(options.records_in_memory, options.spill_directory),
        sched(options.spill_directory) {}

  bool gzip = false;
  RecordedRun run;
  CommonClock clock;
  std::set<analysis::HostIndex> hosts{analysis::HostIndex{}};
  std::map<analysis::HostIndex, std::int64_t> first_sched;
  perfetto::Tracks tracks;
  perfetto::Counters counters;
  perfetto::SchedRecorder sched;
  PacketBuffer packets;
  std::vector<std::string> names;  // of callbacks, by RecordedInstance::name
  Annotations notes;               // of what is drawn
  PerfettoCounts counts;

  void write_packets(std::ostream& out, const analysis::AnalysisResult& result);
  // While packets are encoded, those before them go to `out`.
  void write_in_background(std::ostream& out, const analysis::AnalysisResult& result) {
    BackgroundStream background(out);
    write_packets(background.stream(), result);
    background.finish();
  }
  std::int64_t begin_of(const analysis::Report& report) const;
  void write_preamble(const analysis::Report& report, std::int64_t begin);
  void draw(const RecordedPublication& record);
  void draw(const RecordedInstance& record);
  void draw_wait(const RecordedInstance& record);
  // Puts them into `notes`.
  template <typename T>
  const Annotations& notes_of(const T& told);
  perfetto::Drawing drawing() { return {packets, tracks, names}; }
  void flush(std::ostream& out) {
    out.write(packets.bytes().data(), static_cast<std::streamsize>(packets.bytes().size()));
    packets.clear();
  }
};

template <typename T>
const Annotations& PerfettoExport::State::notes_of(const T& told) {
  notes.clear();
  visit_notes(told, [this](Note note, const auto& value) { notes.add(note, value); });
  return notes;
}

std::int64_t PerfettoExport::State::begin_of(const analysis::Report& report) const {
  auto begin = run.first_time(clock);
  const auto include = [&begin](std::int64_t time) {
    begin = std::min(begin.value_or(time), time);
  };
  for (const auto& [host, time] : first_sched)
    include(clock.of(host, time));
  if (report.trace.begin) include(std::max<std::int64_t>(clock.of_summary(*report.trace.begin), 0));
  return begin.value_or(0);
}

void PerfettoExport::State::write_preamble(const analysis::Report& report, std::int64_t begin) {
  for (const auto& process : report.processes)
    hosts.insert(process.host_index);
  for (const auto& thread : run.threads().all())
    hosts.insert(thread.host);
  // Of ids: the process is told by where a slice is drawn.
  const CallbackNames short_names(report, {.unicode = true});
  std::vector<std::string> logical_ids;
  for (std::uint32_t i = 0; i < run.callbacks().size(); ++i) {
    logical_ids.push_back(valid_utf8(run.callbacks().name(i)));
    names.push_back(short_names.of_id(run.callbacks().name(i)));
  }
  auto event_names = names;
  for (std::uint32_t i = 0; i < run.topics().size(); ++i) {
    event_names.push_back("publish " + valid_utf8(run.topics().name(i)));
  }
  for (const auto host : hosts) {
    packets.set_machine(host);
    packets.preamble(clock.own(host, begin), offset_of(report, host));
    if (clock.is_shifted() && host != analysis::HostIndex{}) {
      packets.clock_of_machine(clock.shift_of(host) - clock.shift_of({}));
    }
  }
  tracks.describe(packets, report, run.threads(), {.clock = clock, .begin = begin});
  for (const auto host : hosts) {
    packets.set_machine(host);
    packets.interned(clock.own(host, begin), event_names, logical_ids);
  }
}

// An arrow's id is the number of the instance that took the message, so every pair of publication
// and subscriber has one of its own.
void PerfettoExport::State::draw(const RecordedPublication& record) {
  const auto& p = record.publication;
  std::vector<std::uint64_t> arrows(record.receivers.begin(), record.receivers.end());
  for (auto& arrow : arrows)
    ++arrow;  // 0 means none
  packets.set_machine(p.host);
  tracks.change_process(packets, record.thread, p.process, p.time.ns);
  packets.instant(p.time.ns,
                  {.track = tracks.thread_track(record.thread),
                   .category = Category::publish,
                   .name_iid = run.callbacks().size() + record.topic + 1},
                  notes_of(p), arrows);
  ++counts.publications;
}

void PerfettoExport::State::draw(const RecordedInstance& record) {
  const auto& i = record.instance;
  const auto end = i.end ? std::optional(i.end->ns) : std::nullopt;
  counters.draw_queue(drawing(), record);
  packets.set_machine(i.host);
  tracks.change_process(packets, record.thread, i.process, i.start.ns);
  const auto track = tracks.instance_track(packets, record.thread, i.start.ns, end);
  if (!track) {
    ++counts.skipped;
    return;
  }
  const perfetto::Slice slice{
      .track = *track, .category = Category::callback, .name_iid = std::uint64_t{record.name} + 1};
  const auto response = counters.response(drawing(), record);
  notes_of(i);
  notes.add_logical_id(record.name);
  packets.slice_begin(i.start.ns, slice, notes, record.takes_seen_message ? record.index + 1 : 0);
  if (end) {  // an instance without an end is drawn to the end of the trace
    packets.slice_end(*end, *track, response);
  }
  ++counts.callback_slices;
  draw_wait(record);
}

void PerfettoExport::State::draw_wait(const RecordedInstance& record) {
  const auto& i = record.instance;
  if (!i.release || i.release->ns < 0 || !(*i.release < i.start)) {
    return;
  }
  const auto track = tracks.wait_track(packets, record.thread, wait_words(i.release_source),
                                       i.release->ns, i.start.ns);
  if (!track) {
    ++counts.skipped;
    return;
  }
  notes.clear();
  notes.add(Note::seq, i.seq);
  notes.add(Note::release_source, i.release_source);
  notes.add_logical_id(record.name);
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
  if (s.run.add(instance)) s.counters.see(instance);
}

void PerfettoExport::on_publication(const Publication& publication) {
  state_->run.add(publication);
}

void PerfettoExport::on_sched_slice(const analysis::SchedSlice& slice) {
  auto& s = *state_;
  if (slice.begin == slice.end) {
    return;  // switched in and out within one tick of the clock: nothing to draw
  }
  if (s.sched.add(slice)) {
    const auto [first, is_new] = s.first_sched.try_emplace(slice.host, slice.begin.ns);
    if (is_new) s.hosts.insert(slice.host);
    first->second = std::min(first->second, slice.begin.ns);
    ++s.counts.sched_slices;
  } else {
    ++s.counts.skipped;
  }
}

void PerfettoExport::on_waking(const analysis::Waking& waking) {
  if (state_->sched.add(waking)) {
    state_->hosts.insert(waking.host);
    ++state_->counts.wakings;
  }
}

void PerfettoExport::State::write_packets(std::ostream& out,
                                          const analysis::AnalysisResult& result) {
  clock = CommonClock(result.report);
  const auto begin = begin_of(result.report);
  const auto flush_full = [&] {
    if (packets.bytes().size() >= kBlock) flush(out);
  };
  write_preamble(result.report, begin);
  counts.violations = draw_violations(packets, tracks, result, {.clock = clock, .begin = begin});
  // Of two events at the same time Perfetto takes the first in the file first, and a publication
  // lies inside the callback that starts with it: replay() tells the instance first.
  run.replay(
      result.report, clock,
      [&](const RecordedInstance& record) {
        draw(record);
        flush_full();
      },
      [&](const RecordedPublication& record) {
        draw(record);
        flush_full();
      });
  counters.finish(drawing(), flush_full);
  flush(out);
  sched.finish(out);
  counts.response_values = counters.responses();
  counts.queue_changes = counters.queue_changes();
  counts.flows = run.deliveries();
  counts.backward_flows = run.backward_deliveries();
  counts.skipped += run.skipped();
}

void PerfettoExport::show_progress(analysis::Progress* progress) {
  state_->run.show_progress(progress);
}

PerfettoCounts PerfettoExport::write(std::ostream& out, const analysis::AnalysisResult& result) {
  if (state_->gzip) {
    GzipStream compressed(out);
    state_->write_in_background(compressed.stream(), result);
    compressed.finish();
  } else {
    state_->write_in_background(out, result);
  }
  return state_->counts;
}

}  // namespace cie::viewer_export
