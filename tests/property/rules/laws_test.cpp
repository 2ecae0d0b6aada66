// The laws that rules.md puts on every rule, over small random runs with random faults.
#include "support/laws.hpp"

#include "support/verdicts.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace cie::test {
namespace {

using analysis::Event;

enum class Fault : std::uint8_t {
  none,
  on_foreign_thread,
  missed_period,
  never_ends,
  ends_twice,
  parameters_change,
  parameters_reloaded,
  wrong_cpu,
  thread_replaced,
  sample_lost,
  released_early,
  runs_long,
};
constexpr int kFaults = 12;

struct Step {
  int callback = 0;
  int idle = 0;
  int latency = 0;
  int duration = 0;
  Fault fault = Fault::none;
};

struct Scenario {
  int callbacks = 1;
  bool is_pool = false;
  bool is_kernel = false;
  bool has_crashed = false;
  bool is_attached = false;
  int deadline = 20;
  bool has_ghost = false;
  bool is_begun_by_spec = false;    // the process's run_begin names the spec
  bool is_configured_late = false;  // threads run as specified only after a reload
  std::vector<Step> steps;
};

void showValue(const Scenario& scenario, std::ostream& out);

std::string name_of(int callback) { return "c" + std::to_string(callback); }

// With kernel events each callback has a CPU and a thread of its own, so that switches are
// coherent.
bool has_switches(const Scenario& scenario) {
  return scenario.is_kernel && !scenario.is_pool && scenario.callbacks <= 2;
}

std::string spec_of(const Scenario& scenario);

std::string text_of(const Scenario& scenario) {
  const bool is_kernel = has_switches(scenario);
  std::ostringstream out;
  out << "process app" << (scenario.has_crashed ? " crash" : "");
  if (scenario.is_begun_by_spec) {
    out << " spec=" << SchedulingSpec::parse(spec_of(scenario), "").sha256();
  }
  out << (scenario.is_attached ? " attached" : "") << "\npublisher out topic=/out\n";
  for (int i = 0; i < scenario.callbacks; ++i) {
    out << "callback " << name_of(i)
        << (i % 2 == 0 ? " timer period=10" : " subscription topic=/out")
        << (scenario.is_pool ? " pooled" : "") << " cpu=" << (is_kernel ? i : 0)
        << (scenario.is_attached ? " next=" + std::to_string(i) : std::string()) << '\n';
    if (scenario.is_pool) out << "thread t" << i << " pool\n";
  }
  std::map<int, std::int64_t> now;
  std::map<int, std::string> thread_of;
  std::map<std::string, int> changes;  // of parameters, by thread
  std::map<std::string, int> nice;
  int threads = 0;
  std::vector<std::int64_t> published;  // times, by seq
  for (int i = 0; i < scenario.callbacks; ++i) {
    thread_of[i] = scenario.is_pool ? "t" + std::to_string(i) : name_of(i);
    now[i] = 100 + i;
    if (scenario.is_configured_late && !scenario.is_pool && !scenario.is_attached) {
      out << "-100 initial " << name_of(i) << "\n-90 applied " << name_of(i) << " nice=5\n";
      nice[name_of(i)] = 5;
    }
  }
  const bool has_replacement = std::ranges::find(scenario.steps, Fault::thread_replaced,
                                                 &Step::fault) != scenario.steps.end();
  for (const auto& step : scenario.steps) {
    const int c = step.callback % scenario.callbacks;
    const auto name = name_of(c);
    auto& time = now[c];
    time += step.idle;
    auto thread = thread_of[c];
    const bool is_elsewhere =
        step.fault == Fault::on_foreign_thread || step.fault == Fault::thread_replaced;
    const auto fault = is_kernel && is_elsewhere ? Fault::none : step.fault;
    // Threads that are replaced run nothing else, so that nobody runs on one that is gone.
    if (fault == Fault::on_foreign_thread && !has_replacement)
      thread = thread_of[(c + 1) % scenario.callbacks];
    if (fault == Fault::thread_replaced && !scenario.is_attached) {
      out << time << " finish " << thread << '\n';
      thread = "r" + std::to_string(threads++);
      out << "thread " << thread << (scenario.is_pool ? " pool" : " callback of=" + name) << '\n';
      out << ++time << " begin " << thread << '\n';
      out << ++time << " initial " << thread << '\n';
      if (!scenario.is_pool) out << ++time << " applied " << thread << '\n';
      thread_of[c] = thread;
      ++time;
    }
    if (fault == Fault::parameters_change) {
      out << time++ << " audit " << thread << " policy=other nice=7 change=" << changes[thread]
          << '\n';
    }
    // An interrupted process has no totals: the last `applied` that was seen counts as the last.
    if (fault == Fault::parameters_reloaded && !scenario.has_crashed) {
      const auto change = " change=" + std::to_string(++changes[thread]);
      out << time++ << " audit " << thread << " nice=" << nice[thread] << change << '\n';
      nice[thread] = 5 - nice[thread];  // 5 and 0 in turn
      out << time + step.latency << " applied " << thread << " nice=" << nice[thread] << change
          << '\n';
    }
    if (fault == Fault::sample_lost) out << time << " lost " << name << '\n';
    if (c % 2 == 1) out << time << " release " << name << '\n';
    const auto release = time - (fault == Fault::released_early ? 15 : 0);
    time += 1 + step.latency;
    if (is_kernel) out << time++ << " switch " << c << " idle " << thread << '\n';
    out << time << " start " << name << " on=" << thread
        << " release=" << std::max<std::int64_t>(release, 0);
    if (fault == Fault::missed_period) out << " missed=1";
    if (fault == Fault::wrong_cpu) out << " cpu=3";
    const auto taken = std::ranges::lower_bound(published, release) - published.begin() - 1;
    if (c == 1 && taken >= 0) out << " from=out:" << taken;
    out << '\n';
    time += step.duration + 1 + (fault == Fault::runs_long ? 40 : 0);
    if (c == 0) {
      published.push_back(time);
      out << time++ << " publish out on=" << thread << '\n';
    }
    if (fault != Fault::never_ends) out << time++ << " end " << name << " on=" << thread << '\n';
    if (is_kernel) out << time++ << " switch " << c << ' ' << thread << " idle state=1\n";
    if (fault == Fault::ends_twice) out << time++ << " end " << name << " on=" << thread << '\n';
  }
  return out.str();
}

std::string spec_of(const Scenario& scenario) {
  std::ostringstream out;
  out << "callback_groups:\n";
  for (int i = 0; i < scenario.callbacks; ++i) {
    out << "  - id: " << name_of(i)
        << "\n    policy: SCHED_OTHER\n    response_deadline: " << scenario.deadline
        << "\n    wcet: " << scenario.deadline
        << "\n    min_inter_arrival: " << scenario.deadline / 2
        << "\n    max_inter_arrival: " << 3 * scenario.deadline << '\n';
  }
  if (scenario.has_ghost) out << "  - id: ghost\n";
  if (scenario.callbacks > 1) {
    out << "chains:\n  - name: chain\n    callbacks: [c0, c1]\n    path_latency: "
        << 2 * scenario.deadline << "\n    data_age: " << 4 * scenario.deadline << '\n';
  }
  return out.str();
}

void showValue(const Scenario& scenario, std::ostream& out) {
  out << text_of(scenario) << "---\n" << spec_of(scenario);
}

rc::Gen<Step> steps() {
  return rc::gen::build<Step>(
      rc::gen::set(&Step::callback, rc::gen::inRange(0, 3)),
      rc::gen::set(&Step::idle, rc::gen::inRange(1, 20)),
      rc::gen::set(&Step::latency, rc::gen::inRange(0, 4)),
      rc::gen::set(&Step::duration, rc::gen::inRange(0, 12)),
      rc::gen::set(&Step::fault,
                   rc::gen::map(rc::gen::inRange(-2 * kFaults, kFaults), [](int number) {
                     return number < 0 ? Fault::none : static_cast<Fault>(number);
                   })));
}

rc::Gen<Scenario> scenarios() {
  return rc::gen::build<Scenario>(
      rc::gen::set(&Scenario::callbacks, rc::gen::inRange(1, 4)), rc::gen::set(&Scenario::is_pool),
      rc::gen::set(&Scenario::has_crashed,
                   rc::gen::map(rc::gen::inRange(0, 4), [](int n) { return n == 3; })),
      rc::gen::set(&Scenario::is_attached,
                   rc::gen::map(rc::gen::inRange(0, 4), [](int n) { return n == 3; })),
      rc::gen::set(&Scenario::deadline, rc::gen::inRange(6, 40)),
      rc::gen::set(&Scenario::has_ghost), rc::gen::set(&Scenario::is_begun_by_spec),
      rc::gen::set(&Scenario::is_configured_late),
      rc::gen::set(&Scenario::steps, rc::gen::container<std::vector<Step>>(steps())));
}

std::string events_text(const TextTrace& trace) {
  std::string text;
  for (const auto& event : trace.events)
    text += std::to_string(event.head.time.ns) + ':' + std::to_string(event.body.index()) + ' ';
  return text;
}

// Removes some events: single ones, all of one kind, or a stretch of time.
// Attached processes keep their state events: numbers of read-backs before the attachment prove
// nothing about the first one after it.
TextTrace thinned(const TextTrace& trace, bool keeps_state = false) {
  TextTrace less = trace;
  const auto total = trace.events.size();
  const auto way = *rc::gen::inRange(0, 4).as("way of deleting");
  std::set<std::size_t> victims;
  if (way <= 1) {
    const auto chosen =
        *rc::gen::container<std::vector<std::size_t>>(rc::gen::inRange<std::size_t>(0, total))
             .as("deleted events");
    victims.insert(chosen.begin(), chosen.end());
  } else if (way == 2) {
    const auto kind = *rc::gen::inRange<std::size_t>(7, 26).as("deleted kind");
    const auto every = *rc::gen::inRange<std::size_t>(1, 4).as("every");
    for (std::size_t i = 0; i < total; i += 1) {
      if (trace.events[i].body.index() == kind && i % every == 0) victims.insert(i);
    }
  } else {
    const auto from = *rc::gen::inRange<std::size_t>(0, total).as("deleted from");
    const auto count = *rc::gen::inRange<std::size_t>(0, total / 2 + 1).as("count");
    for (auto i = from; i < std::min(total, from + count); ++i)
      victims.insert(i);
  }
  const auto is_kept = [keeps_state](const Event& event) {
    return is_structural(event) ||
           (keeps_state &&
            event.body.index() <= analysis::EventBody(analysis::ThreadSched{}).index());
  };
  less.events.clear();
  for (std::size_t i = 0; i < total; ++i) {
    if (!victims.contains(i) || is_kept(trace.events[i])) less.events.push_back(trace.events[i]);
  }
  return less;
}

TEST(Laws, EveryVerdictHasWhatItNeeds) {
  EXPECT_TRUE(rc::check("L1", [] {
    const auto scenario = *scenarios();
    const Verified verified(thinned(trace_of(text_of(scenario))), spec_of(scenario));
    if (const auto lacking = unfounded(verified); !lacking.empty()) RC_FAIL(lacking);
  }));
}

TEST(Laws, DeletingEventsMovesVerdictsOnlyTowardsInconclusive) {
  EXPECT_TRUE(rc::check("L2", [] {
    const auto scenario = *scenarios();
    const auto trace = trace_of(text_of(scenario));
    const auto spec = spec_of(scenario);
    const Verified full(trace, spec);
    const auto less = thinned(trace, scenario.is_attached);
    const Verified reduced(less, spec);
    const Deletion deletion{.before = trace, .after = less, .has_crashed = scenario.has_crashed};
    const Verified user(without_kernel(trace), spec);
    if (const auto broken = broken_by(deletion, full, reduced, user); !broken.empty()) {
      RC_FAIL(broken + events_text(less));
    }
  }));
}

// The kernel's events, of which any may be missing, with a record of it or without.
TEST(Laws, KernelEventsNeverDecideLess) {
  EXPECT_TRUE(rc::check("L6", [] {
    auto scenario = *scenarios();
    scenario.is_kernel = true;
    const auto trace =
        trace_of(text_of(scenario) + (*rc::gen::arbitrary<bool>() ? "" : "\nkernel") +
                 (*rc::gen::arbitrary<bool>() ? "" : "\n150 discard kernel until=170"));
    const auto spec = spec_of(scenario);
    auto less = trace;
    const auto rarity = *rc::gen::inRange<std::size_t>(1, 20).as("every");
    std::size_t number = 0;
    less.erase<analysis::SchedSwitch>(
        [&](const auto&, const auto&) { return ++number % rarity == 0; });
    const Verified user(without_kernel(less), spec);
    if (const auto broken = broken_by_kernel(user, Verified(less, spec)); !broken.empty()) {
      RC_FAIL(broken + events_text(less));
    }
  }));
}

TEST(Laws, SameTraceSameVerdicts) {
  EXPECT_TRUE(rc::check("L4", [] {
    const auto scenario = *scenarios();
    const auto trace = trace_of(text_of(scenario));
    const Verified first(trace, spec_of(scenario));
    const Verified second(trace, spec_of(scenario));
    for (const auto& rule : first.result.verdicts.rules) {
      RC_ASSERT(explain(first, rule.id) == explain(second, rule.id));
    }
  }));
}

}  // namespace
}  // namespace cie::test
