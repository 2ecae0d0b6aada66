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

// The recording as one of ROS 2 would be: nobody announces threads or reads them back.
test::TextTrace unread(test::TextTrace trace) {
  trace.erase<analysis::ThreadInit>();
  trace.erase<analysis::ThreadSched>();
  trace.erase<analysis::ThreadFini>();
  trace.erase<analysis::RunBegin>();
  trace.erase<analysis::RunEnd>();
  for (auto& event : trace.events)
    event.head.is_derived = event.head.pid.has_value();  // all but streams' and the kernel's
  return trace;
}

TEST(Clean, SwitchesTellWhatNobodyReadBack) {
  EXPECT_TRUE(rc::check("without read-backs", [] {
    auto shape = *shapes();
    shape.pool = 0;
    const auto system = system_of(shape);
    const auto simulation = simulate(system);
    const auto trace = unread(simulation.tape.trace({}));
    for (const auto& entry : spec_of(system, simulation.truth).callbacks) {
      Spec spec{.callbacks = {{.id = entry.id, .parameters = entry.parameters}}};
      auto& asked = *spec.callbacks.front().parameters;
      const test::Verified right(trace, spec.text());
      // No switch tells a deadline triple.
      RC_ASSERT(right["S1"] ==
                (asked.policy == Policy::deadline ? Verdict::inconclusive : Verdict::pass));
      RC_ASSERT(right["S2"] != Verdict::fail);
      asked.policy = Policy::fifo;
      asked.priority = 77;  // nobody runs with it
      RC_ASSERT(test::Verified(trace, spec.text())["S1"] == Verdict::fail);
    }
  }));
}

}  // namespace
}  // namespace cie::sim
