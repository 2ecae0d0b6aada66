// Mutants of the recording itself: T1 to T6.
#include "simulator/mutants.hpp"

#include <algorithm>
#include <set>

namespace cie::sim {
namespace {

using namespace analysis;

// Rules that judge each instance, which a lost one leaves undecided (rules.md, L5).
const Rules kInstanceRules{"M2", "M3", "M6", "E1", "E2", "E3", "R1", "R3", "R4", "R5"};

Rules with(Rules rules, const Rules& more) {
  rules.insert(more.begin(), more.end());
  return rules;
}

// A gap of the tracer's own making, of one event, which `what` puts into a stream of that domain.
template <typename Body>
void put(Case& c, Domain domain, Ns time, const Body& what) {
  const auto& model = event<StreamBegin>(
      c.trace,
      [domain](const StreamBegin& begin, const EventHead&) { return begin.domain == domain; });
  insert(c.trace, {.head = {.time = {time},
                            .stream = model.head.stream,
                            .cpu = model.head.cpu,
                            .pid = std::nullopt,
                            .tid = std::nullopt},
                   .body = what});
}

Discarded discarded(Ns time, bool packets) {
  return {.begin = {time - 1'000}, .end = {time}, .count = 1, .packets = packets};
}

void crash(Case& c) {
  c.trace.erase<RunEnd>();
  c.options.allow_crash = true;
}

void lose_instance(Case& c, Place place, int which) {
  remove(c.trace, of_callback<CallbackStart>(c, place, which));
  remove(c.trace, of_callback<CallbackEnd>(c, place, which));
}

std::vector<Mutant> readable() {
  return {
      {"T1",
       "a damaged packet that cost nobody anything",
       {},
       [](Case& c) { put(c, Domain::user, quiet_time(c), DamagedPacket{.reason = "cut short"}); },
       {},
       {"T1"}},
      {"T1",
       "metadata of another recording",
       {},
       [](Case& c) {
         put(c, Domain::user, quiet_time(c),
             DamagedPacket{.reason = "foreign", .has_foreign_metadata = true});
       },
       {},
       {"T1"}},
      {"T1",
       "a damaged packet of the kernel's",
       {},
       [](Case& c) { put(c, Domain::kernel, quiet_time(c), DamagedPacket{.reason = "cut"}); },
       {},
       {"T1", "M6"}},  // whose budget needs the kernel throughout
      {"T1",
       "nothing but damaged packets",
       {},
       [](Case& c) {
         const auto time = quiet_time(c);
         std::erase_if(c.trace.events, [](const Event& e) {
           return analysis::category_of(e.body) != analysis::EventCategory::structure;
         });
         put(c, Domain::user, time, DamagedPacket{.reason = "cut short"});
       },
       {"T1"},
       {"T5", "M1", "Q2"}},
  };
}

// As if the kernel's tracer had not had this processor.
void lose_processor(Case& c, std::int32_t cpu) {
  std::set<StreamIndex> gone;
  for (const auto& event : c.trace.events) {
    const auto* begin = std::get_if<StreamBegin>(&event.body);
    if (begin != nullptr && begin->domain == Domain::kernel && event.head.cpu == cpu) {
      gone.insert(event.head.stream);
    }
  }
  std::erase_if(c.trace.events,
                [&gone](const Event& event) { return gone.contains(event.head.stream); });
}

std::vector<Mutant> lossless() {
  const auto lossless = [](Domain domain, bool packets) {
    return [domain, packets](Case& c) {
      put(c, domain, quiet_time(c), discarded(quiet_time(c), packets));
      c.options.require_lossless = true;
    };
  };
  return {
      {"T2", "events discarded, where none may be", {}, lossless(Domain::user, false), {"T2"}, {}},
      {"T2", "packets discarded, where none may be", {}, lossless(Domain::user, true), {"T2"}, {}},
      {"T2",
       "the kernel's events discarded, where none may be",
       {},
       lossless(Domain::kernel, false),
       {"T2"},
       {"M6"}},
      {"T2",
       "a processor that the kernel's tracer did not have, where nothing may be lost",
       {},
       [](Case& c) {
         lose_processor(c, 1);
         c.options.require_lossless = true;
       },
       {"T2"},
       {"M6", "R4"}},
      {"R4",
       "a processor that the kernel's tracer did not have",
       {},
       [](Case& c) { lose_processor(c, 1); },
       {},
       {"M6", "R4"}},  // of what may have run there only durations are known
      {"T2",
       "an instance discarded",
       {},
       [](Case& c) {
         const auto start = of_callback<CallbackStart>(c, F, 2).head.time.ns;
         lose_instance(c, F, 2);
         put(c, Domain::user, start, discarded(start, false));
       },
       {},
       with(kInstanceRules, {"T2", "T3", "T4", "R2"})},
  };
}

std::vector<Mutant> contiguous() {
  return {
      {"T3",
       "a message missing, of a process that crashed",
       {},
       [](Case& c) {
         const auto is_on_z = [](const PublisherInit& init, const EventHead&) {
           return init.topic == "/z";
         };
         const auto z = body<PublisherInit>(event<PublisherInit>(c.trace, is_on_z)).publisher;
         const auto of_z = [z](const auto& publish, const EventHead&) {
           return publish.publisher == z;
         };
         remove(c.trace, event<Publish>(c.trace, of_z, 3));
         c.trace.erase<PublisherFini>(of_z);
         crash(c);
       },
       {},
       {"T3"}},
      {"T3",
       "an instance missing",
       {},
       [](Case& c) { lose_instance(c, F, 2); },
       {},
       with(kInstanceRules, {"T3", "T4", "R2"})},
      {"T3",
       "an instance of a subscription missing, on a chain",
       {},
       [](Case& c) { lose_instance(c, C, 3); },
       {},
       with(kInstanceRules, {"T3", "T4", "Q1", "Q2"})},
      {"T3",
       "the first instance missing",
       {},
       [](Case& c) { lose_instance(c, F, 0); },
       {},
       with(kInstanceRules, {"T3", "T4", "R2", "S2"})},
      {"T3",
       "an end missing",
       {},
       [](Case& c) { remove(c.trace, of_callback<CallbackEnd>(c, F, 2)); },
       {},
       with(kInstanceRules, {"T3", "T4", "R2"})},
      {"T3",
       "a read-back missing",
       {},
       [](Case& c) { remove(c.trace, read_back(c, tid_of(c, D), SchedMoment::applied)); },
       {},
       {"T3", "T4", "M6", "S1", "S2", "S3", "S4"}},
  };
}

std::vector<Mutant> complete() {
  const auto total = [](auto change) {
    return [change](Case& c) {
      change(body<RunEnd>(event<RunEnd>(c.trace, [](const auto&, const auto&) { return true; })));
    };
  };
  return {
      {"T4", "a process that crashed", {}, [](Case& c) { c.trace.erase<RunEnd>(); }, {}, {"T4"}},
      {"T4",
       "a group more than was seen",
       {},
       total([](RunEnd& end) { ++end.groups; }),
       {},
       {"T4"}},
      {"T4",
       "a thread more than was seen",
       {},
       total([](RunEnd& end) { ++end.threads; }),
       {},
       {"T4"}},
      {"T4",
       "a callback whose totals are missing",
       {},
       [](Case& c) { remove(c.trace, of_callback<CallbackFini>(c, F)); },
       {},
       with(kInstanceRules, {"T4", "R2"})},
  };
}

std::vector<Mutant> required() {
  return {
      {"T5",
       "clock_sync without vtid",
       {},
       [](Case& c) {
         event<ClockSync>(c.trace, [](const auto&, const auto&) { return true; }).head.tid.reset();
       },
       {},
       {"T5"}},
      {"T5",
       "callback_release without vtid",
       {},
       [](Case& c) {
         for (auto& e : c.trace.events) {
           if (std::holds_alternative<CallbackRelease>(e.body)) e.head.tid.reset();
         }
       },
       {},
       {"T5"}},
      {"T5",
       "group_init without vtid",
       {},
       [](Case& c) {
         for (auto& e : c.trace.events) {
           if (std::holds_alternative<GroupInit>(e.body)) e.head.tid.reset();
         }
       },
       {},
       {"T5"}},
      {"T5", "no run_begin", {}, [](Case& c) { c.trace.erase<RunBegin>(); }, {}, {"T4", "T5"}},
  };
}

std::vector<Mutant> sane() {
  const auto back = [](Domain domain) {
    return [domain](Case& c) {
      const auto time = quiet_time(c);
      put(c, domain, time, TimeRegression{.previous = {time + 1}});
    };
  };
  return {
      {"T6", "time runs backwards", {}, back(Domain::user), {"T6"}, {}},
      {"T6", "the kernel's time runs backwards", {}, back(Domain::kernel), {"T6"}, {}},
      {"T6",
       "the kernel's trace is of another boot",
       {},
       [](Case& c) {
         for (auto& event : c.trace.events) {
           auto* begin = std::get_if<StreamBegin>(&event.body);
           if (begin != nullptr && begin->domain == Domain::kernel) begin->clock_uuid = "another";
         }
       },
       {},
       {"T6", "M6", "R4"}},  // as without kernel events
      {"T6",
       "the kernel's clock has no uuid",
       {},
       [](Case& c) {
         for (auto& event : c.trace.events) {
           auto* begin = std::get_if<StreamBegin>(&event.body);
           if (begin != nullptr && begin->domain == Domain::kernel) begin->clock_uuid = "";
         }
       },
       {},
       {"T6", "M6", "R4"}},
      {"T6",
       "the kernel's clock has no uuid, and its priorities are others'",
       {},
       [](Case& c) {
         for (auto& event : c.trace.events) {
           auto* begin = std::get_if<StreamBegin>(&event.body);
           if (begin != nullptr && begin->domain == Domain::kernel) begin->clock_uuid = "";
           if (auto* change = std::get_if<SchedSwitch>(&event.body)) --change->next_prio;
         }
       },
       {},
       {"T6", "M6", "R4"}},
  };
}

}  // namespace

std::vector<Mutant> trace_mutants() {
  std::vector<Mutant> all;
  for (auto& some : {readable(), lossless(), contiguous(), complete(), required(), sane()})
    all.insert(all.end(), some.begin(), some.end());
  return all;
}

}  // namespace cie::sim
