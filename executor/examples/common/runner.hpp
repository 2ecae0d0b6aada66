// What the example programs have in common: their options, and a run from first to last.
#pragma once

#include <cie/executor/executor.hpp>

#include "archetypes.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace example {

using Nodes = std::vector<std::unique_ptr<ExampleNode>>;

// Options that every example has.
struct RunSettings {
  std::string program;  // in front of what it prints
  std::string executor = "isolated";
  double duration_s = 10;
  double load = 1;
  unsigned threads = 0;
  std::string spec{};  // empty: none
  std::string on_error = "refuse";
  std::uint32_t domain = 77;
  std::string tag{};
  bool is_networked = false;  // DDS as CYCLONEDDS_URI has it, rather than on loopback only
};

void add_options(CLI::App& app, RunSettings& settings);

// A context on the loopback interface that only processes of the same tag see, or, networked, one
// as any application of DDS has.
cie::Context::Options context_options(const RunSettings& settings);

// Runs the nodes for the duration, or until SIGINT or SIGTERM. At SIGHUP the spec is read again,
// after `on_hangup`, if there is one. Throws what the executor throws.
void run(const Nodes& nodes, const RunSettings& settings,
         const std::function<void()>& on_hangup = {});

// The body of main(): parses, runs `body`, says what went wrong. Returns the exit status: 0, or 2.
int run_main(int argc, char** argv, CLI::App& app, const RunSettings& settings,
             const std::function<int()>& body) noexcept;

}  // namespace example
