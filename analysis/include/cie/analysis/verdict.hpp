// What the verifier says: one verdict per rule and subject, with the evidence for it.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/note.hpp>
#include <cie/analysis/time.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

// Ordered by weight: an overall verdict is the largest, not_applicable counting as pass.
enum class Verdict : std::uint8_t { not_applicable, pass, inconclusive, fail };
// "PASS", "FAIL", "INCONCLUSIVE", "NOT_APPLICABLE".
std::string_view label(Verdict verdict) noexcept;

// One event (or gap) that a verdict rests on, and what it shows.
struct Evidence {
  std::string event;  // "callback_start"; for inconclusive verdicts the kind of what is missing
  std::optional<Timestamp> time;  // empty: not known
  std::optional<std::int32_t> cpu;
  std::optional<std::int64_t> pid;
  std::optional<std::int64_t> tid;
  Note note;
  // Where the event stands: the stream's number in the reader, its file (analyze(): below the
  // trace), and which of its packets, from 0. Empty for what no event marks.
  std::optional<std::uint32_t> stream{};
  std::string file{};
  std::optional<std::uint64_t> packet{};
  // Events of applications that the tracer lost, or that cannot be read; not part of the JSON.
  bool is_user_loss = false;
};

// What a verdict is about, as the report's rows are known.
enum class SubjectKind : std::uint8_t { trace, process, thread, callback, group, topic, chain };
std::string_view label(SubjectKind kind) noexcept;

struct Subject {
  SubjectKind kind = SubjectKind::trace;
  // Of its kind: ProcessIndex, ThreadIndex, CallbackIndex, ChainIndex, …. Empty: the trace as a
  // whole, and what has no row: named by the spec alone, or never announced.
  std::optional<std::uint32_t> index{};
  std::optional<ProcessIndex> process{};  // whose it is; empty: of none, or of several

  template <typename Index>
  static Subject of(SubjectKind kind, Index index, std::optional<ProcessIndex> process) noexcept {
    return {.kind = kind, .index = static_cast<std::uint32_t>(index), .process = process};
  }
  friend bool operator==(const Subject&, const Subject&) = default;
};

// A violation, or something undecided, that somebody knows and accepts: see suppressions.hpp.
struct Suppression {
  std::string rule;     // "R2"
  std::string subject;  // a subject as verdicts name it; "*" stands for any text
  std::string reason;
  std::string expires;      // "2026-12-31", its last day, or "never"
  std::string place;        // where it was written: "accepted.yaml:3"
  bool is_expired = false;  // as of the day of the verdict: it is told and does not count
};

struct SubjectVerdict {
  Subject about{};
  std::string subject;  // its name: "callback ID", "thread TID", …, and behind it `place`
  std::string place{};  // " (pid N)" where the recording holds several processes
  Verdict verdict = Verdict::not_applicable;
  std::uint64_t checked = 0;  // instances or events judged; at least 1 for pass and fail
  std::vector<Evidence> evidence;
  std::optional<Suppression> suppression{};  // of a FAIL or INCONCLUSIVE
  // " (lifetime 2)" of the second thread of a process that had its tid and of the second callback
  // that had its logical id, " (publisher 2)" of the second one of a topic; empty: it is the first.
  std::string ordinal{};

  // The name without the place, which nobody can foresee.
  std::string_view name() const noexcept {
    return std::string_view(subject).substr(0, subject.size() - place.size());
  }

  // The same with what tells it from others of that name, the place last.
  std::string name_told_apart() const { return std::string(name()) + ordinal + place; }

  bool is_suppressed() const noexcept { return suppression && !suppression->is_expired; }
};

struct RuleVerdict {
  std::string id;    // "M2"
  std::string name;  // "one-callback-per-thread"
  Verdict verdict = Verdict::not_applicable;
  std::vector<SubjectVerdict> subjects;  // sorted by subject, numbers by value
};

// A suppression and how many verdicts it names; 0: it is not needed.
struct SuppressionUse {
  Suppression suppression;
  std::uint64_t matched = 0;
  std::uint64_t counting = 0;  // those of them that no entry suppresses; not part of the JSON
};

// What `--suppressions` asked for.
struct SuppressionReport {
  std::string date;                  // that expiry was judged by, "2026-11-20"
  std::vector<SuppressionUse> uses;  // in the order of the file
};

struct VerdictReport {
  Verdict verdict = Verdict::not_applicable;        // overall, of what is not suppressed
  std::vector<RuleVerdict> rules;                   // every rule, in the order of the contract
  std::optional<SuppressionReport> suppressions{};  // empty: none were asked for
  std::optional<TimeWindow> window{};  // what of the recording was judged; empty: all of it
};

// The worst verdict of a rule's subjects that are not suppressed. Its own verdict, which is that of
// all its subjects, where it has none.
Verdict counted_verdict(const RuleVerdict& rule) noexcept;
// The overall verdict that the rules' counted verdicts give: pass when nothing is worse. Where no rule
// applies nothing was judged: inconclusive.
Verdict overall_verdict(const VerdictReport& verdicts) noexcept;

}  // namespace cie::analysis
