// cie-demo: a small car in two processes, to be run under any of the executors.
#include "../common/runner.hpp"
#include "base/help_text.hpp"
#include "graph.hpp"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace demo {
namespace {

struct Settings {
  example::RunSettings common{.program = "cie-demo"};
  std::string part = "both";
  double background_ms = 0;
};

std::chrono::nanoseconds background_of(const Settings& settings) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double, std::milli>{settings.background_ms});
}

void run_part(const Settings& settings, pid_t other_part = 0) {
  prctl(PR_SET_NAME, ("demo-" + settings.part).c_str());  // what `ps` calls it
  const cie::Context context{example::context_options(settings.common)};
  const auto nodes = settings.part == "planning" ? make_planning(context, background_of(settings))
                                                 : make_sensing(context);
  example::run(nodes, settings.common, [other_part] {
    if (other_part != 0) kill(other_part, SIGHUP);
  });
}

// The planning process, as a child that ends when it is told, when its parent is gone, or at the
// latest when its own time is up.
class PlanningProcess {
 public:
  explicit PlanningProcess(const Settings& demo) {
    const auto& settings = demo.common;
    constexpr double kMarginSeconds = 10;
    std::vector<std::string> arguments{"cie-demo",
                                       "--part",
                                       "planning",
                                       "--executor",
                                       settings.executor,
                                       "--duration",
                                       std::to_string(settings.duration_s + kMarginSeconds),
                                       "--load",
                                       std::to_string(settings.load),
                                       "--threads",
                                       std::to_string(settings.threads),
                                       "--on-error",
                                       settings.on_error,
                                       "--domain",
                                       std::to_string(settings.domain),
                                       "--tag",
                                       settings.tag,
                                       "--background",
                                       std::to_string(demo.background_ms)};
    if (!settings.spec.empty()) {
      arguments.insert(arguments.end(), {"--spec", settings.spec});
    }
    std::vector<char*> raw;
    raw.reserve(arguments.size() + 1);
    for (std::string& argument : arguments)
      raw.push_back(argument.data());
    raw.push_back(nullptr);
    const auto program =
        std::filesystem::read_symlink("/proc/self/exe");  // is called like this one
    const pid_t parent = getpid();
    pid_ = fork();
    if (pid_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGTERM);
      if (getppid() == parent) execv(program.c_str(), raw.data());
      _exit(127);
    }
    if (pid_ < 0) throw std::system_error{errno, std::generic_category(), "cannot start a process"};
  }
  PlanningProcess(const PlanningProcess&) = delete;
  PlanningProcess& operator=(const PlanningProcess&) = delete;
  ~PlanningProcess() {
    if (pid_ > 0) stop();
  }
  pid_t pid() const noexcept { return pid_; }
  // True if it ended well.
  bool stop() {
    kill(pid_, SIGTERM);
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = 0;
    // At its very start it does not handle the signal yet.
    const bool is_ended_by_us = WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM;
    return is_ended_by_us || (WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }

 private:
  pid_t pid_ = 0;
};

int run(Settings settings) {
  if (settings.part != "both") {
    run_part(settings);
    return 0;
  }
  if (settings.common.is_networked) {
    throw std::invalid_argument("--network goes with --part sensing or --part planning");
  }
  if (settings.common.tag.empty()) settings.common.tag = "demo-" + std::to_string(getpid());
  PlanningProcess planning{settings};
  settings.part = "sensing";
  run_part(settings, planning.pid());
  if (planning.stop()) return 0;
  std::fputs("cie-demo: the planning process failed\n", stderr);
  return 1;
}

int command_line(int argc, char** argv) {
  Settings settings;
  CLI::App app{
      "A sensor -> transform -> fusion -> command graph over Cyclone DDS: 28 callbacks in two\n"
      "processes, to be run under any of the executors and recorded."};
  app.footer(
      "Examples:\n"
      "  cie record -o demo -- cie-demo    then cie report demo, cie verify demo\n"
      "  cie record -o pool -- cie-demo --executor multi --background 50\n"
      "\nExit codes: 0 ran, 1 the planning process failed, 2 wrong usage, or the spec or\n"
      "the executor could not be set up.");
  app.name(settings.common.program);
  example::add_options(app, settings.common);
  app.add_option("--part", settings.part, "Processes to run: both (default), sensing or planning")
      ->option_text("PART")
      ->check(cie::one_of({"both", "sensing", "planning"}));
  app.add_option("--background", settings.background_ms,
                 "Milliseconds of CPU time that each of two background callbacks takes of 190 (0)")
      ->option_text("MS")
      ->check(CLI::Range(0.0, 190.0));
  app.add_flag("--network", settings.common.is_networked,
               "The other part may run on another machine (with --part, without --tag)");
  return example::run_main(argc, argv, app, settings.common, [&settings] { return run(settings); });
}

}  // namespace
}  // namespace demo

int main(int argc, char** argv) {
  try {
    return demo::command_line(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cie-demo: %s\n", error.what());
  } catch (...) {
    std::fputs("cie-demo: unknown exception\n", stderr);
  }
  return 2;
}
