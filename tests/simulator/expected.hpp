// Holds what the analysis says of a recording against what happened, by the definitions: every
// number of the report and every row of the instances, to the nanosecond.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "application.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace cie::sim {

// One chain, as definitions have it, from the simulator's account.
struct ChainTruth {
  std::vector<int> hops{};  // callbacks
  struct Run {
    Ns read = 0;                        // start of the first callback's instance
    Ns write = 0;                       // end of the last one's
    std::vector<bool> tells_release{};  // of each hop
    std::vector<Ns> processing{};
    std::vector<Ns> communication{};
  };
  std::vector<Run> runs{};      // by write
  bool is_overtaken = false;    // a run ended before one that had begun earlier
  std::vector<Ns> all_reads{};  // of the first callback, those that led nowhere too
  std::vector<Ns> reaction_times() const;
  std::vector<Ns> data_ages() const;
};
std::vector<ChainTruth> chains_of(const System& system, const Truth& truth);

// Everything the analysis says of one recording.
struct Observed : analysis::Observer {
  struct Row {
    analysis::Instance instance{};  // but for its views
    std::string logical_id{};
    std::vector<analysis::Preemptor> preempted_by{};
  };
  void on_instance(const analysis::Instance& instance) override;
  analysis::AnalysisResult result;
  std::vector<Row> rows{};
};
void analyze(const test::TextTrace& trace, const analysis::AnalysisOptions& options,
             Observed& observed);

// What differs, in words; nothing if all agrees. A recording that does not cover the whole
// simulation is held against the instances and the figures of callbacks only.
std::vector<std::string> differences(const System& system, const Simulation& simulation,
                                     const Recording& recording, const Observed& observed);

}  // namespace cie::sim
