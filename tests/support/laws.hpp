// The laws that rules.md puts on every verdict, as tests ask for them. Each answers in words what
// is broken, or with nothing.
#pragma once

#include "support/trace_text.hpp"
#include "support/verdicts.hpp"

#include <string>

namespace cie::test {

// L1: fails and doubts have evidence, passes and fails have something checked, a rule's verdict is
// its worst subject's.
std::string unfounded(const Verified& verified);

// Part of the recording rather than of what it tells: a stream or packet begins, a loss.
bool is_structural(const analysis::Event& event);

struct Deletion {
  const TextTrace& before;
  const TextTrace& after;
  bool has_crashed = false;  // the process, without any deletion
};
// L2: with events deleted no pass becomes a fail, and no fail a pass.
std::string broken_by(const Deletion& deletion, const Verified& full, const Verified& reduced);

// Subjects of a rule with their verdicts and evidence.
std::string explain(const Verified& verified, const std::string& rule);
// The same of all rules.
std::string explain(const Verified& verified);

}  // namespace cie::test
