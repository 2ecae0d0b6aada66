// Which event shows that a thread was there.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "rule_context.hpp"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace cie::analysis {

// Sorts what a thread ran when it is asked about first. The context must outlive it.
class SignsOfLife {
 public:
  explicit SignsOfLife(const RuleContext& context) : context_(context) {}

  // The first event that is kept of it at that time or later.
  std::optional<Evidence> since(ThreadIndex thread, Timestamp time);
  // Of all.
  Evidence first(ThreadIndex thread) const;

 private:
  struct Sign {
    EventRef at{};
    const CallbackOnThread* of = nullptr;
    bool is_first = false;  // of that callback there
  };
  const std::vector<Sign>& of_callbacks(ThreadIndex thread);
  Evidence evidence_of(const Sign& sign, const std::string& name) const;

  const RuleContext& context_;
  std::map<ThreadIndex, std::vector<Sign>> of_callbacks_;  // by time
};

}  // namespace cie::analysis
