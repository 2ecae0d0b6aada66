// What leaves any rule undecided, whatever it judges.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "rule.hpp"
#include "rule_context.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cie::analysis {

// Where two processes are seen to have one pid: the last of them, or none. By pid, those that had it
// before or after among them, and of any.
struct SharedPids {
  std::map<std::pair<HostIndex, std::int64_t>, Evidence> by_pid;
  std::optional<Evidence> any;
};

// Of what manifests say was recorded, or was not: why nobody knows what a rule would say of the rest.
struct MissingParts {
  std::optional<std::string> of_user;
  std::optional<std::string> of_kernel;
  std::optional<std::string>
      of_recorder;  // what it did not write is no fault of the traces that are here

  const std::optional<std::string>& for_rule(const Rule& rule) const {
    if (of_user) return of_user;
    if (of_recorder && !rule.needs.is_about_trace) return of_recorder;
    return rule.needs.kernel ? of_kernel : of_user;
  }
};

// The context must outlive it.
class SharedDoubts {
 public:
  explicit SharedDoubts(const RuleContext& context);

  // Of what the rule said of its subjects.
  void apply(const Rule& rule, std::vector<SubjectVerdict>& subjects) const;

 private:
  const RuleContext& context_;
  MissingParts missing_;
  SharedPids shared_;
  std::map<HostIndex, Evidence> clocks_apart_;
};

}  // namespace cie::analysis
