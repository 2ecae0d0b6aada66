// Every number that the analysis derives equals what the simulator knows, with 0 ns of error.
#include "simulator/application.hpp"
#include "simulator/expected.hpp"
#include "simulator/random_system.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace cie::sim {
namespace {

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(lines.size(), 12); ++i)
    text += lines[i] + '\n';
  return text;
}

void expect_no_difference(const System& system, const Simulation& simulation,
                          const Recording& recording) {
  Observed observed;
  analyze(simulation.tape.trace(recording), {}, observed);
  const auto found = differences(system, simulation, recording, observed);
  if (!found.empty()) RC_FAIL(joined(found));
}

rc::Gen<bool> mostly() { return rc::gen::weightedElement<bool>({{1, false}, {7, true}}); }

TEST(Truth, EveryNumberOfAWholeRecordingIsExact) {
  const auto is_exact = [] {
    const auto system = system_of(*shapes());
    Recording recording;
    recording.has_kernel = *mostly();
    recording.has_wakings = *mostly();
    recording.is_by_process = *rc::gen::arbitrary<bool>();
    recording.order = *rc::gen::arbitrary<std::uint64_t>();
    expect_no_difference(system, simulate(system), recording);
  };
  EXPECT_TRUE(rc::check("whole recordings", is_exact));
}

// A recording that begins while the processes run, and ends before they do.
TEST(Truth, EveryNumberOfAnAttachedRecordingIsExact) {
  const auto is_exact = [] {
    auto shape = *shapes();
    shape.is_vague = false;  // bounds need a clock_sync before
    auto system = system_of(shape);
    const auto time = [&](Ns least, Ns most) {
      return kBeginning + least + *rc::gen::inRange<Ns>(0, most - least);
    };
    Recording recording;
    const auto half = system.duration / 2;
    for (int cpu = 0; cpu < system.cpus; ++cpu) {
      recording.user_begin.push_back(time(1'000'000, half));
      recording.user_end.push_back(time(half, system.duration));
    }
    recording.has_kernel = *mostly();
    recording.kernel_begin = time(1'000'000, half);
    recording.kernel_end = time(half, system.duration);
    system.attach = std::ranges::max(recording.user_begin) - kBeginning;
    const auto simulation = simulate(system);
    const auto& announced = simulation.truth.announced;
    // On a busy machine that may come too late: then nobody knows whose instances these are.
    RC_PRE(announced.size() == simulation.truth.pids.size() &&
           std::ranges::max(announced) < std::ranges::min(recording.user_end));
    // A kernel that tells of no switch has measured nothing.
    RC_PRE(!recording.has_kernel ||
           std::ranges::any_of(simulation.tape.trace(recording).events, [](const auto& event) {
             return std::holds_alternative<analysis::SchedSwitch>(event.body);
           }));
    expect_no_difference(system, simulation, recording);
  };
  EXPECT_TRUE(rc::check("attached recordings", is_exact));
}

// Günzel, Teper et al. (ECRTS 2023): the maximum reaction time equals the maximum data age, once
// the first chain has begun. Reads that led nowhere cannot make it larger: an earlier one that led
// somewhere waited longer.
TEST(Truth, MaximumReactionTimeEqualsMaximumDataAge) {
  const auto is_equal = [] {
    const auto system = system_of(*shapes());
    for (const auto& chain : chains_of(system, simulate(system).truth)) {
      if (chain.is_overtaken) continue;  // the theorem is about chains in which nothing overtakes
      const auto& runs = chain.runs;
      const auto reactions = chain.reaction_times();
      if (reactions.empty()) continue;
      // What the last read that has an answer led to: ages after it have no answer yet.
      Ns last_answered = 0;
      for (const auto& run : runs) {
        if (run.read < runs.back().read) last_answered = std::max(last_answered, run.read);
      }
      Ns age = 0;
      for (std::size_t i = 1; i < runs.size(); ++i) {
        if (runs[i - 1].read <= last_answered) {
          age = std::max(age, runs[i].write - runs[i - 1].read);
        }
      }
      RC_ASSERT(std::ranges::max(reactions) == age);
    }
  };
  EXPECT_TRUE(rc::check("MRT = MDA", is_equal));
}

// The systems above are worth simulating only if such things happen in them.
TEST(Truth, SystemsAreEventful) {
  std::size_t preempted = 0;
  std::size_t blocked = 0;
  std::size_t missed = 0;
  std::size_t linked = 0;
  std::size_t longest = 0;
  std::uint64_t overwritten = 0;
  std::uint64_t inherited = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const auto system = system_of({.cpus = 2,
                                   .timers = 2,
                                   .subscriptions = 4,
                                   .loads = 2,
                                   .mutexes = 2,
                                   .utilization = 110,
                                   .seed = seed});
    const auto truth = simulate(system).truth;
    for (const auto& instance : truth.instances) {
      if (instance.parts.preempted > 0) ++preempted;
      if (instance.parts.blocked > 0) ++blocked;
      if (instance.missed > 0) ++missed;
      if (instance.message) ++linked;
    }
    for (const auto& chain : chains_of(system, truth))
      longest = std::max(longest, chain.hops.size());
    for (const auto samples : truth.overwritten)
      overwritten += samples;
    inherited += truth.inherited;
  }
  EXPECT_GT(preempted, 1'000);
  EXPECT_GT(blocked, 1'000);
  EXPECT_GT(missed, 100);
  EXPECT_GT(linked, 1'000);
  EXPECT_GE(longest, 4);
  EXPECT_GT(overwritten, 100);
  EXPECT_GT(inherited, 100);
}

}  // namespace
}  // namespace cie::sim
