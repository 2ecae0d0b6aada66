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
// L2: with events deleted no pass becomes a fail, and no fail a pass. A fail that only the kernel's
// events show is, without them, what the user's (`user`: of the full recording) say.
std::string broken_by(const Deletion& deletion, const Verified& full, const Verified& reduced,
                      const Verified& user);

// The same recording without the kernel's streams.
TextTrace without_kernel(const TextTrace& trace);
// L6: what the user's events decide (`user`) stays decided with the kernel's, with holes or without
// (`both`), and the kernel's show no less than a violation where there was one.
std::string broken_by_kernel(const Verified& user, const Verified& both);

// Subjects of a rule with their verdicts and evidence.
std::string explain(const Verified& verified, const std::string& rule);
// The same of all rules.
std::string explain(const Verified& verified);

}  // namespace cie::test
