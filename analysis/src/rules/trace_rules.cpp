#include "trace_rules.hpp"

#include "judgement.hpp"
#include "proof.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <tuple>

namespace cie::analysis {
namespace {

constexpr const char* kTrace = "trace";

struct Requirement {
  std::string_view event;
  std::string_view remedy;
};
constexpr std::array<Requirement, 5> kRequired{{
    {"run_begin", "enable cie:run_begin before the application starts, or attach to it"},
    {"callback_init", "enable cie:callback_init before the application starts, or attach to it"},
    {"thread_init", "enable cie:thread_init before the application starts, or attach to it"},
    {"callback_start", "enable cie:callback_start and let a callback run"},
    {"callback_end", "enable cie:callback_end and let a callback run"},
}};

EventRef begin_of(const Model& model) { return moment(model.begin.value_or(Timestamp{})); }

std::vector<Evidence> losses_of(const Model& model, bool only_damage) {
  std::vector<const Loss*> losses;
  for (const auto& loss : model.losses) {
    const bool is_damage =
        loss.kind == LossKind::damaged_packet || loss.kind == LossKind::foreign_metadata;
    if (!only_damage || is_damage) losses.push_back(&loss);
  }
  std::ranges::stable_sort(losses, {}, [](const Loss* loss) {
    return std::tie(loss->begin, loss->end, loss->kind, loss->domain, loss->cpu, loss->note);
  });
  std::vector<Evidence> evidences;
  evidences.reserve(losses.size());
  for (const auto* loss : losses)
    evidences.push_back(evidence_of(*loss));
  return evidences;
}

// The verdict of a rule that has one subject.
std::vector<SubjectVerdict> only(Judgement&& judgement) {
  std::vector<SubjectVerdict> verdicts;
  conclude(std::move(judgement), verdicts);
  return verdicts;
}

std::vector<SubjectVerdict> judge_readable(const RuleContext& context) {
  Judgement judgement(kTrace);
  for (const auto& stream : context.model.streams)
    judgement.check(stream.packets);
  if (context.model.streams.empty()) judgement.check(context.model.events.total);
  const auto damage = losses_of(context.model, true);
  for (const auto& item : damage) {
    if (context.model.events.total == 0) judgement.fail(item);
    judgement.doubt(item);
  }
  return only(std::move(judgement));
}

std::vector<SubjectVerdict> judge_no_loss(const RuleContext& context) {
  const auto& model = context.model;
  Judgement judgement(kTrace);
  judgement.check(model.events.total);
  const auto losses = losses_of(model, false);
  const bool is_proof_lost = !losses.empty() && Proof(model).is_anything_lost();
  for (const auto& loss : losses) {
    if (context.options.require_lossless) judgement.fail(loss);
    if (is_proof_lost) judgement.doubt(loss);
    judgement.remark(loss);
  }
  return only(std::move(judgement));
}

std::vector<SubjectVerdict> judge_required_events(const RuleContext& context) {
  const auto& events = context.model.events;
  Judgement judgement(kTrace);
  const auto missing = [&](std::string_view what, std::string note) {
    judgement.doubt(evidence(std::string(what), begin_of(context.model), std::move(note)));
  };
  const bool is_cut = context.options.window.has_value();
  for (const auto& requirement : kRequired) {
    if (events.by_name.contains(requirement.event)) {
      judgement.check();
    } else if (is_cut && requirement.event.find("init") == std::string_view::npos) {
      missing(requirement.event, "none in the window; widen --window, or leave it out");
    } else {
      missing(requirement.event, "absent; " + std::string(requirement.remedy));
    }
  }
  const std::array<std::pair<std::string_view, std::uint64_t>, 2> contexts{
      {{"vpid", events.cie_without_pid}, {"vtid", events.cie_without_tid}}};
  for (const auto& [name, without] : contexts) {
    if (without == 0) {
      judgement.check();
    } else {
      missing(name, counted(without, "event") + " without " + std::string(name) +
                        "; add it: lttng add-context --userspace --type=" + std::string(name));
    }
  }
  return only(std::move(judgement));
}

std::vector<SubjectVerdict> judge_time_sane(const RuleContext& context) {
  const auto& model = context.model;
  Judgement judgement(kTrace);
  judgement.check(std::max<std::uint64_t>(model.streams.size(), model.events.total > 0 ? 1 : 0));
  const auto& regressions = model.time_regressions;
  if (regressions.first) {
    judgement.fail(evidence("time_regression", moment(regressions.first_previous),
                            "the stream had come to this time"));
    judgement.fail(
        evidence("time_regression", *regressions.first,
                 "and went back to this one; " + counted(regressions.count, "time") + " in all"));
  }
  if (model.clocks_unrelated) {
    judgement.doubt(evidence("clock", begin_of(model),
                             "streams were recorded under different boots or clocks; their times "
                             "cannot be compared"));
  }
  return only(std::move(judgement));
}

}  // namespace

const Rule kTraceReadable{
    "T1", "trace-readable",
    "Every packet of the trace could be decoded; one that could not is skipped and named, and "
    "the rest is used.\n"
    "Why it matters: What a damaged packet held may have been the very event that breaks a "
    "rule, so the rules count it as lost.\n"
    "Inconclusive when some packets were damaged and skipped, or were read with another "
    "recording's metadata. When nothing at all can be decoded, cie ends with exit code 4.\n"
    "Remedy: record again, or check the disk and the copy with the checksums of the recording's "
    "manifest.",
    judge_readable};

const Rule kNoLoss{
    "T2", "no-loss",
    "The tracer threw nothing away that a verdict needed. Loss is judged per subject: "
    "contiguous numbers and totals prove that a callback or thread lost nothing, so a loss that "
    "cost no subject its proof passes and is named. FAIL only with --require-lossless.\n"
    "Why it matters: Tracers discard events when a buffer is full, mostly when the system is "
    "busiest: what is missing is seldom the harmless part.\n"
    "Inconclusive when events or packets were discarded and some subject of a rule lost its "
    "proof with them.\n"
    "Remedy: larger or more sub-buffers (cie record --subbuf-size, --num-subbuf), or fewer "
    "enabled events.",
    judge_no_loss};

const Rule kRequiredEvents{
    "T5", "required-events",
    "The trace holds what every judgement rests on: run_begin, callback_init, thread_init, "
    "callback_start, callback_end and the contexts vpid and vtid. Whatever else a rule needs, "
    "that rule asks for.\n"
    "Why it matters: Without them there is nothing to judge, and a rule that judges nothing "
    "must not look as if it passed.\n"
    "Inconclusive when one of them is absent: the message names it and how to enable it.\n"
    "Remedy: record with cie record, or enable the named events and contexts.",
    judge_required_events};

const Rule kTimeSane{
    "T6", "time-sane",
    "Times can be compared: none runs backwards inside a stream (FAIL: no correct tracer writes "
    "that), and all streams share a clock.\n"
    "Why it matters: Response times are differences of times of several streams; with clocks "
    "that do not belong together they mean nothing.\n"
    "Inconclusive when streams carry clocks of different boots, or of no common origin.\n"
    "Remedy: verify the traces of one boot together, others apart; after a FAIL record again "
    "with another version of the tracer.",
    judge_time_sane};

}  // namespace cie::analysis
