// Mutants of times and messages: R1 to R5, Q1 and Q2. What the spec asks for is exactly what was
// done, so one nanosecond breaks it.
#include "simulator/mutants.hpp"

#include <algorithm>

namespace cie::sim {
namespace {

using namespace analysis;

template <typename ChangeEntry>
std::function<void(Case&)> asking(const char* id, ChangeEntry change) {
  return [id, change](Case& c) { change(c.spec.of(id)); };
}
template <typename ChangeChain>
std::function<void(Case&)> asking_of_chain(ChangeChain change) {
  return [change](Case& c) { change(c.spec.chains.at(0)); };
}

// Released `earlier` than the instance before it ended (or later, if negative).
std::function<void(Case&)> released_early(Place place, Ns earlier) {
  return [place, earlier](Case& c) {
    const auto end = of_callback<CallbackEnd>(c, place, 2).head.time.ns;
    body<CallbackStart>(of_callback<CallbackStart>(c, place, 3)).release_ns = end - earlier;
    auto& entry = c.spec.of(name_of(c, place));
    entry.response_deadline.reset();
    entry.min_inter_arrival.reset();
    entry.max_inter_arrival.reset();
  };
}

std::function<void(Case&)> skipped(Place place, std::uint32_t periods, std::optional<Ns> allowed) {
  return [place, periods, allowed](Case& c) {
    body<CallbackStart>(of_callback<CallbackStart>(c, place, 3)).missed = periods;
    c.spec.of(name_of(c, place)).missed_releases_allowed = allowed;
  };
}

std::function<void(Case&)> overwritten(Place place, std::uint64_t samples,
                                       std::optional<Ns> allowed) {
  return [place, samples, allowed](Case& c) {
    body<CallbackRelease>(of_callback<CallbackRelease>(c, place, -1)).overwritten = samples;
    body<CallbackFini>(of_callback<CallbackFini>(c, place)).overwritten = samples;
    c.spec.of(name_of(c, place)).overwrites_allowed = allowed;
  };
}

std::function<void(Case&)> lost(Place place, std::uint32_t samples) {
  return [place, samples](Case& c) {
    auto e = of_callback<CallbackRelease>(c, place, 3);
    e.body = SampleLost{.callback = id_of(c, place), .count = samples, .total = samples};
    insert(c.trace, e);
    body<CallbackFini>(of_callback<CallbackFini>(c, place)).lost = samples;
  };
}

std::vector<Mutant> releases() {
  return {
      {"R1", "released as the one before ends", {}, released_early(F, 0), {"R1"}, {}},
      {"R1", "released before the one before ends", {}, released_early(D, 1), {"R1"}, {}},
      {"R1", "released just after the one before ended", {}, released_early(E, -1), {"R1"}, {}},
      {"R2", "(none) as many periods skipped as allowed", {}, skipped(F, 2, 2), {}, {}},
      {"R2", "a period skipped", {}, skipped(F, 1, std::nullopt), {"R2"}, {}},
      {"R2", "a period more skipped than allowed", {}, skipped(D, 3, 2), {"R2"}, {}},
      {"R2", "many periods skipped", {}, skipped(E, 40, 0), {"R2"}, {}},
      {"R5",
       "a timer too soon",
       {},
       asking("/n0@D",
              [](Spec::Entry& entry) {
                ++*entry.min_inter_arrival;
                entry.max_inter_arrival.reset();
              }),
       {"R5"},
       {}},
      {"R5",
       "a timer too late",
       {},
       asking("/n0@F",
              [](Spec::Entry& entry) {
                --*entry.max_inter_arrival;
                entry.min_inter_arrival.reset();
              }),
       {"R5"},
       {}},
      {"R5",
       "a message too soon",
       {},
       asking("/n0@C", [](Spec::Entry& entry) { ++*entry.min_inter_arrival; }),
       {"R5"},
       {}},
  };
}

std::vector<Mutant> durations() {
  return {
      {"R3",
       "a subscription's deadline missed",
       {},
       asking("/n0@B", [](Spec::Entry& entry) { --*entry.response_deadline; }),
       {"R3"},
       {}},
      {"R3",
       "a declared deadline missed",
       {},
       [](Case& c) {
         auto& asked = c.spec.of("/n0@E").response_deadline;
         body<CallbackInit>(of_callback<CallbackInit>(c, E)).deadline_ns =
             static_cast<std::uint64_t>(*asked - 1);
         asked.reset();
       },
       {"R3"},
       {}},
      {"R3",
       "an instance that never ends",
       {},
       [](Case& c) {
         remove(c.trace, of_callback<CallbackEnd>(c, F, -1));
         --body<CallbackFini>(of_callback<CallbackFini>(c, F)).ended;
         c.spec.of("/n0@F").wcet.reset();  // R4: by then it may have executed for longer
       },
       {"E1", "R3"},
       {}},
      {"R4",
       "a timer's budget exceeded",
       {},
       asking("/n0@A", [](Spec::Entry& entry) { --*entry.wcet; }),
       {"R4"},
       {}},
      {"R4",
       "a subscription's budget exceeded",
       {},
       asking("/n0@C", [](Spec::Entry& entry) { --*entry.wcet; }),
       {"R4"},
       {}},
      {"R4",
       "a budget of a SCHED_DEADLINE thread exceeded",
       {},
       asking("/n0@E", [](Spec::Entry& entry) { --*entry.wcet; }),
       {"R4"},
       {}},
  };
}

std::vector<Mutant> messages() {
  return {
      {"Q1", "a sample lost", {}, lost(C, 1), {"Q1"}, {}},
      {"Q1", "a sample overwritten", {}, overwritten(B, 1, std::nullopt), {"Q1"}, {}},
      {"Q1", "a sample more overwritten than allowed", {}, overwritten(C, 2, 1), {"Q1"}, {}},
      {"Q1", "(none) as many samples overwritten as allowed", {}, overwritten(C, 2, 2), {}, {}},
      {"Q2",
       "a path latency too long",
       {},
       asking_of_chain([](Spec::Chain& chain) { --*chain.path_latency; }),
       {"Q2"},
       {}},
      {"Q2",
       "a reaction time too long",
       {},
       asking_of_chain([](Spec::Chain& chain) { --*chain.reaction_time; }),
       {"Q2"},
       {}},
      {"Q2",
       "a data age too high",
       {},
       asking_of_chain([](Spec::Chain& chain) { --*chain.data_age; }),
       {"Q2"},
       {}},
      {"Q2",
       "messages that nobody can follow",
       {},
       [](Case& c) {
         for (auto& event : c.trace.events) {
           if (auto* start = std::get_if<CallbackStart>(&event.body)) {
             start->source_timestamp_realtime_ns = 0;
             start->writer_gid = 0;
           }
         }
       },
       {},
       {"Q2"}},
  };
}

}  // namespace

std::vector<Mutant> timing_mutants() {
  std::vector<Mutant> all;
  for (auto& some : {releases(), durations(), messages()})
    all.insert(all.end(), some.begin(), some.end());
  return all;
}

}  // namespace cie::sim
