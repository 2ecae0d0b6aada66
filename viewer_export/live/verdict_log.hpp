// Which verdicts became others between two looks at a running system.
#pragma once

#include <cie/analysis/time.hpp>
#include <cie/analysis/verdict.hpp>

#include "snapshot.hpp"

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

namespace cie::live {

// A rule and a subject of it; the subject's name where it has no row, because others' names change
// when a second process appears.
using VerdictKey =
    std::tuple<std::string, analysis::SubjectKind, std::optional<std::uint32_t>, std::string>;
VerdictKey verdict_key(const std::string& rule, const analysis::Subject& about,
                       const std::string& subject);

class VerdictLog {
 public:
  // Violations and what is undecided, and what became, or ceased to be, a violation since the call
  // before. Verdicts that were never other than undecided are no change: a system that was just
  // attached to is undecided in much.
  struct Noted {
    std::vector<RuleViolations> violations;  // all of them, the gravest rule first
    std::vector<VerdictView> current;        // violations first
    std::uint64_t left_out = 0;              // beyond kMaxListed
    std::vector<VerdictChange> changes;
  };
  static constexpr std::size_t kMaxListed = 200;

  // What is said of a violating subject beside its name; empty: what its evidence says.
  using Telling = std::function<std::string(const analysis::RuleVerdict& rule,
                                            const analysis::SubjectVerdict& subject)>;

  Noted note(const analysis::VerdictReport& verdicts, analysis::Timestamp now,
             const Telling& tell = {});

 private:
  struct Known {
    analysis::Verdict verdict = analysis::Verdict::not_applicable;
    std::int64_t since_ns = 0;
    std::uint64_t round = 0;
  };
  std::map<VerdictKey, Known> known_;
  std::uint64_t round_ = 0;
};

}  // namespace cie::live
