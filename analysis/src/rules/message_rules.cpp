#include "message_rules.hpp"

#include <cie/analysis/note.hpp>
#include <cie/analysis/rule_pages.hpp>

#include "each_subject.hpp"
#include "judgement.hpp"
#include "model/callback_questions.hpp"
#include "model/clock_differences.hpp"
#include "queue_losses.hpp"
#include "spec_questions.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::analysis {
namespace {

// No more samples than allowed were overwritten in a queue that was the callback's own for certain. In a
// window nobody counts those apart.
bool is_by_others(const RuleContext& context, const CallbackFacts& callback,
                  std::uint64_t allowed) {
  return callback.own && (context.options.window || callback.own->overwritten <= allowed);
}

void judge_queue(const RuleContext& context, const CallbackFacts& callback, Judgement& judgement) {
  const auto allowed = most_allowed(context, callback, &SpecEntry::overwrites_allowed);
  const auto [lost, overwritten, are_totals_seen, is_at_least] = queue_losses(context, callback);
  judgement.checked(std::max(callback.releases, callback.starts.count));
  const auto where = [&callback](const Rare<EventRef>& running) {
    return running ? *running : callback.fini->at;
  };
  if (lost > 0) {
    judgement.violation(
        std::vector{evidence(callback.lost_at ? "sample_lost" : "callback_fini",
                             where(callback.lost_at), note("samples-lost", {{"samples", lost}}))});
  }
  if (overwritten > allowed) {
    auto found = evidence(callback.overwritten_at ? "callback_release" : "callback_fini",
                          where(callback.overwritten_at),
                          note(is_at_least ? "samples-overwritten-at-least" : "samples-overwritten",
                               {{"samples", overwritten}, {"allowed", allowed}}));
    if (is_by_others(context, callback, allowed)) {
      found.note = note("queue-perhaps-anothers",
                        {{"overwritten", std::move(found.note)}, {"why", perhaps_anothers_note()}});
      judgement.unseen(std::move(found));
    } else {
      judgement.violation(std::vector{std::move(found)});
    }
  } else if (overwritten > 0) {
    judgement.unseen(unknown_entry(context, callback, [](const SpecEntry& entry) {
      return entry.overwrites_allowed.value_or(0) > 0;
    }));
  }
  if (!are_totals_seen) {
    const auto& last = callback.starts.count > 0 ? callback.starts.last_at : *callback.registered;
    judgement.unseen(without_event(last, note("no-queue-totals")));
  }
}

std::vector<SubjectVerdict> judge_queues(const RuleContext& context) {
  return judge_callbacks(
      context, [&](CallbackIndex index, const CallbackFacts& callback, Judgement& judgement) {
        if (callback.kind == CallbackKind::timer) return;
        judgement.needs(context.known.lost_run(index));
        if (!callback.registered) return;
        judge_queue(context, callback, judgement);
        // Running totals tell of no loss before them that an event alone told of, nor of what came after.
        if (!callback.fini) {
          judgement.needs({hidden(EventKind::lost_sample, context.known.scope_of(index),
                                  callback.registered->time)});
        }
      });
}

struct Bound {
  const char* name;
  std::optional<std::int64_t> limit;
  bool needs_two;  // instances to be measured; else judge_unmeasured says why it was not
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

void accuse(const ChainExtreme& extreme, Note finding, const std::vector<Evidence>& unseen,
            Judgement& judgement) {
  if (extreme.is_unproven) {
    judgement.unseen(evidence("callback_end", extreme.last_end,
                              note("led-to-by-unended", {{"finding", std::move(finding)}})));
    return;
  }
  judgement.violation_unless(unseen,
                             {evidence("callback_start", extreme.first_start, note("chain-starts")),
                              evidence("callback_end", extreme.last_end, std::move(finding))});
}

void judge_bound(const RuleContext& context, const SpecChain& asked, const Bound& bound,
                 const std::optional<ClockError>& error, const std::vector<Evidence>& unseen,
                 Judgement& judgement) {
  if (!bound.limit) return;
  judgement.checked(bound.measured.count());
  if (!bound.max) {
    if (!bound.needs_two) return;
    judgement.unseen(without_event(moment(context.model.end),
                                   note("chain-unmeasured", {{"quantity", bound.name}})));
    return;
  }
  const auto verdict = judge_largest(bound.max->value, error, *bound.limit);
  if (verdict == Verdict::pass) return;
  auto finding = note("chain-bound-exceeded", {{"quantity", bound.name},
                                               {"value", bound.max->value},
                                               {"spec", place(context, asked.line)},
                                               {"limit", Duration{*bound.limit}}});
  if (verdict == Verdict::fail) {
    accuse(*bound.max, std::move(finding), unseen, judgement);
    return;
  }
  judgement.unseen(evidence("callback_end", bound.max->last_end,
                            note("clocks-perhaps-differ", {{"finding", std::move(finding)}})));
}

// Path latencies of instances whose first release is not known: their bounds may decide.
void judge_unmeasured(const RuleContext& context, const SpecChain& asked, const ChainFacts& chain,
                      const std::optional<ClockError>& error, const std::vector<Evidence>& unseen,
                      Judgement& judgement) {
  if (!asked.path_latency_ns || chain.inexact == 0) return;
  const auto limit = *asked.path_latency_ns;
  judgement.checked(chain.inexact - chain.without_upper_bound);
  const auto& lower = chain.max_path_latency_lower;
  if (lower && judge_largest(lower->value, error, limit) == Verdict::fail) {
    accuse(*lower,
           note("path-latency-at-least", {{"latency", lower->value},
                                          {"spec", place(context, asked.line)},
                                          {"limit", Duration{limit}}}),
           unseen, judgement);
    return;
  }
  // Calculated expiries are as wrong as those of the callback itself.
  Duration release_error;
  bool is_certain = true;
  for (const auto first : chain.bounded_from) {
    const auto& callback = context.model.callbacks[at(first)];
    release_error = std::max(release_error, callback.release_error() + callback.release_spread());
    is_certain = is_certain && callback.are_releases_certain() && callback.with_doubtful_bound == 0;
  }
  const auto& upper = chain.max_path_latency_upper;
  const bool is_bounded = chain.without_upper_bound == 0 && upper && is_certain;
  const auto longest = is_bounded ? upper->value + release_error : Duration{};
  if (is_bounded && judge_largest(longest, error, limit) == Verdict::pass) return;
  auto bounded = is_bounded ? note("path-latency-up-to", {{"latency", longest},
                                                          {"spec", place(context, asked.line)},
                                                          {"limit", Duration{limit}}})
                            : Note{};
  judgement.unseen(
      without_event(moment(context.model.begin),
                    note("first-releases-inexact",
                         {{"instances", chain.inexact}, {"bounded", std::move(bounded)}})));
}

// Where chains lost something: callbacks by id, publishers that are not whole by topic.
class ChainLosses {
 public:
  explicit ChainLosses(const RuleContext& context) : context_(context) {
    const auto& model = context.model;
    for (std::size_t i = 0; i < context.callbacks.size(); ++i) {
      const auto& callback = model.callbacks[at(context.callbacks[i])];
      callbacks_[callback.logical_id].push_back(i);
      if (is_identified(callback)) continue;
      unknown_.try_emplace(callback.process, without_event(first_sign(model, callback),
                                                           note("perhaps-callback-of-chain")));
    }
    for (std::size_t i = 0; i < model.publishers.size(); ++i) {
      const auto& publisher = model.publishers[i];
      if (!context.proof.loss(publisher)) continue;
      if (publisher.registered) {
        of_topics_.try_emplace(publisher.topic, i);
      } else if (!of_unknown_topic_) {
        of_unknown_topic_ = i;
      }
    }
  }

  // Anywhere on the chain, or of callbacks that nothing of was seen.
  std::optional<Evidence> on(const SpecChain& asked) const {
    const auto& model = context_.model;
    const auto& proof = context_.proof;
    const std::set<std::string_view> hops(asked.callbacks.begin(), asked.callbacks.end());
    std::set<std::size_t> seen;
    bool is_any_unseen = false;
    for (const auto hop : hops) {
      const auto found = callbacks_.find(hop);
      if (found == callbacks_.end()) {
        is_any_unseen = true;
      } else {
        seen.insert(found->second.begin(), found->second.end());
      }
    }
    auto publisher = of_unknown_topic_;
    for (const auto position : seen) {
      const auto index = context_.callbacks[position];
      if (proof.loss(index)) return proof.loss(index);
      const auto& callback = model.callbacks[at(index)];
      if (auto unseen = proof.unseen_publishers(callback.process)) return unseen;
      if (callback.logical_id == asked.callbacks.front()) continue;
      if (auto unseen = unseen_writer(callback)) return unseen;
      const auto found = of_topics_.find(callback.source);  // of the messages that link the chain
      if (found != of_topics_.end())
        publisher = std::min(publisher.value_or(found->second), found->second);
    }
    if (publisher) return proof.loss(model.publishers[*publisher]);
    if (auto unknown = perhaps_unknown(hops)) return unknown;
    if (!is_any_unseen) return std::nullopt;
    for (std::size_t i = 0; i < model.processes.size(); ++i) {
      const auto index = ProcessIndex{static_cast<std::uint32_t>(i)};
      if (model.processes[i].has_cie_events && !proof.is_complete(index)) {
        return proof.incompleteness(index);
      }
    }
    return std::nullopt;
  }

 private:
  std::optional<Evidence> unseen_writer(const CallbackFacts& reader) const {
    const auto& writers = context_.model.unseen_writers;
    const auto found = writers.find(reader.source);
    if (found == writers.end()) return std::nullopt;
    return without_event(found->second, note("writer-not-recorded", {{"topic", reader.source}}));
  }
  // A callback of which no id was seen may be a hop that its process is not known to have.
  std::optional<Evidence> perhaps_unknown(const std::set<std::string_view>& hops) const {
    for (const auto& [process, unknown] : unknown_) {
      const auto is_known = [&, of = process](std::string_view hop) {
        const auto found = callbacks_.find(hop);
        return found != callbacks_.end() &&
               std::ranges::any_of(found->second, [&](std::size_t position) {
                 return context_.model.callbacks[at(context_.callbacks[position])].process == of;
               });
      };
      if (!std::ranges::all_of(hops, is_known)) return unknown;
    }
    return std::nullopt;
  }

  const RuleContext& context_;
  std::map<ProcessIndex, Evidence> unknown_;  // of processes, that a callback's id is
  std::map<std::string_view, std::vector<std::size_t>> callbacks_;  // in the context's order
  std::map<std::string_view, std::size_t> of_topics_;               // the first one
  std::optional<std::size_t> of_unknown_topic_;                     // likewise
};

// Until when all callbacks of the chain were there, as far as was seen. Empty: on clocks of several hosts.
std::optional<Timestamp> last_together(const RuleContext& context, const ChainFacts& chain) {
  const auto& model = context.model;
  std::optional<HostIndex> host;
  auto until = kLatest;
  for (const auto index : chain.last_callbacks) {
    const auto& callback = model.callbacks[at(index)];
    const auto of = model.processes[at(callback.process)].host;
    if (host.value_or(of) != of) return std::nullopt;
    host = of;
    until = std::min(until, context.lives.last_sign(callback.process));
    if (callback.fini) until = std::min(until, callback.fini->at.time);
  }
  return until;
}

// Since some time before the end no instance of the chain answered a read, though all of its callbacks were there.
void doubt_silence(const RuleContext& context, const SpecChain& asked, const ChainFacts& chain,
                   Judgement& judgement) {
  const auto until = last_together(context, chain);
  if (!chain.unanswered || !until) return;
  const auto& [reads, first, last] = *chain.unanswered;
  const auto waited = std::min(last, *until) - first;
  for (const auto& [name, limit] : {std::pair("reaction time", asked.reaction_time_ns),
                                    std::pair("data age", asked.data_age_ns)}) {
    if (!limit || waited.ns <= *limit) continue;
    judgement.unseen(
        without_event(moment(first), note("reads-unanswered", {{"reads", reads},
                                                               {"waited", waited},
                                                               {"spec", place(context, asked.line)},
                                                               {"limit", Duration{*limit}},
                                                               {"quantity", name}})));
  }
}

// What leaves open which messages led along the chain. `lost`: on it.
std::vector<Evidence> unseen_links(const std::optional<Evidence>& lost, const ChainFacts* chain) {
  auto unseen = listed({lost});
  if (chain != nullptr && chain->incomplete != 0) {
    unseen.push_back(without_event(chain->first_incomplete.value_or(EventRef{}),
                                   note("publish-unknown", {{"instances", chain->incomplete}})));
  }
  if (chain != nullptr && chain->unlinked != 0) {
    unseen.push_back(
        without_event(chain->first_unlinked.value_or(EventRef{}),
                      note("announced-too-late-to-link", {{"instances", chain->unlinked}})));
  }
  return unseen;
}

std::vector<SubjectVerdict> judge_chains(const RuleContext& context) {
  std::vector<SubjectVerdict> verdicts;
  if (context.options.spec == nullptr) return verdicts;
  const auto& model = context.model;
  const ChainLosses losses(context);
  std::map<std::string_view, ChainIndex> chains;
  for (std::size_t i = 0; i < model.chains.size(); ++i) {
    if (model.chains[i].specified)
      chains.try_emplace(model.chains[i].name, ChainIndex{static_cast<std::uint32_t>(i)});
  }
  for (const auto& asked : context.options.spec->chains()) {
    if (!asked.path_latency_ns && !asked.reaction_time_ns && !asked.data_age_ns) continue;
    const auto found = chains.find(asked.name);
    const auto* chain = found == chains.end() ? nullptr : &model.chains[at(found->second)];
    Judgement judgement(chain == nullptr ? NamedSubject::without_row(SubjectKind::chain, asked.name)
                                         : context.names.chain(found->second),
                        context.known);
    const auto unseen = unseen_links(losses.on(asked), chain);
    judgement.unseen(unseen);
    if (chain == nullptr || chain->instances == 0) {
      judgement.unseen(without_event(
          moment(model.end), note("chain-unlinked", {{"spec", place(context, asked.line)}})));
    }
    if (chain != nullptr) {
      const auto error = clock_error(model, *chain);
      for (const auto& bound :
           {Bound{"path latency", asked.path_latency_ns, false, chain->path_latency,
                  chain->max_path_latency},
            Bound{"reaction time", asked.reaction_time_ns, true, chain->reaction_time,
                  chain->max_reaction_time},
            Bound{"data age", asked.data_age_ns, true, chain->data_age, chain->max_data_age}}) {
        if (chain->instances > 0) judge_bound(context, asked, bound, error, unseen, judgement);
      }
      judge_unmeasured(context, asked, *chain, error, unseen, judgement);
      doubt_silence(context, asked, *chain, judgement);
      if (chain->unrelated > 0 && (asked.reaction_time_ns || asked.data_age_ns)) {
        judgement.unseen(
            without_event(chain->first_unrelated,
                          note("chain-on-unrelated-clocks", {{"instances", chain->unrelated}})));
      }
    }
    conclude(std::move(judgement), verdicts);
  }
  return verdicts;
}

}  // namespace

const Rule kNoQueueOverflow{
    .id = kNoQueueOverflowRule,
    .name = "no-queue-overflow",
    .meaning =
        "No sample was lost before a callback's queue, and no more were overwritten in it than "
        "overwrites_allowed says (0 by default).",
    .why_it_matters =
        "A lost sample is an input that the callback never sees, while everything else looks well.",
    .inconclusive_when =
        "the totals were not seen, as after a crash, when events of a process that had not ended "
        "were lost, or when nothing tells which part of the totals lies in the window.",
    .remedy =
        "a deeper queue, a faster callback, or overwrites_allowed where only the newest sample "
        "matters.",
    .violation = "lost messages",
    .judge = judge_queues};

const Rule kChainBounds{
    .id = "Q2",
    .name = "chain-bounds",
    .meaning =
        "Path latency, reaction time and data age of the chains in the spec stay within their "
        "bounds.",
    .why_it_matters =
        "What the vehicle does depends on the whole path from sensor to actuator: every callback "
        "can be in time and the path too late.",
    .inconclusive_when =
        "no instance of the chain could be linked (cie report --spec lists it with 0), nothing of "
        "what is bounded could be measured, the publish of a message on the chain was not seen, "
        "its publisher or a callback of the chain was announced more than 3 s later, a callback "
        "of it lost instances, before the end reads of its first callback had no answer for longer "
        "than the bound of reaction time or data age, or, for the path latency, the first release "
        "of an instance is not known exactly (later ones need not be) and what is known of it does "
        "not decide: it was not after the start, nor before the message's source timestamp or a "
        "timer's calculated expiry; between hosts also when what their clocks may differ by "
        "decides.",
    .remedy =
        "the hop table of cie report --spec shows which callback or message takes the time; where "
        "nothing could be linked, M1 says whether its callbacks exist.",
    .violation = "exceeded bounds",
    .judge = judge_chains,
    .needs = {.spec = true}};

}  // namespace cie::analysis
