// Whoever keeps every rule, exactly, raises no alarm.
#include "simulator/clean.hpp"

#include "simulator/random_system.hpp"
#include "support/verdicts.hpp"

#include <string>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace cie::sim {
namespace {

using analysis::Verdict;

std::string alarms(const test::Verified& verified) {
  std::string text;
  for (const auto& rule : verified.result.verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      if (subject.verdict <= Verdict::pass) continue;
      text += rule.id + ' ' + subject.subject + ' ' + std::string(label(subject.verdict)) + '\n' +
              verified.evidence(rule.id, subject.subject);
    }
  }
  return text;
}

TEST(Clean, RaisesNoAlarm) {
  EXPECT_TRUE(rc::check("clean simulations", [] {
    const auto system = system_of(*calm_shapes());
    const auto simulation = simulate(system);
    RC_PRE(keeps_every_rule(system, simulation.truth));
    Recording recording;
    recording.is_by_process = *rc::gen::arbitrary<bool>();
    recording.order = *rc::gen::arbitrary<std::uint64_t>();
    const test::Verified verified(simulation.tape.trace(recording),
                                  spec_of(system, simulation.truth).text());
    if (const auto text = alarms(verified); !text.empty()) RC_FAIL(text);
    RC_ASSERT(verified.result.verdicts.verdict == Verdict::pass);
  }));
}

}  // namespace
}  // namespace cie::sim
