// Simulations that keep every rule, and specs that ask for exactly what they do: a bound that is a
// nanosecond tighter is broken.
#pragma once

#include <cie/tracepoints/scheduling_spec.hpp>

#include "application.hpp"
#include "expected.hpp"
#include "system.hpp"

#include <optional>
#include <string>
#include <vector>

namespace cie::sim {

// A scheduling spec as data, which tests change before they write it.
struct Spec {
  struct Entry {
    std::string id{};
    std::optional<ThreadParameters> parameters{};
    std::optional<Ns> response_deadline{};
    std::optional<Ns> wcet{};
    std::optional<Ns> min_inter_arrival{};
    std::optional<Ns> max_inter_arrival{};
    std::optional<Ns> foreign_work_budget{};
    std::optional<Ns> missed_releases_allowed{};
    std::optional<Ns> overwrites_allowed{};
  };
  struct Chain {
    std::string name{};
    std::vector<std::string> callbacks{};
    std::optional<Ns> path_latency{};
    std::optional<Ns> reaction_time{};
    std::optional<Ns> data_age{};
  };
  std::vector<Entry> callbacks{};
  std::vector<Entry> threads{};
  std::vector<Chain> chains{};

  Entry& of(const std::string& id);  // throws std::out_of_range
  std::string text() const;          // YAML
};

// Whether nothing was missed, overwritten or released before its predecessor's end, and everything
// ran and ended.
bool keeps_every_rule(const System& system, const Truth& truth);

// What the callbacks did, as bounds; what the threads were given, as parameters.
Spec spec_of(const System& system, const Truth& truth);

}  // namespace cie::sim
