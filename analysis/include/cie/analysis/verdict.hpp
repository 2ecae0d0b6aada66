// What the verifier says: one verdict per rule and subject, with the evidence for it.
#pragma once

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

// One event (or gap) that a verdict rests on. `note` says in words what it shows.
struct Evidence {
  std::string event;  // "callback_start"; for inconclusive verdicts the kind of what is missing
  Timestamp time;
  std::optional<std::int32_t> cpu;
  std::optional<std::int64_t> pid;
  std::optional<std::int64_t> tid;
  std::string note;
};

struct SubjectVerdict {
  std::string subject;  // "callback ID", "thread TID", …, with " (pid N)" if there are several
  Verdict verdict = Verdict::not_applicable;
  std::uint64_t checked = 0;  // instances or events judged; at least 1 for pass and fail
  std::vector<Evidence> evidence;
};

struct RuleVerdict {
  std::string id;    // "M2"
  std::string name;  // "one-callback-per-thread"
  Verdict verdict = Verdict::not_applicable;
  std::vector<SubjectVerdict> subjects;  // sorted by subject, numbers by value
};

struct VerdictReport {
  Verdict verdict = Verdict::not_applicable;  // overall; pass when nothing is worse
  std::vector<RuleVerdict> rules;             // every rule, in the order of the contract
};

}  // namespace cie::analysis
