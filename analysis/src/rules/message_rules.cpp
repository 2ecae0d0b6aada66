#include "message_rules.hpp"

#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/host_clocks.hpp"
#include "model/subjects.hpp"
#include "proof.hpp"
#include "thread_questions.hpp"

#include <algorithm>
#include <set>
#include <string>

namespace cie::analysis {
namespace {

void judge_queue(const RuleContext& context, const CallbackFacts& callback, Judgement& judgement) {
  const bool is_attached =
      context.model.processes[at(callback.process)].first_moment == RunMoment::announce;
  const auto* entry = spec_entry(context, callback);
  const auto allowed = entry != nullptr ? entry->overwrites_allowed.value_or(0) : 0;
  const auto lost = std::max(callback.lost, callback.fini ? callback.fini->lost : 0);
  const auto overwritten =
      std::max(callback.overwritten, callback.fini ? callback.fini->overwritten : 0);
  judgement.check(std::max(callback.releases, callback.starts.count));
  const auto where = [&callback](const std::optional<EventRef>& running) {
    return running ? *running : callback.fini->at;
  };
  if (lost > 0) {
    judgement.fail(evidence(
        callback.lost_at ? "sample_lost" : "callback_fini", where(callback.lost_at),
        counted(lost, "sample") + (lost == 1 ? " was" : " were") + " lost before the queue"));
  }
  if (overwritten > allowed) {
    judgement.fail(evidence(callback.overwritten_at ? "callback_release" : "callback_fini",
                            where(callback.overwritten_at),
                            counted(overwritten, "sample") + (overwritten == 1 ? " was" : " were") +
                                " overwritten in the queue before being taken; " +
                                std::to_string(allowed) + " are allowed"));
  }
  const bool has_totals = callback.fini || (is_attached && callback.releases > 0);
  if (!has_totals) {
    const auto& last = callback.starts.count > 0 ? callback.starts.last_at : *callback.registered;
    judgement.doubt(evidence("callback_fini", last,
                             "the totals of lost and overwritten samples were not seen"));
  }
}

std::vector<SubjectVerdict> judge_queues(const RuleContext& context) {
  const auto& model = context.model;
  const Proof proof(model);
  return judge_callbacks(
      model, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (callback.kind == CallbackKind::timer) return;
        judgement.doubt(proof.loss(index));
        if (callback.registered) judge_queue(context, callback, judgement);
      });
}

struct Bound {
  const char* name;
  std::optional<std::int64_t> limit;
  const char* needs;  // to be measured
  const Statistics& measured;
  const std::optional<ChainExtreme>& max;
};

// What the largest value proves, hosts' clocks considered.
Verdict judge_largest(Duration shown, const std::optional<ClockError>& error, std::int64_t limit) {
  const auto within = error.value_or(ClockError{.least = Duration{}, .most = Duration{}});
  if (within.is_contradiction()) return Verdict::inconclusive;
  if (within.most && (shown + *within.most).ns <= limit) return Verdict::pass;
  if (within.least && (shown + *within.least).ns > limit) return Verdict::fail;
  return Verdict::inconclusive;
}

void judge_bound(const RuleContext& context, const SpecChain& asked, const Bound& bound,
                 const std::optional<ClockError>& error, Judgement& judgement) {
  if (!bound.limit) return;
  judgement.check(bound.measured.count());
  if (!bound.max) {
    judgement.doubt(
        evidence("callback_end", moment(context.model.end.value_or(Timestamp{})),
                 "no " + std::string(bound.name) + " could be measured: " + bound.needs));
    return;
  }
  const auto verdict = judge_largest(bound.max->value, error, *bound.limit);
  if (verdict == Verdict::pass) return;
  const auto finding = std::string(bound.name) + " " + nanoseconds(bound.max->value) + ", " +
                       place(context, asked.line) + " allows " + nanoseconds(*bound.limit);
  const auto& first = bound.max->first_start;
  const auto& last = bound.max->last_end;
  if (verdict == Verdict::inconclusive) {
    judgement.doubt(evidence("callback_end", last,
                             finding + "; the hosts' clocks may differ by too much to tell"));
    return;
  }
  judgement.fail(evidence("callback_start", first, "first callback of the chain starts"));
  judgement.fail(evidence("callback_end", last, finding));
}

// Loss anywhere on the chain, or of callbacks that nothing of was seen.
std::optional<Evidence> loss_on(const RuleContext& context, const SpecChain& asked,
                                const Proof& proof) {
  const auto& model = context.model;
  const std::set<std::string_view> hops(asked.callbacks.begin(), asked.callbacks.end());
  std::set<std::string_view> seen;
  std::set<std::string_view> topics;  // of the messages that link the chain
  for (const auto index : callbacks_in_order(model)) {
    const auto& callback = model.callbacks[at(index)];
    if (!hops.contains(callback.logical_id)) continue;
    seen.insert(callback.logical_id);
    if (proof.loss(index)) return proof.loss(index);
    if (callback.logical_id != asked.callbacks.front()) topics.insert(callback.source);
  }
  for (const auto& publisher : model.publishers) {
    if (publisher.registered && !topics.contains(publisher.topic)) continue;
    if (auto loss = proof.loss(publisher)) return loss;
  }
  if (seen.size() == hops.size()) return std::nullopt;
  for (std::size_t i = 0; i < model.processes.size(); ++i) {
    const auto index = ProcessIndex{static_cast<std::uint32_t>(i)};
    if (model.processes[i].has_cie_events && !proof.is_complete(index)) {
      return proof.incompleteness(index);
    }
  }
  return std::nullopt;
}

std::vector<SubjectVerdict> judge_chains(const RuleContext& context) {
  std::vector<SubjectVerdict> verdicts;
  if (context.options.spec == nullptr) return verdicts;
  const auto& model = context.model;
  const Proof proof(model);
  const Subjects subjects(model);
  for (const auto& asked : context.options.spec->chains()) {
    if (!asked.path_latency_ns && !asked.reaction_time_ns && !asked.data_age_ns) continue;
    const auto chain = std::ranges::find_if(model.chains, [&asked](const ChainFacts& facts) {
      return facts.specified && facts.name == asked.name;
    });
    Judgement judgement(
        chain == model.chains.end()
            ? NamedSubject::without_row(SubjectKind::chain, asked.name)
            : subjects.chain(ChainIndex{static_cast<std::uint32_t>(chain - model.chains.begin())}));
    judgement.overrule(loss_on(context, asked, proof));
    if (chain == model.chains.end() || chain->instances == 0) {
      judgement.doubt(evidence("callback_end", moment(model.end.value_or(Timestamp{})),
                               place(context, asked.line) +
                                   " specifies it, and no message of the trace leads along it: no "
                                   "instance of the chain could be linked"));
    }
    if (chain != model.chains.end()) {
      constexpr const char* kTwo =
          "it takes two instances of the chain with nothing lost between them";
      const auto error = clock_error(model, *chain);
      for (const auto& bound :
           {Bound{"path latency", asked.path_latency_ns, "no first release is known",
                  chain->path_latency, chain->max_path_latency},
            Bound{"reaction time", asked.reaction_time_ns, kTwo, chain->reaction_time,
                  chain->max_reaction_time},
            Bound{"data age", asked.data_age_ns, kTwo, chain->data_age, chain->max_data_age}}) {
        if (chain->instances > 0) judge_bound(context, asked, bound, error, judgement);
      }
      if (chain->incomplete != 0) {
        judgement.overrule(evidence("publish", chain->first_incomplete.value_or(EventRef{}),
                                    "the publish of the message taken here was not seen; " +
                                        std::to_string(chain->incomplete) +
                                        " instances of the chain are incomplete"));
      }
      if (asked.path_latency_ns && chain->inexact != 0) {
        judgement.doubt(evidence("release", moment(model.begin.value_or(Timestamp{})),
                                 "the first release of " + counted(chain->inexact, "instance") +
                                     " of the chain is not known exactly, or the clocks of its "
                                     "hosts cannot be related"));
      }
    }
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

}  // namespace

const Rule kNoQueueOverflow{
    "Q1", "no-queue-overflow",
    "No sample was lost before a callback's queue, and no more were overwritten in it than "
    "overwrites_allowed says (0 by default).\n"
    "Why it matters: A lost sample is an input that the callback never sees, while everything "
    "else looks well.\n"
    "Inconclusive when the totals were not seen, as after a crash.\n"
    "Remedy: a deeper queue, a faster callback, or overwrites_allowed where only the newest "
    "sample matters.",
    judge_queues};

const Rule kChainBounds{
    "Q2",
    "chain-bounds",
    "Path latency, reaction time and data age of the chains in the spec stay within their "
    "bounds.\n"
    "Why it matters: What the vehicle does depends on the whole path from sensor to actuator: "
    "every callback can be in time and the path too late.\n"
    "Inconclusive when no instance of the chain could be linked (cie report --spec lists it with "
    "0), nothing of what is bounded could be measured, the publish of a message on the chain was "
    "not seen, a callback of it lost instances, or, for the path latency, the first release of an "
    "instance is not known exactly (later ones need not be); between hosts also when what their "
    "clocks may differ by decides.\n"
    "Remedy: the hop table of cie report --spec shows which callback or message takes the time; "
    "where nothing could be linked, M1 says whether its callbacks exist.",
    judge_chains,
    {.spec = true}};

}  // namespace cie::analysis
