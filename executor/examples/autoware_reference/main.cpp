// cie-autoware-reference: the Autoware reference system under any of the executors.
#include "graph.hpp"
#include "key_figures.hpp"

#include <chrono>
#include <cstdio>
#include <string>

#include <CLI/CLI.hpp>
#include <unistd.h>

namespace autoware {
namespace {

int run(example::RunSettings settings) {
  using namespace std::chrono_literals;
  if (settings.tag.empty()) settings.tag = "autoware-" + std::to_string(getpid());
  const cie::Context context{example::context_options(settings)};
  KeyFigures figures{std::chrono::duration<double>{settings.duration_s}, 100ms, 100ms};
  const auto nodes = make_graph(context, figures);
  example::run(nodes, settings);
  std::fputs(figures.text().c_str(), stdout);
  return 0;
}

}  // namespace
}  // namespace autoware

// What escapes is a lack of memory. NOLINTNEXTLINE(bugprone-exception-escape)
int main(int argc, char** argv) {
  example::RunSettings settings{.program = "cie-autoware-reference"};
  CLI::App app{
      "The Autoware reference system: 24 nodes from lidars to vehicle commands in one process.\n"
      "Prints its key figures at the end: the latency of the hot path (from the older of two\n"
      "lidar samples to the estimate made of them), dropped samples, and the planner's period."};
  app.footer(
      "Example:\n"
      "  cie record -o run -- cie-autoware-reference --spec autoware_reference.yaml\n"
      "\nExit codes: 0 ran, 2 wrong usage, or the spec or the executor could not be set up.");
  app.name(settings.program);
  example::add_options(app, settings);
  return example::run_main(argc, argv, app, settings,
                           [&settings] { return autoware::run(settings); });
}
