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

Evidence evidence(std::string event, const EventRef& where, Note note) {
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
  return evidence("callback_start", left.start,
                  note(callback.kind == CallbackKind::service ? "service-end-untold" : "end-untold",
                       {{"seq", left.seq}}));
}

Judgement::Judgement(NamedSubject subject, const RecordedKnowledge& known)
    : Claims(known.knowledge()), subject_(std::move(subject)), known_(&known) {}

void Judgement::unseen(Evidence what) { append(unseen_, std::move(what)); }

void Judgement::unseen(const std::optional<Evidence>& what) {
  if (what) unseen(*what);
}

void Judgement::unseen(const std::vector<Evidence>& each) {
  for (const auto& what : each)
    unseen(what);
}

void Judgement::violation_unless(const std::vector<Evidence>& is_unseen,
                                 std::vector<Evidence> witness,
                                 std::span<const Conjunction> excuses) {
  if (is_unseen.empty()) {
    violation(std::move(witness), excuses);
    return;
  }
  unseen(is_unseen);
  unseen(witness);
}

void Judgement::remark(Evidence note) { append(remarks_, std::move(note)); }

std::optional<SubjectVerdict> Judgement::finish() && {
  SubjectVerdict judged{.about = subject_.about,
                        .subject = std::move(subject_.name) + subject_.place,
                        .place = std::move(subject_.place),
                        .verdict = verdict(),
                        .checked = count(),
                        .evidence = {},
                        .ordinal = std::move(subject_.ordinal)};
  if (judged.verdict != Verdict::fail && !unseen_.empty()) judged.verdict = Verdict::inconclusive;
  if (judged.verdict == Verdict::not_applicable) return std::nullopt;
  auto& evidence = judged.evidence;
  if (judged.verdict == Verdict::pass) {
    evidence = std::move(remarks_);
    return judged;
  }
  if (judged.verdict == Verdict::inconclusive) {
    evidence = std::move(unseen_);
    for (const auto& reason : reasons())
      append(evidence, known_->evidence_of(reason));
  }
  for (const auto& witness : witnesses())
    for (const auto& item : witness)
      append(evidence, item);
  if (judged.verdict == Verdict::fail) judged.checked = std::max<std::uint64_t>(judged.checked, 1);
  return judged;
}

std::vector<Evidence> listed(std::initializer_list<std::optional<Evidence>> all) {
  std::vector<Evidence> found;
  for (const auto& item : all)
    if (item) found.push_back(*item);
  return found;
}

void conclude(Judgement&& judgement, std::vector<SubjectVerdict>& verdicts) {
  if (auto verdict = std::move(judgement).finish()) verdicts.push_back(*std::move(verdict));
}

}  // namespace cie::analysis
