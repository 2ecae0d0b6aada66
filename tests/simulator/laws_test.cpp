// The laws of rules.md over simulated recordings: what is lost, moved, split or added.
#include "support/laws.hpp"

#include "simulator/clean.hpp"
#include "simulator/mutants.hpp"
#include "simulator/random_system.hpp"
#include "simulator/thinning.hpp"
#include "simulator/transform.hpp"
#include "support/verdicts.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace cie::sim {
namespace {

using analysis::Verdict;

// Bounds that are kept exactly, or missed by little or by much.
void tighten(Spec& spec, Random& random) {
  const auto bound = [&random](std::optional<Ns>& value) {
    const auto how = random.between(0, 3);
    if (value && how == 1 && *value > 1) --*value;
    if (value && how == 2) *value = (*value + 1) / 2;
    if (how == 3) value.reset();
  };
  for (auto& entry : spec.callbacks) {
    bound(entry.response_deadline);
    bound(entry.wcet);
    bound(entry.max_inter_arrival);
    bound(entry.foreign_work_budget);
    if (entry.max_inter_arrival < entry.min_inter_arrival) entry.min_inter_arrival.reset();
  }
  for (auto& chain : spec.chains) {
    bound(chain.path_latency);
    bound(chain.reaction_time);
    bound(chain.data_age);
  }
}

std::vector<Mutant> rule_breakers() {
  std::vector<Mutant> all;
  for (auto& some : {mapping_mutants(), parameter_mutants(), execution_mutants(), timing_mutants()})
    all.insert(all.end(), some.begin(), some.end());
  return all;
}

Case mutant_case(const Mutant& mutant, std::uint64_t seed) {
  const auto system = mutant.system ? mutant.system() : base_system();
  auto c = mutant.is_clean ? clean_case(system, seed) : any_case(system, seed);
  mutant.change(c);
  return c;
}

// A random system, or a mutant, with a spec that it may or may not keep.
Case drawn_case(Random& random) {
  static const auto mutants = rule_breakers();
  if (random.one_in(2)) {
    const auto which = random.between(0, static_cast<Ns>(mutants.size()) - 1);
    const auto& mutant = mutants[static_cast<std::size_t>(which)];
    RC_LOG() << "mutant " << mutant.rule << ", " << mutant.name << '\n';
    return mutant_case(mutant, random.next() % 4);
  }
  auto c = any_case(system_of(*shapes()), random.next());
  tighten(c.spec, random);
  return c;
}

TEST(SimulatedLaws, ThinningMovesVerdictsOnlyTowardsInconclusive) {
  EXPECT_TRUE(rc::check("L1, L2, L5", [] {
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    const auto c = drawn_case(random);
    const auto spec = c.spec.text();
    const test::Verified full(c.trace, spec);
    const auto less = thinned(c.trace, random);
    const test::Verified reduced(less, spec);
    if (const auto lacking = test::unfounded(reduced); !lacking.empty()) RC_FAIL(lacking);
    const test::Deletion deletion{.before = c.trace, .after = less};
    const test::Verified user(test::without_kernel(c.trace), spec);
    if (const auto broken = test::broken_by(deletion, full, reduced, user); !broken.empty()) {
      RC_FAIL(broken);
    }
  }));
}

// The kernel's record, whole or with holes, on one time axis with the rest or not.
test::TextTrace with_any_kernel(const test::TextTrace& trace, Random& random) {
  auto both = random.one_in(5) ? trace : with_kernel_holes(trace, random);
  if (!random.one_in(8)) return both;
  const auto* uuid = random.one_in(2) ? "" : "another boot";
  for (auto& event : both.events) {
    auto* stream = std::get_if<analysis::StreamBegin>(&event.body);
    if (stream != nullptr && stream->domain == analysis::Domain::kernel) stream->clock_uuid = uuid;
  }
  return both;
}

TEST(SimulatedLaws, KernelEventsWithHolesOrWithoutNeverDecideLess) {
  EXPECT_TRUE(rc::check("L6", [] {
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    const auto c = drawn_case(random);
    const auto spec = c.spec.text();
    const auto both =
        with_any_kernel(random.one_in(3) ? thinned(c.trace, random) : c.trace, random);
    const test::Verified user(test::without_kernel(both), spec, c.options);
    const test::Verified verified(both, spec, c.options);
    if (const auto lacking = test::unfounded(verified); !lacking.empty()) RC_FAIL(lacking);
    if (const auto broken = test::broken_by_kernel(user, verified); !broken.empty()) {
      RC_FAIL(broken);
    }
  }));
}

// By callback, process and number.
using Measured = std::map<std::tuple<std::string, std::int64_t, std::uint64_t>, analysis::Instance>;

struct Instances final : analysis::Observer {
  Measured all;
  void on_instance(const analysis::Instance& instance) override {
    all.try_emplace({std::string(instance.logical_id), instance.pid, instance.seq}, instance);
  }
};

Measured measured(const test::TextTrace& trace) {
  Instances instances;
  test::analyze(trace, {}, &instances);
  return std::move(instances.all);
}

// What is measured beside holes is what is measured without them.
TEST(SimulatedLaws, HolesInTheKernelsRecordLeaveNoWrongNumber) {
  EXPECT_TRUE(rc::check("10b", [] {
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    const auto trace = simulate(system_of(*shapes())).tape.trace({});
    const auto whole = measured(trace);
    const auto some = measured(with_kernel_holes(trace, random, false));
    RC_ASSERT(some.size() == whole.size());
    for (const auto& [named, instance] : some) {
      const auto& key = named;  // clang captures no structured binding
      const auto& meant = whole.at(key);
      const auto expect_same = [&](const char* part, const auto& said, const auto& truth) {
        if (!said || said == truth) return;
        RC_FAIL(std::get<0>(key) + " seq " + std::to_string(std::get<2>(key)) + " (start " +
                std::to_string(meant.start.ns) + "): " + part + ' ' + std::to_string(said->ns) +
                ", not " + (truth ? std::to_string(truth->ns) : "unknown"));
      };
      expect_same("execution", instance.execution, meant.execution);
      expect_same("preempted", instance.preempted, meant.preempted);
      expect_same("blocked", instance.blocked, meant.blocked);
      expect_same("wake delay", instance.wake_delay, meant.wake_delay);
      expect_same("waking", instance.waking, meant.waking);
    }
  }));
}

// The same verdicts for the same reasons. (Events of one nanosecond in several streams have no
// order: whether a switch is one more that was checked after the read-back of its nanosecond.)
void expect_same(const test::Verified& one, const test::Verified& other) {
  for (const auto& rule : one.result.verdicts.rules) {
    const auto said = test::explain(one, rule.id);
    const auto says = test::explain(other, rule.id);
    if (said != says) RC_FAIL(said + "and\n" + says);
  }
}

// A random system says the same however it was recorded; `change` makes the recording another one.
template <typename Change>
bool says_the_same(const std::string& law, Change change) {
  return rc::check(law, [&change] {
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    const auto system = system_of(*shapes());
    const auto simulation = simulate(system);
    auto spec = spec_of(system, simulation.truth);
    tighten(spec, random);
    Recording recording;
    const test::Verified one(simulation.tape.trace(recording), spec.text());
    change(recording, random);
    const test::Verified other(simulation.tape.trace(recording), spec.text());
    expect_same(one, other);
  });
}

TEST(SimulatedLaws, TheOrderOfStreamsDoesNotMatter) {
  EXPECT_TRUE(says_the_same("L4, reordered", [](Recording& recording, Random& random) {
    recording.order = random.next();
  }));
}

TEST(SimulatedLaws, BuffersOfEachProcessSayTheSameAsSharedOnes) {
  EXPECT_TRUE(says_the_same("split by process", [](Recording& recording, Random& /*random*/) {
    recording.is_by_process = true;
  }));
}

std::vector<std::string> verdicts_of(const test::Verified& verified) {
  std::vector<std::string> all;
  for (const auto& rule : verified.result.verdicts.rules) {
    for (const auto& subject : rule.subjects) {
      all.push_back(rule.id + ' ' + subject.subject + ' ' + std::string(label(subject.verdict)) +
                    ' ' + std::to_string(subject.checked));
    }
  }
  return all;
}

TEST(SimulatedLaws, TimeMayBeShifted) {
  EXPECT_TRUE(rc::check("shifted", [] {
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    const auto c = drawn_case(random);
    const auto later = changed(c.trace, {.time = random.between(1, 1'000'000'000'000)});
    const test::Verified before(c.trace, c.spec.text());
    const test::Verified after(later, c.spec.text());
    RC_ASSERT(verdicts_of(before) == verdicts_of(after));
  }));
}

// Another process, on processors of its own, of which the spec says nothing.
TEST(SimulatedLaws, UnrelatedLoadChangesNoVerdict) {
  EXPECT_TRUE(rc::check("unrelated load", [] {
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    auto c = drawn_case(random);
    c.spec.threads.clear();  // the other process has a receive thread, too
    auto other_system = system_of(*calm_shapes());
    for (auto& callback : other_system.callbacks)
      callback.id = "/unrelated" + callback.id;
    const auto other = changed(simulate(other_system).tape.trace({}),
                               {.pid = 20'000, .cpu = 100, .writer = 100'000, .stream = 1'000});
    const test::Verified alone(c.trace, c.spec.text());
    const test::Verified unrelated(other);
    const test::Verified together(merged(c.trace, other), c.spec.text());
    for (const auto& rule : alone.result.verdicts.rules) {
      if (together[rule.id] == std::max(rule.verdict, unrelated[rule.id])) continue;
      RC_FAIL("alone:\n" + test::explain(alone, rule.id) + "unrelated:\n" +
              test::explain(unrelated, rule.id) + "together:\n" + test::explain(together, rule.id));
    }
  }));
}

}  // namespace
}  // namespace cie::sim
