#include "trace_rules.hpp"

#include <cie/analysis/note.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "judgement.hpp"
#include "model/recorded_parts.hpp"
#include "time_namespaces.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

struct Requirement {
  std::string_view event;
  std::string_view absent;  // code of the note that tells what to do
};
constexpr std::array<Requirement, 5> kRequired{{
    {"run_begin", "no-event-of-begin"},
    {"callback_init", "no-event-of-begin"},
    {"thread_init", "no-event-of-begin"},
    {"callback_start", "no-event-of-runs"},
    {"callback_end", "no-event-of-runs"},
}};

// The same of recordings that hold ROS 2's words alone.
constexpr std::array<Requirement, 4> kRequiredOfRos2{{
    {"rcl_init", "no-ros2-event-of-begin"},
    {"callback_init", "no-ros2-event-of-registration"},
    {"callback_start", "no-ros2-event-of-runs"},
    {"callback_end", "no-ros2-event-of-runs"},
}};

std::span<const Requirement> required_of(const Model& model) {
  bool is_any = false;
  for (const auto& process : model.processes) {
    if (!process.has_cie_events) continue;
    if (!process.is_from_ros2) return kRequired;
    is_any = true;
  }
  if (is_any) return kRequiredOfRos2;
  return kRequired;
}

EventRef begin_of(const Model& model) { return moment(model.begin); }

bool is_damage(const Loss& loss) {
  return loss.kind == LossKind::damaged_packet || loss.kind == LossKind::foreign_metadata;
}

template <typename Predicate>
std::vector<const Loss*> losses_of(const Model& model, Predicate is_wanted) {
  std::vector<const Loss*> losses;
  for (const auto& loss : model.losses) {
    if (is_wanted(loss)) losses.push_back(&loss);
  }
  std::ranges::stable_sort(losses, {}, [](const Loss* loss) {
    return std::tie(loss->begin, loss->end, loss->kind, loss->domain, loss->cpu, loss->note);
  });
  return losses;
}

// What recordings and their files do not agree about. However many files are gone,
// some are named, and all are counted.
void doubt_files(const Model& model, Judgement& judgement) {
  constexpr std::size_t kNamed = 32;
  std::size_t count = 0;
  for (const auto& recording : model.recordings) {
    for (const auto& doubt : recording.doubts) {
      if (++count > kNamed) continue;
      judgement.unseen(evidence(
          std::string(label(doubt.kind)), begin_of(model),
          recording.name.empty()
              ? free_text(doubt.note)
              : note("text-of-recording", {{"text", doubt.note}, {"recording", recording.name}})));
    }
  }
  if (count > kNamed) {
    judgement.unseen(
        evidence("missing_file", begin_of(model), note("more-files", {{"files", count - kNamed}})));
  }
}

// What the tracers counted when the recordings ended: what they lost last, no packet tells.
std::vector<Evidence> losses_of_manifests(const Model& model) {
  std::vector<Evidence> losses;
  for (const auto& recording : model.recordings) {
    if (!recording.manifest) continue;
    const auto tell = [&](Note lost) {
      losses.push_back(evidence("manifest", begin_of(model), std::move(lost)));
    };
    for (const auto& channel : recording.manifest->channels) {
      if (channel.discarded_events == 0) continue;
      tell(note("events-of-channel-discarded",
                {{"events", channel.discarded_events}, {"channel", channel.name}}));
    }
    if (const auto lost = recording.manifest->kernel.lost_events; lost != 0)
      tell(note("events-of-kernel-discarded", {{"events", lost}}));
  }
  return losses;
}

// The verdict of a rule that has one subject.
std::vector<SubjectVerdict> only(Judgement&& judgement) {
  std::vector<SubjectVerdict> verdicts;
  conclude(std::move(judgement), verdicts);
  return verdicts;
}

std::vector<SubjectVerdict> judge_readable(const RuleContext& context) {
  Judgement judgement(NamedSubject::trace(), context.known);
  for (const auto& stream : context.model.streams)
    judgement.checked(stream.packets);
  if (context.model.streams.empty()) judgement.checked(context.model.events.total);
  for (const auto* loss : losses_of(context.model, is_damage)) {
    const auto item = [loss] { return evidence_of(*loss); };
    if (context.model.events.total == 0) judgement.violation([&] { return std::vector{item()}; });
    judgement.unseen(item);
  }
  doubt_files(context.model, judgement);
  return only(std::move(judgement));
}

// What recorders say of themselves. Where totals prove that nothing is missing, it is named alone.
void doubt_recorders(const RuleContext& context, Judgement& judgement) {
  const auto& losses = context.proof.recorder_losses();
  for (const auto& failure : recorder_failures(context.model)) {
    const bool is_lossy =
        std::ranges::find(losses, failure.recording, &RecorderFailure::recording) != losses.end();
    for (const auto& problem : failure.problems) {
      auto item = evidence("recorder_problem", begin_of(context.model),
                           free_text(in_words(failure, problem)));
      if (is_lossy) {
        judgement.unseen(std::move(item));
      } else {
        judgement.remark(std::move(item));
      }
    }
  }
}

std::vector<SubjectVerdict> judge_no_loss(const RuleContext& context) {
  const auto& model = context.model;
  Judgement judgement(NamedSubject::trace(), context.known);
  judgement.checked(model.events.total);
  const auto is_of_users = [](const Loss& loss) { return loss.domain == Domain::user; };
  for (const auto* loss : losses_of(model, [](const Loss&) { return true; })) {
    const auto item = [loss] { return evidence_of(*loss); };
    const bool is_certain = loss->kind != LossKind::host_gap;  // nothing need have happened in it
    if (context.options.require_lossless && is_certain)
      judgement.violation([&] { return std::vector{item()}; });
    if (context.options.require_lossless && !is_certain) judgement.unseen(item);
    judgement.remark(item);
    if (is_of_users(*loss) && context.proof.is_anything_lost()) judgement.unseen(item);
  }
  for (const auto& host : model.hosts) {
    if (host.cpus_not_recorded == 0) continue;
    const auto missing = evidence_of_missing_cpus(host.cpus_not_recorded, model.begin);
    if (context.options.require_lossless) judgement.violation(std::vector{missing});
    judgement.remark(missing);
  }
  if (context.options.require_lossless) {
    for (const auto& loss : losses_of_manifests(model))
      judgement.violation(std::vector{loss});
    doubt_files(model, judgement);  // a loss may be told by the file that is gone
  }
  for (const auto& part : unseen_parts(model)) {
    judgement.unseen(
        evidence("unseen_" + std::string(label(part.kind)), begin_of(model), free_text(part.note)));
  }
  doubt_recorders(context, judgement);
  return only(std::move(judgement));
}

// What is absent may be among what applications lost.
bool is_any_user_event_lost(const Model& model) {
  return std::ranges::any_of(model.losses, [](const Loss& loss) {
    return loss.domain == Domain::user && loss.is_evidence &&
           loss.kind != LossKind::foreign_metadata;
  });
}

// Some instance is counted, or listed.
bool has_runs(const Model& model) {
  return std::ranges::any_of(model.callbacks, [](const CallbackFacts& callback) {
    return callback.instances + callback.cut_instances + callback.open_count > 0;
  });
}

// The totals of all processes prove it.
bool has_no_callbacks(const Model& model) {
  bool is_any = false;
  for (const auto& process : model.processes) {
    if (!process.has_cie_events) continue;
    if (!process.run_end || process.run_end->callbacks != 0) return false;
    is_any = true;
  }
  return is_any;
}

std::vector<SubjectVerdict> judge_required_events(const RuleContext& context) {
  const auto& events = context.model.events;
  Judgement judgement(NamedSubject::trace(), context.known);
  const auto missing = [&](Note what) {
    judgement.unseen(without_event(begin_of(context.model), std::move(what)));
  };
  const bool is_cut = context.options.window.has_value();
  if (events.cie == 0 && context.model.processes.empty()) {
    missing(note("no-events-of-applications"));
    return only(std::move(judgement));
  }
  const bool is_lossy = is_any_user_event_lost(context.model);
  const bool is_idle = has_no_callbacks(context.model);
  if (is_idle) missing(note("no-callback-registered"));
  for (const auto& requirement : required_of(context.model)) {
    if (events.by_name.contains(requirement.event)) {
      judgement.checked();
    } else if (is_idle && requirement.event != "run_begin") {
      continue;  // there was none to record
    } else if (is_cut && requirement.event.find("init") == std::string_view::npos) {
      missing(note("no-event-in-window", {{"event", requirement.event}}));
    } else if (is_lossy) {
      missing(note("no-event-perhaps-lost", {{"event", requirement.event}}));
    } else {
      missing(note(requirement.absent, {{"event", requirement.event}}));
    }
  }
  const std::array<std::pair<std::string_view, std::uint64_t>, 2> contexts{
      {{"vpid", events.cie_without_pid}, {"vtid", events.cie_without_tid}}};
  for (const auto& [name, without] : contexts) {
    if (without == 0) {
      judgement.checked();
    } else {
      missing(note("events-without-context", {{"events", without}, {"context", name}}));
    }
  }
  const bool is_any_lost = events.by_name.contains("callback_start") && !has_runs(context.model);
  if (is_any_lost && events.cie_without_pid == 0) {
    missing(note("no-instance-covered"));
  }
  return only(std::move(judgement));
}

std::vector<SubjectVerdict> judge_time_sane(const RuleContext& context) {
  const auto& model = context.model;
  Judgement judgement(NamedSubject::trace(), context.known);
  judgement.checked(std::max<std::uint64_t>(model.streams.size(), model.events.total > 0 ? 1 : 0));
  const auto apart = clocks_apart(model);
  for (const auto& [host, why] : apart)
    judgement.unseen(why);
  for (std::size_t i = 0; i < model.hosts.size(); ++i)
    judgement.unseen(apart_from_kernel(model, HostIndex{static_cast<std::uint32_t>(i)}));
  const auto& regressions = model.time_regressions;
  if (regressions.first && apart.empty()) {  // else the tracer did write them as they were
    judgement.violation(std::vector{
        evidence("time_regression", moment(regressions.first_previous),
                 note("stream-had-come-to", {{"time", regressions.first_previous}})),
        evidence(
            "time_regression", *regressions.first,
            note("time-went-back", {{"back", regressions.first_previous - regressions.first->time},
                                    {"time", regressions.first->time},
                                    {"times", regressions.count}}))});
  }
  if (model.clocks_unrelated) {
    judgement.unseen(evidence("clock", begin_of(model), note("clocks-unrelated")));
  }
  for (const auto index : context.callbacks) {
    const auto& callback = model.callbacks[at(index)];
    const auto& told = callback.impossible_releases;
    if (!told) continue;
    judgement.unseen([&] {
      return evidence("callback_start", told->start,
                      note("release-after-start", {{"callback", NamedCallback{callback.logical_id}},
                                                   {"seq", told->seq},
                                                   {"after", told->release - told->start.time},
                                                   {"instances", told->count}}));
    });
  }
  return only(std::move(judgement));
}

}  // namespace

const Rule kTraceReadable{
    .id = kReadableRule,
    .name = "trace-readable",
    .meaning =
        "Every packet of the trace could be decoded; one that could not is skipped and named, and "
        "the rest is used.",
    .why_it_matters =
        "What a damaged packet held may have been the very event that breaks a rule, so the rules "
        "count it as lost.",
    .inconclusive_when =
        "some packets were damaged and skipped, or were read with another recording's metadata; "
        "or when a file that the recording's manifest names is missing or has another size (with "
        "--check: another SHA-256). When nothing at all can be decoded, cie ends with exit code 4.",
    .remedy =
        "check the disk and the copy (a recording by cie record has checksums in its manifest), "
        "or record again.",
    .judge = judge_readable,
    .needs = {.is_about_trace = true}};

const Rule kNoLoss{
    .id = kNoLossRule,
    .name = "no-loss",
    .meaning =
        "The tracer threw nothing away that a verdict needed. Loss is judged per subject: "
        "contiguous numbers and totals prove that a callback or thread lost nothing, so a loss "
        "that cost no subject its proof passes and is named. What the kernel's record lacks takes "
        "the parts of instances (R4, M6's budget) and no other verdict: it is named, and passes. "
        "FAIL only with --require-lossless, which also counts what the manifest says was "
        "discarded.",
    .why_it_matters =
        "Tracers discard events when a buffer is full, mostly when the system is busiest: what is "
        "missing is seldom the harmless part.",
    .inconclusive_when =
        "events or packets of applications were discarded, or nobody recorded them between two "
        "sessions, and some subject of a rule lost its proof with them or is undecided by them; or when nothing was seen "
        "of a process, a chunk or the kernel's events that the recording's manifest names; or when "
        "its recorder failed or has not ended, and no totals prove that nothing is missing.",
    .remedy =
        "where applications lost events, larger or more sub-buffers (cie record --subbuf-size, "
        "--num-subbuf); where the kernel's were lost, larger buffers of theirs (cie record "
        "--kernel-buffer); or fewer enabled events.",
    .violation = "lost events",
    .judge = judge_no_loss,
    .needs = {.is_about_trace = true, .is_of_report = true}};

const Rule kRequiredEvents{
    .id = "T5",
    .name = "required-events",
    .meaning =
        "The trace holds what every judgement rests on: run_begin, callback_init, thread_init, "
        "callback_start, callback_end and the contexts vpid and vtid; of ROS 2, rcl_init, what "
        "makes callbacks known, and the same two. Whatever else a rule needs, that rule asks for.",
    .why_it_matters =
        "Without them there is nothing to judge, and a rule that judges nothing must not look as "
        "if it passed.",
    .inconclusive_when =
        "one of them is absent: the message names it and how to enable it; or when no instance of "
        "a callback lies within what all streams cover.",
    .remedy = "record with cie record, or enable the named events and contexts.",
    .judge = judge_required_events,
    .needs = {.is_about_trace = true}};

const Rule kTimeSane{
    .id = "T6",
    .name = "time-sane",
    .meaning =
        "Times can be compared: none runs backwards inside a stream (FAIL: no correct tracer "
        "writes that), all streams and processes of a machine share a clock, and the releases that instances tell are "
        "of it, too. Machines, and boots of one machine, are judged each by its own clock; what "
        "passes between them goes by CLOCK_REALTIME, with its error.",
    .why_it_matters =
        "Response times are differences of times of several streams; with clocks that do not "
        "belong together they mean nothing.",
    .inconclusive_when =
        "streams that name no machine carry clocks of different boots, or of no common origin; or "
        "when a kernel trace shares no clock with the applications': it is then no evidence, and "
        "the other rules judge as if it were not there, and likewise of a process in a time namespace, whose "
        "clock has an offset. Beside a process that has another clock no other rule is decided. Or an instance tells a release behind its own start: it is taken for "
        "unknown.",
    .remedy =
        "verify such traces apart; record a process in a time namespace apart from others; after a FAIL record again with "
        "another version of the tracer; an executor writes release_ns by CLOCK_MONOTONIC.",
    .violation = "had times that ran backwards",
    .judge = judge_time_sane,
    .needs = {.is_about_trace = true}};

}  // namespace cie::analysis
