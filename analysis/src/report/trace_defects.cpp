#include "trace_defects.hpp"

#include <cie/tracepoints/schema.hpp>

#include "model/callback_questions.hpp"
#include "model/clock_differences.hpp"
#include "model/host_gaps.hpp"
#include "model/recorded_parts.hpp"
#include "rules/time_namespaces.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <map>
#include <numeric>
#include <string>
#include <utility>

namespace cie::analysis {
namespace {

constexpr std::array<std::string_view, 40> kLabels{"damaged-manifest",
                                                   "missing-files",
                                                   "unseen-process",
                                                   "unseen-chunk",
                                                   "unseen-kernel",
                                                   "recorder-problem",
                                                   "begins-late",
                                                   "damaged-packets",
                                                   "foreign-metadata",
                                                   "malformed-classes",
                                                   "discarded-events",
                                                   "discarded-packets",
                                                   "streams-left-out",
                                                   "streams-apart",
                                                   "sched-switch-gaps",
                                                   "cpus-not-recorded",
                                                   "time-runs-backwards",
                                                   "clocks-unrelated",
                                                   "clocks-drifted",
                                                   "impossible-releases",
                                                   "host-gap",
                                                   "seq-gaps",
                                                   "publish-gaps",
                                                   "read-back-gaps",
                                                   "ends-without-start",
                                                   "repeated-ends",
                                                   "open-instances",
                                                   "instances-cut-by-window",
                                                   "instances-outside-window",
                                                   "unregistered-callbacks",
                                                   "callbacks-beside",
                                                   "unregistered-publishers",
                                                   "identity-failures",
                                                   "incomplete-chains",
                                                   "reads-not-kept",
                                                   "chains-not-listed",
                                                   "missing-run-begin",
                                                   "missing-run-end",
                                                   "shared-pid",
                                                   "contract-too-new"};

void add_defect(std::vector<TraceDefect>& defects, DefectKind kind, Severity severity,
                std::uint64_t count, std::string advice) {
  if (count == 0) return;
  defects.push_back(
      TraceDefect{.kind = kind, .severity = severity, .count = count, .advice = std::move(advice)});
}

template <typename IsCounted>
std::uint64_t count_losses(const Model& model, LossKind kind, const IsCounted& is_counted) {
  std::uint64_t total = 0;
  for (const auto& loss : model.losses) {
    if (loss.kind == kind && is_counted(loss)) total += loss.count.value_or(loss.times);
  }
  return total;
}

std::uint64_t count_losses(const Model& model, LossKind kind) {
  return count_losses(model, kind, [](const Loss&) { return true; });
}

// A kernel's recorder may run for longer than what it serves to measure.
std::uint64_t switch_gaps_in_window(const Model& model) {
  const auto is_inside = [&model](const Loss& loss) {
    if (!model.begin || !model.end) return true;
    const auto shift = clock_shift(model.hosts[at(loss.host)], *reference_host(model));
    return loss.begin <= *model.end - shift && loss.end >= *model.begin - shift;
  };
  return count_losses(model, LossKind::switch_mismatch, is_inside);
}

// Whose buffers were too small, and what makes them larger: the recorder's options differ.
std::string larger_buffers(const Model& model, LossKind kind) {
  const auto is_of = [&model, kind](Domain domain) {
    return std::ranges::any_of(model.losses, [kind, domain](const Loss& loss) {
      return loss.kind == kind && loss.domain == domain;
    });
  };
  std::string of_applications =
      "larger or more sub-buffers (cie record --subbuf-size, --num-subbuf)";
  std::string of_kernel =
      "larger buffers of the kernel's events (cie record --kernel-buffer; LTTng: sub-buffers of the "
      "kernel's channel)";
  if (!is_of(Domain::kernel)) return of_applications;
  if (!is_of(Domain::user)) return of_kernel;
  return of_applications + ", and " + of_kernel;
}

template <typename Range, typename Count>
std::uint64_t total_of(const Range& range, Count count) {
  return std::accumulate(
      range.begin(), range.end(), std::uint64_t{0},
      [&count](std::uint64_t sum, const auto& item) { return sum + count(item); });
}

// Pairs of hosts whose fastest messages both ways took less than nothing together, or of which a clock
// was set.
std::uint64_t contradictory_clocks(const Model& model) {
  return static_cast<std::uint64_t>(
      std::ranges::count_if(model.host_clocks, [&model](const auto& entry) {
        const auto& [from, to] = entry.first;
        return from < to && (is_any_clock_set(model, entry.first) ||
                             clock_error(model, entry.first).is_contradiction());
      }));
}

// Streams for which `is_one` holds, as "ust/uid/0/64-bit/events_1 and 3 others".
template <typename IsOne>
void add_streams(std::vector<TraceDefect>& defects, const Model& model, DefectKind kind,
                 IsOne is_one, const std::string& advice) {
  std::vector<std::string> paths;
  for (const auto& stream : model.streams) {
    if (is_one(stream)) paths.push_back(stream.path);
  }
  if (paths.empty()) return;
  constexpr std::size_t kShown = 3;
  std::sort(paths.begin(), paths.end());
  std::string names;
  for (std::size_t i = 0; i < std::min(paths.size(), kShown); ++i)
    names += (i == 0 ? "" : ", ") + paths[i];
  if (paths.size() > kShown) names += " and " + std::to_string(paths.size() - kShown) + " more";
  add_defect(defects, kind, Severity::error, paths.size(), advice + ": " + names);
}

std::string utc(std::int64_t realtime_ns) {
  const auto seconds = static_cast<std::time_t>(realtime_ns / 1'000'000'000);
  std::tm date{};
  std::array<char, 32> text{};
  if (gmtime_r(&seconds, &date) == nullptr ||
      std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", &date) == 0) {
    return "a time that is no date";
  }
  return text.data();
}

DefectKind defect_of(PartKind kind) {
  switch (kind) {
    case PartKind::process:
      return DefectKind::unseen_process;
    case PartKind::chunk:
      return DefectKind::unseen_chunk;
    case PartKind::kernel:
      break;
  }
  return DefectKind::unseen_kernel;
}

// Ends of instances that were seen to start, and not of those that never ended or were still running
// when the record ended.
std::uint64_t lost_ends(const CallbackFacts& facts, const ThreadLives& lives) {
  if (facts.ended.missing == 0) return 0;
  std::uint64_t lost = 0;
  if (const auto& totals = facts.fini) {
    const auto unended = totals->started - std::min(totals->started, totals->ended);
    lost = facts.open_count - std::min(facts.open_count, unended);
  } else {
    lost = static_cast<std::uint64_t>(std::ranges::count_if(
        facts.open, [&](const auto& open) { return lives.is_end_lost(facts, open); }));
  }
  return std::min(lost, facts.ended.missing);
}

// What manifests say that the reader of the numbers must know.
void add_recording_defects(const Model& model, std::vector<TraceDefect>& defects) {
  std::uint64_t files = 0;
  for (const auto& recording : model.recordings) {
    for (const auto& doubt : recording.doubts) {
      if (doubt.kind != FileDoubtKind::manifest) {
        ++files;
        continue;
      }
      add_defect(defects, DefectKind::damaged_manifest, Severity::error, 1,
                 doubt.note + " (" + recording.name + ')');
    }
  }
  add_defect(defects, DefectKind::missing_files, Severity::error, files,
             "recorded files are missing or changed; cie verify names them (T1)");
  for (const auto& part : unseen_parts(model))
    add_defect(defects, defect_of(part.kind), Severity::loss, 1, part.note);
  for (const auto& failure : recorder_failures(model)) {
    if (!failure.recording->is_unfinished) continue;
    add_defect(defects, DefectKind::recorder_problem, Severity::error, 1,
               in_words(failure, failure.problems.front()));
  }
  for (const auto& recording : recording_reports(model)) {
    for (const auto& problem : recording.problems) {
      add_defect(defects, DefectKind::recorder_problem, Severity::error, 1,
                 "cie record says: " + problem);
    }
    if (!begins_late(recording)) continue;
    add_defect(defects, DefectKind::begins_late, Severity::info, *recording.first_chunk - 1,
               "chunks before the first one that is here were not read: " + recording.path +
                   " is from " + utc(recording.begin.realtime_ns) + " on");
  }
}

// What tracers wrote and cannot be read, or did not write.
void add_tracer_losses(const Model& model, std::vector<TraceDefect>& defects) {
  add_defect(defects, DefectKind::damaged_packets, Severity::error,
             count_losses(model, LossKind::damaged_packet),
             "some packets could not be read and were skipped; what they held is missing");
  add_defect(defects, DefectKind::foreign_metadata, Severity::error,
             count_losses(model, LossKind::foreign_metadata),
             "read with metadata that is not its own: right only as far as both agree");
  const auto malformed =
      std::ranges::find_if(model.streams, [](const auto& s) { return s.malformed_classes > 0; });
  if (malformed != model.streams.end()) {
    add_defect(
        defects, DefectKind::malformed_classes, Severity::error,
        total_of(model.streams, [](const auto& s) { return s.malformed_classes; }),
        "classes of events that cannot be understood; packets without such events were read: " +
            malformed->malformed);
  }
  add_defect(defects, DefectKind::discarded_events, Severity::loss,
             count_losses(model, LossKind::discarded_events),
             "the tracer's buffers were full: record with " +
                 larger_buffers(model, LossKind::discarded_events));
  add_defect(defects, DefectKind::discarded_packets, Severity::loss,
             count_losses(model, LossKind::discarded_packets),
             "whole packets are missing: use discard mode, or " +
                 larger_buffers(model, LossKind::discarded_packets) + ", or look for a lost file");
}

// Streams that have no time in common with others.
void add_stream_defects(const Model& model, std::vector<TraceDefect>& defects) {
  add_streams(
      defects, model, DefectKind::streams_left_out,
      [](const StreamFacts& s) { return s.is_left_out; },
      "they cover no time that most streams of their channel cover: the window is that of the "
      "others, in which these are missing; read them without the others to see what they hold");
  add_streams(
      defects, model, DefectKind::streams_apart, [](const StreamFacts& s) { return s.is_apart; },
      "no time is covered by all of these streams, so nothing of theirs is counted; cie report "
      "finds what most of them cover");
}

// What the kernel's record misses.
void add_kernel_defects(const Model& model, std::vector<TraceDefect>& defects) {
  add_defect(defects, DefectKind::sched_switch_gaps, Severity::loss, switch_gaps_in_window(model),
             "the kernel's record misses switches: execution times around them are not measured");
  add_defect(defects, DefectKind::cpus_not_recorded, Severity::loss,
             total_of(model.hosts, [](const auto& host) { return host.cpus_not_recorded; }),
             "kernel streams are missing: execution times of what may have run on those CPUs are "
             "not measured");
}

// Times that cannot be trusted, or compared.
void add_clock_defects(const Model& model, std::vector<TraceDefect>& defects) {
  add_defect(defects, DefectKind::time_runs_backwards, Severity::error,
             model.time_regressions.count,
             "a stream's clock went back: its times cannot be trusted");
  add_defect(defects, DefectKind::clocks_unrelated, Severity::error, model.clocks_unrelated ? 1 : 0,
             "the traces do not share a boot id: times of different streams cannot be compared");
  add_defect(defects, DefectKind::clocks_unrelated, Severity::error, clocks_apart(model).size(),
             "a process is in a time namespace: its times cannot be compared with those of others; "
             "record it apart");
  add_defect(
      defects, DefectKind::clocks_drifted, Severity::error, contradictory_clocks(model),
      "the difference of two hosts' clocks changed meanwhile, as one was set, or messages arrive "
      "before they were sent, whatever it is; synchronise them");
  add_defect(defects, DefectKind::impossible_releases, Severity::error,
             total_of(model.callbacks,
                      [](const auto& c) {
                        return c.impossible_releases ? c.impossible_releases->count : 0;
                      }),
             "instances tell a release behind their start, by another clock than CLOCK_MONOTONIC "
             "perhaps: it is taken for unknown");
}

// Holes in what is numbered.
void add_number_gaps(const Model& model, const ThreadLives& lives,
                     std::vector<TraceDefect>& defects) {
  add_defect(defects, DefectKind::seq_gaps, Severity::loss,
             total_of(model.callbacks,
                      [&lives](const auto& c) { return c.starts.missing + lost_ends(c, lives); }),
             "instances are missing from the record, or their ends are; figures of their callbacks "
             "are incomplete");
  add_defect(defects, DefectKind::publish_gaps, Severity::loss,
             total_of(model.publishers, [](const auto& p) { return p.published.missing; }),
             "publications are missing from the record; chains through them are incomplete");
  add_defect(defects, DefectKind::read_back_gaps, Severity::loss,
             total_of(model.threads, [](const auto& t) { return t.read_backs.missing; }),
             "scheduling read-backs are missing from the record");
}

// Of the streams of a channel that are furthest apart in what `edge` tells, the one that narrows the
// window; empty: none does.
template <typename Narrower>
std::string narrowest(const Model& model, std::optional<Timestamp> StreamFacts::*edge,
                      const Narrower& is_narrower) {
  std::map<std::uint32_t, std::pair<const StreamFacts*, const StreamFacts*>> extremes;
  for (const auto& stream : model.streams) {
    if (stream.domain != Domain::user || !stream.has_callback_events || !(stream.*edge)) continue;
    auto& [widest, narrow] = extremes.try_emplace(stream.channel, &stream, &stream).first->second;
    if (is_narrower(*(widest->*edge), *(stream.*edge))) widest = &stream;
    if (is_narrower(*(stream.*edge), *(narrow->*edge))) narrow = &stream;
  }
  std::string path;
  Duration most;
  for (const auto& [channel, streams] : extremes) {
    const Duration apart{std::abs((*(streams.first->*edge) - *(streams.second->*edge)).ns)};
    if (apart <= most) continue;
    most = apart;
    path = streams.second->path;
  }
  return path;
}

// Why the window is shorter than what its streams hold: "; events_1 begins last, events_0 ends first".
std::string edges_of_window(const Model& model) {
  const auto begin = narrowest(model, &StreamFacts::covers_from, std::greater{});
  const auto end = narrowest(model, &StreamFacts::covers_to, std::less{});
  auto text = begin.empty() ? std::string() : "; " + begin + " begins last";
  if (!end.empty()) text += (begin.empty() ? "; " : ", ") + end + " ends first";
  return text;
}

// Starts and ends that do not pair, or not within the window.
void add_unpaired_instances(const Model& model, std::vector<TraceDefect>& defects) {
  add_defect(defects, DefectKind::ends_without_start, Severity::loss,
             total_of(model.callbacks, [](const auto& c) { return c.ends_without_start; }),
             "an instance's start is missing; it is not counted");
  add_defect(defects, DefectKind::repeated_ends, Severity::error,
             total_of(model.callbacks, [](const auto& c) { return c.second_ends; }),
             "an instance ended twice: the traced program does not pair its events");
  add_defect(defects, DefectKind::open_instances, Severity::info,
             total_of(model.callbacks, [](const auto& c) { return c.open_count; }),
             "started but never ended in this trace; listed, not counted");
  add_defect(defects, DefectKind::instances_cut_by_window, Severity::info,
             total_of(model.callbacks, [](const auto& c) { return c.cut_instances; }),
             "they overlap an edge of what all streams cover; listed, not counted");
  add_defect(
      defects, DefectKind::instances_outside_window, Severity::info,
      total_of(model.callbacks, left_out_instances),
      "recorded before or behind what all streams cover, so not counted" + edges_of_window(model));
}

void add_unregistered_callbacks(const Model& model, std::vector<TraceDefect>& defects) {
  const auto unregistered = [&model](bool of_ros2) {
    return total_of(model.callbacks, [&model, of_ros2](const auto& c) {
      const auto is_of_ros2 = [&] { return is_ros2_only(model.processes[at(c.process)]); };
      return std::uint64_t{!c.registered && is_of_ros2() == of_ros2};
    });
  };
  add_defect(defects, DefectKind::unregistered_callbacks, Severity::loss, unregistered(false),
             "no callback_init was seen: record from the start, or attach for more than a second");
  add_defect(
      defects, DefectKind::unregistered_callbacks, Severity::loss, unregistered(true),
      "ROS 2's events describe a callback once, when it is made: record from the start of its "
      "application, or what is made in a session of its own (ros2 trace --dual-session)");
}

// Callbacks that another executor runs in a process of this project.
void add_callbacks_beside(const Model& model, std::vector<TraceDefect>& defects) {
  std::uint64_t count = 0;
  const std::string* first = nullptr;
  for (const auto& process : model.processes) {
    for (const auto& [id, ran] : process.beside_own) {
      if (!ran) continue;
      ++count;
      if (first == nullptr) first = &id;
    }
  }
  if (count == 0) return;
  add_defect(defects, DefectKind::callbacks_beside, Severity::loss, count,
             "ROS 2's events show that another executor runs " + *first +
                 (count > 1 ? " and others" : "") +
                 " in a process of this project: their instances are not measured");
}

// Those of ROS 2 whose announcement is missing are as numerous as its nodes' own topics.
void add_unregistered_publishers(const Model& model, std::vector<TraceDefect>& defects) {
  add_defect(defects, DefectKind::unregistered_publishers, Severity::loss,
             total_of(model.publishers,
                      [](const auto& publisher) {
                        const bool is_silent = publisher.published.count == 0;
                        return std::uint64_t{publisher.is_accounted && !publisher.registered &&
                                             !is_silent};
                      }),
             "no publisher_init was seen: their messages have no topic and lead to no callback, so "
             "chains through them are missing; record from the start, or attach for more than a "
             "second");
}

void add_chain_defects(const Model& model, std::vector<TraceDefect>& defects) {
  add_defect(defects, DefectKind::incomplete_chains, Severity::loss,
             total_of(model.chains, [](const auto& c) { return c.incomplete + c.unlinked; }),
             "a message's publication was not seen, or announced seconds too late; those chain "
             "instances are not measured");
  add_defect(
      defects, DefectKind::reads_not_kept, Severity::info,
      total_of(model.chains, [](const auto& c) { return c.reads_not_kept; }),
      "too many reads of a chain's first callback had no answer yet: they are in no reaction "
      "time, but for the longest, which is exact");
  add_defect(defects, DefectKind::chains_not_listed, Severity::info, model.unlisted_chain_instances,
             "instances end a path of more than 32 callbacks (callbacks that feed each other?) or "
             "one of too many paths: they are in no chain; a chain that a spec names is measured "
             "all the same");
}

// Processes without their beginning or end, or that cannot be told apart.
void add_process_defects(const Model& model, std::vector<TraceDefect>& defects) {
  const auto missing_marker = [&model](auto has) {
    return total_of(model.processes, [has](const ProcessFacts& p) {
      return std::uint64_t{p.has_cie_events && !has(p)};
    });
  };
  add_defect(defects, DefectKind::missing_run_begin, Severity::loss,
             missing_marker([](const ProcessFacts& p) { return has_begun_here(p); }),
             "the beginning of a process's run was not recorded");
  add_defect(defects, DefectKind::missing_run_end, Severity::info,
             missing_marker([](const ProcessFacts& p) {
               return p.run_end.has_value() || p.is_from_ros2;  // which tells no end
             }),
             "a process was still running, or was interrupted, when the recording ended");
  add_defect(
      defects, DefectKind::shared_pid, Severity::error,
      total_of(model.processes,
               [](const ProcessFacts& p) { return std::uint64_t{p.shares_pid_since.has_value()}; }),
      "events of processes of one pid cannot be told apart: record containers with the context pid_ns "
      "(cie record --ros2 does), or one by one; run a "
      "program that forks without exec() with LD_PRELOAD=liblttng-ust-fork.so.1; a run_begin may be "
      "lost");
  add_defect(defects, DefectKind::contract_too_new, Severity::error,
             total_of(model.processes,
                      [](const ProcessFacts& p) {
                        return std::uint64_t{p.contract_version > kContractVersion};
                      }),
             "the trace follows a newer contract than this program knows: update cie");
}

}  // namespace

std::vector<TraceDefect> trace_defects(const Model& model, const ThreadLives& lives) {
  std::vector<TraceDefect> defects;
  add_recording_defects(model, defects);
  add_tracer_losses(model, defects);
  add_stream_defects(model, defects);
  add_kernel_defects(model, defects);
  add_clock_defects(model, defects);
  for (const auto& gap : host_gaps(model))
    add_defect(defects, DefectKind::host_gap, Severity::loss, 1, in_words(gap, model));
  for (const auto& runs : model.between_sessions)
    add_defect(defects, DefectKind::host_gap, Severity::loss, 1, in_words(runs, model));
  add_number_gaps(model, lives, defects);
  add_unpaired_instances(model, defects);
  add_unregistered_callbacks(model, defects);
  add_callbacks_beside(model, defects);
  add_unregistered_publishers(model, defects);
  add_defect(defects, DefectKind::identity_failures, Severity::error,
             total_of(model.callbacks, [](const auto& c) { return c.identity_failures; }),
             "execution, preempted, blocked and wake delay do not add up to the duration");
  add_chain_defects(model, defects);
  add_process_defects(model, defects);
  return defects;
}

std::string_view label(DefectKind kind) noexcept {
  const auto index = static_cast<std::size_t>(kind);
  return index < kLabels.size() ? kLabels[index] : std::string_view{};
}

}  // namespace cie::analysis
