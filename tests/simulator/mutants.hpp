// Mutants: a clean simulated recording or its spec, changed in one way, and the rules that must say
// so, by rules.md. Every other rule must stay silent.
#pragma once

#include "simulator/clean.hpp"

#include <functional>
#include <set>
#include <string>
#include <variant>
#include <vector>

namespace cie::sim {

using Rules = std::set<std::string>;

// A clean case, on its way to a mutant.
struct Case {
  System system{};
  Truth truth{};
  test::TextTrace trace{};
  Spec spec{};
  analysis::AnalysisOptions options{};
};

struct Mutant {
  std::string rule;  // that it is meant for
  std::string name;
  std::function<System()> system;  // null: base_system()
  std::function<void(Case&)> change;
  Rules fails{};
  Rules doubts{};        // inconclusive
  bool is_clean = true;  // but for the change; else the system itself breaks rules
};

// The callbacks of base_system(), by their places: timers A, D, E, F; A publishes to B, B to C.
enum Place { A, B, C, D, E, F };
System base_system();
// The simulation of the seed-th clean run of a system, with a spec of its own making.
Case clean_case(System system, std::uint64_t seed);
// The same of whatever run it is.
Case any_case(System system, std::uint64_t seed);

std::vector<Mutant> trace_mutants();
std::vector<Mutant> mapping_mutants();
std::vector<Mutant> parameter_mutants();
std::vector<Mutant> execution_mutants();
std::vector<Mutant> timing_mutants();

// --- how cases are changed -----------------------------------------------------------------------
std::int64_t pid_of(const Case& c, Place place);
std::int64_t tid_of(const Case& c, Place place);  // of its isolated thread
std::int64_t receiver_of(const Case& c);
CallbackId id_of(const Case& c, Place place);  // its number in its process
std::string name_of(const Case& c, Place place);

// The n-th event of a kind for which the predicate holds, from the end if n is negative. Throws
// std::out_of_range.
template <typename Body, typename Predicate>
analysis::Event& event(test::TextTrace& trace, Predicate predicate, int n = 0) {
  std::vector<analysis::Event*> found;
  for (auto& candidate : trace.events) {
    const auto* body = std::get_if<Body>(&candidate.body);
    if (body != nullptr && predicate(*body, candidate.head)) found.push_back(&candidate);
  }
  return *found.at(static_cast<std::size_t>(n < 0 ? static_cast<int>(found.size()) + n : n));
}
template <typename Body>
Body& body(analysis::Event& event) {
  return std::get<Body>(event.body);
}
// Events of one callback, or read-backs of one thread.
template <typename Body>
analysis::Event& of_callback(Case& c, Place place, int n = 0) {
  return event<Body>(
      c.trace,
      [&](const Body& body, const analysis::EventHead&) {
        return body.callback == id_of(c, place);
      },
      n);
}
analysis::Event& read_back(Case& c, std::int64_t tid, SchedMoment moment);
analysis::Event& announcement(Case& c, std::int64_t tid);

void insert(test::TextTrace& trace, const analysis::Event& event);
void remove(test::TextTrace& trace, const analysis::Event& event);
// After times were changed.
void sort_by_time(test::TextTrace& trace);
// Middle of a time in which a processor is idle, and nobody's instance is running.
Ns quiet_time(const Case& c);

}  // namespace cie::sim
