// Verdicts that somebody knows and accepts, each for a reason and for a time: the file of
// `cie verify --suppressions`.
//
//   suppressions:
//     - rule: R2
//       subject: callback /lidar/*
//       reason: the driver's first period is long; fixed in release 4
//       expires: 2026-12-31
#pragma once

#include <cie/analysis/verdict.hpp>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::analysis {

using Date = std::chrono::year_month_day;

// "2026-12-31"; empty for anything else, days that no calendar has included.
std::optional<Date> parse_date(std::string_view text) noexcept;

// Immutable once read.
class Suppressions {
 public:
  // Throws SpecError, which names file, line and entry: every entry has a rule that exists (but not
  // T1: what cannot be read shows nothing), a subject, a reason, and a day that it expires after
  // or the word never.
  static Suppressions load(const std::filesystem::path& file);
  static Suppressions parse(std::string_view text, std::string_view name);

  // Marks every FAIL and INCONCLUSIVE that an entry names; of several entries the first that is not
  // expired counts. Verdicts of rules and subjects stay what they are; the overall verdict becomes
  // that of the rest. An entry holds up to the end of its last day. Entries of rules that
  // `verdicts` lacks are left out of its list of uses.
  void apply(VerdictReport& verdicts, Date today) const;

 private:
  struct Entry {
    Suppression suppression;
    std::optional<Date> last_day;  // empty: never expires
  };
  std::vector<Entry> entries_;
};

}  // namespace cie::analysis
