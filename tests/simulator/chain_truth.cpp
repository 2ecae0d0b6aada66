#include "simulator/application.hpp"
#include "simulator/expected.hpp"

#include <algorithm>
#include <map>
#include <optional>

namespace cie::sim {
namespace {

struct Link {
  std::size_t instance = 0;
  Ns published = 0;  // the message it took
};

// From the source to an instance: those whose messages led to it.
std::vector<Link> path_to(const System& system, const Truth& truth, std::size_t last) {
  std::vector<Link> path{{.instance = last, .published = 0}};
  while (true) {
    Link& link = path.back();
    const auto& instance = truth.instances[link.instance];
    if (!instance.message ||
        !system.callbacks[static_cast<std::size_t>(instance.callback)].tells_source) {
      break;
    }
    const auto& message = truth.messages[*instance.message];
    link.published = message.published;
    path.push_back({.instance = message.instance, .published = 0});
  }
  std::ranges::reverse(path);
  return path;
}

ChainTruth::Run run_of(const System& system, const Truth& truth, const std::vector<Link>& path) {
  ChainTruth::Run run;
  run.read = truth.instances[path.front().instance].start;
  run.write = *truth.instances[path.back().instance].end;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto& instance = truth.instances[path[i].instance];
    run.tells_release.push_back(
        system.callbacks[static_cast<std::size_t>(instance.callback)].tells_release);
    const auto leaves = i + 1 < path.size() ? path[i + 1].published : run.write;
    run.processing.push_back(leaves - instance.release);
    if (i > 0) run.communication.push_back(instance.release - path[i].published);
  }
  return run;
}

}  // namespace

std::vector<ChainTruth> chains_of(const System& system, const Truth& truth) {
  std::map<std::vector<int>, ChainTruth> by_hops;
  for (std::size_t i = 0; i < truth.instances.size(); ++i) {
    if (!truth.instances[i].end) continue;
    const auto path = path_to(system, truth, i);
    if (path.size() < 2) continue;
    std::vector<int> hops;
    hops.reserve(path.size());
    for (const auto& link : path)
      hops.push_back(truth.instances[link.instance].callback);
    auto& chain = by_hops[hops];
    chain.hops = hops;
    chain.runs.push_back(run_of(system, truth, path));
  }
  std::vector<ChainTruth> chains;
  for (auto& [path, chain] : by_hops) {
    const auto& hops = path;  // clang captures no structured binding
    const auto is_longer = [&hops](const auto& other) {
      return other.first.size() > hops.size() &&
             std::equal(hops.begin(), hops.end(), other.first.begin());
    };
    if (std::ranges::any_of(by_hops, is_longer)) continue;  // not maximal
    std::ranges::stable_sort(chain.runs, {}, &ChainTruth::Run::write);
    for (std::size_t i = 1; i < chain.runs.size(); ++i) {
      if (chain.runs[i].read < chain.runs[i - 1].read) chain.is_overtaken = true;
    }
    for (const auto& instance : truth.instances) {
      if (instance.callback == hops.front()) chain.all_reads.push_back(instance.start);
    }
    chains.push_back(std::move(chain));
  }
  return chains;
}

// From each read, whether it led to a run or not, until the end of the first run that began after
// it. Before the first run the chain warms up.
std::vector<Ns> ChainTruth::reaction_times() const {
  std::vector<Ns> times;
  for (const auto read : all_reads) {
    if (read < runs.front().read) continue;
    const auto later =
        std::ranges::find_if(runs, [read](const Run& run) { return run.read > read; });
    if (later != runs.end()) times.push_back(later->write - read);
  }
  return times;
}

// Until each run's end but the first: the age of what the run before had brought.
std::vector<Ns> ChainTruth::data_ages() const {
  std::vector<Ns> ages;
  for (std::size_t i = 1; i < runs.size(); ++i)
    ages.push_back(runs[i].write - runs[i - 1].read);
  return ages;
}

}  // namespace cie::sim
