#include "runner.hpp"

#include <cie/executor/cancel_on_signals.hpp>
#include <cie/executor/on_hangup.hpp>

#include "base/help_text.hpp"
#include "base/messages.hpp"
#include "base/program.hpp"

#include <chrono>
#include <cstdio>
#include <exception>
#include <optional>
#include <thread>
#include <utility>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace example {
namespace {

std::shared_ptr<cie::SchedulingSpec> load_spec(const RunSettings& settings) {
  return std::make_shared<cie::SchedulingSpec>(cie::SchedulingSpec::load(settings.spec));
}

std::unique_ptr<cie::Executor> make_executor(const RunSettings& settings) {
  cie::ExecutorOptions options;
  options.threads = settings.threads;
  options.on_error = settings.on_error == "warn" ? cie::OnError::warn : cie::OnError::refuse;
  const bool refuses = options.on_error == cie::OnError::refuse;
  options.on_scheduling_problem = [refuses, program = settings.program](const auto& problem) {
    const bool is_told_only = problem.is_from_outside || problem.is_misspelt;
    if (refuses && !is_told_only) return;  // it is thrown, too
    std::fprintf(stderr, "%s: warning: %s\n", program.c_str(), problem.text().c_str());
  };
  if (!settings.spec.empty()) options.spec = load_spec(settings);
  return cie::make_executor(settings.executor, std::move(options));
}

// Until everybody who is meant to listen does, so that no chain begins in the middle. Bounded:
// another process may not be there.
void wait_for_readers(const Nodes& nodes, const cie::CancelOnSignals& signals) {
  using namespace std::chrono_literals;
  const auto bound = std::chrono::steady_clock::now() + 5s;
  for (const auto& node : nodes) {
    while (!node->is_connected() && !signals.is_requested() &&
           std::chrono::steady_clock::now() < bound) {
      std::this_thread::sleep_for(5ms);
    }
  }
}

void reload(cie::Executor& executor, const RunSettings& settings) noexcept {
  const char* const program = settings.program.c_str();
  try {
    executor.reload_spec(load_spec(settings));
    std::fprintf(stderr, "%s: runs by %s as it is now\n", program, settings.spec.c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: the former spec stays in force: %s\n", program, error.what());
  }
}

}  // namespace

void add_options(CLI::App& app, RunSettings& settings) {
  cie::lay_out_help(app, settings.program + " [OPTIONS]");
  app.add_option("--executor", settings.executor,
                 fmt::format("Who runs the callbacks ({}): {}", settings.executor,
                             fmt::join(cie::kExecutorNames, ", ")))
      ->option_text("NAME")
      ->check(cie::one_of({cie::kExecutorNames.begin(), cie::kExecutorNames.end()}));
  app.add_option("--duration", settings.duration_s,
                 fmt::format("How long to run ({})", settings.duration_s))
      ->option_text("SECONDS")
      ->check(CLI::Range(0.0, 86400.0));
  app.add_option("--load", settings.load,
                 fmt::format("Factor of the callbacks' CPU work ({})", settings.load))
      ->option_text("FACTOR")
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option("--threads", settings.threads, "Threads of multi (one for each CPU)")
      ->option_text("N")
      ->check(CLI::Range(0U, 256U));
  app.add_option("--spec", settings.spec, "Scheduling spec of the threads (YAML)")
      ->option_text("FILE")
      ->check(CLI::ExistingFile);
  app.add_option("--on-error", settings.on_error,
                 "When the spec cannot be applied: refuse to run (default), or warn")
      ->option_text("HOW")
      ->check(cie::one_of({"refuse", "warn"}));
  app.add_option("--domain", settings.domain, fmt::format("DDS domain ({})", settings.domain))
      ->option_text("N")
      ->check(CLI::Range(0U, 230U));
  app.add_option("--tag", settings.tag, "Only processes of the same tag see each other")
      ->option_text("TEXT");
}

cie::Context::Options context_options(const RunSettings& settings) {
  return {.domain = settings.domain, .loopback = !settings.is_networked, .tag = settings.tag};
}

void run(const Nodes& nodes, const RunSettings& settings, const std::function<void()>& on_hangup) {
  Work::set_load(settings.load);
  const auto executor = make_executor(settings);
  for (const auto& node : nodes)
    executor->add_node(node->node());
  cie::CancelOnSignals signals{*executor};
  std::optional<cie::OnHangup> hangups;
  if (!settings.spec.empty()) {
    hangups.emplace([&] {
      if (on_hangup) on_hangup();
      reload(*executor, settings);
    });
  }
  wait_for_readers(nodes, signals);
  executor->spin_for(std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>{settings.duration_s}));
}

int run_main(int argc, char** argv, CLI::App& app, const RunSettings& settings,
             const std::function<int()>& body) noexcept {
  try {
    if (const auto help = cie::parse_arguments(app, {argv + 1, argv + argc})) {
      std::fputs(help->c_str(), stdout);
      return cie::kSuccess;
    }
    if (!settings.spec.empty()) cie::hold_hangups();
    const cie::CancelOnSignals signals;  // until all is torn down
    return body();
  } catch (const cie::UsageError& error) {
    cie::tell_wrong_usage(error.what(), settings.program);
  } catch (const std::exception& error) {
    cie::tell(error.what(), settings.program);
  } catch (...) {
    cie::tell("unknown exception", settings.program);
  }
  return cie::kWrongUsage;  // also of an executor that could not be set up
}

}  // namespace example
