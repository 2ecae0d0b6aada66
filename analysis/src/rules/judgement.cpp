#include "judgement.hpp"

#include <cie/analysis/namespaced_pid.hpp>

#include "recorded_knowledge.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace cie::analysis {
namespace {

void append(std::vector<Evidence>& list, Evidence item) {
  const auto same = [&item](const Evidence& other) {
    return std::tie(item.event, item.time, item.note, item.tid, item.pid) ==
           std::tie(other.event, other.time, other.note, other.tid, other.pid);
  };
  if (list.size() >= Judgement::kMaxEvidence || std::ranges::any_of(list, same)) return;
  list.push_back(std::move(item));
}

}  // namespace

std::optional<Timestamp> time_of_evidence(Timestamp time) noexcept {
  return time == kEarliest || time == kBoot ? std::nullopt : std::optional(time);
}

Evidence evidence(std::string event, const EventRef& where, std::string note) {
  Evidence item{.event = std::move(event),
                .time = time_of_evidence(where.time),
                .cpu = where.cpu,
                .pid = where.pid ? std::optional(plain_pid(*where.pid)) : std::nullopt,
                .tid = where.tid,
                .note = std::move(note)};
  if (where.stream != kNoStream) item.stream = static_cast<std::uint32_t>(where.stream);
  return item;
}

Evidence untold_end(const CallbackFacts& callback, const OpenInstance& left) {
  const auto* const by =
      callback.kind == CallbackKind::service
          ? " starts and ends untold, as what its thread did next shows: by an exception, or its "
            "response is sent later"
          : " starts and an exception ends it, as what its thread did next shows; no event tells "
            "when";
  return evidence("callback_start", left.start, "seq " + std::to_string(left.seq) + by);
}

Judgement::Judgement(NamedSubject subject, const RecordedKnowledge& known)
    : Claims(known.knowledge()), subject_(std::move(subject)), known_(&known) {}

void Judgement::fail(Evidence witness) { append(witnesses_, std::move(witness)); }

void Judgement::doubt(Evidence reason) { append(doubts_, std::move(reason)); }

void Judgement::doubt(const std::optional<Evidence>& reason) {
  if (reason) doubt(*reason);
}

void Judgement::overrule(Evidence reason) { append(overruling_, std::move(reason)); }

void Judgement::overrule(const std::optional<Evidence>& reason) {
  if (reason) overrule(*reason);
}

void Judgement::remark(Evidence note) { append(remarks_, std::move(note)); }

std::optional<SubjectVerdict> Judgement::finish() && {
  const bool is_proven = Claims::verdict() == Verdict::fail;
  for (const auto& reason : reasons())
    append(doubts_, known_->evidence_of(reason));
  for (const auto& shown : Claims::witnesses()) {
    for (const auto& item : shown)
      append(is_proven ? witnesses_ : doubts_, item);
  }
  SubjectVerdict verdict{.about = subject_.about,
                         .subject = std::move(subject_.name) + subject_.place,
                         .place = std::move(subject_.place),
                         .checked = count(),
                         .evidence = {},
                         .ordinal = std::move(subject_.ordinal)};
  if (!overruling_.empty()) {
    verdict.verdict = Verdict::inconclusive;
    verdict.evidence = std::move(overruling_);
    std::ranges::move(witnesses_, std::back_inserter(verdict.evidence));
  } else if (!witnesses_.empty()) {
    verdict.verdict = Verdict::fail;
    verdict.checked = std::max<std::uint64_t>(count(), 1);
    verdict.evidence = std::move(witnesses_);
  } else if (!doubts_.empty()) {
    verdict.verdict = Verdict::inconclusive;
    verdict.evidence = std::move(doubts_);
  } else if (count() != 0) {
    verdict.verdict = Verdict::pass;
    verdict.evidence = std::move(remarks_);
  } else {
    return std::nullopt;
  }
  return verdict;
}

void conclude(Judgement&& judgement, std::vector<SubjectVerdict>& verdicts) {
  if (auto verdict = std::move(judgement).finish()) verdicts.push_back(*std::move(verdict));
}

}  // namespace cie::analysis
