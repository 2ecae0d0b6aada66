// cie-demo: a small car in two processes, to be run under any of the executors.
#include <cie/executor/executor.hpp>
#include <cie/executor/on_hangup.hpp>

#include "graph.hpp"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace demo {
namespace {

struct Settings {
  std::string part = "both";
  std::string executor = "isolated";
  double duration_s = 10;
  double load = 1;
  unsigned threads = 0;
  std::string spec;
  std::string on_error = "refuse";
  std::uint32_t domain = 77;
  std::string tag;
};

// For the signal handler. A signal that comes before the executor is there is remembered.
std::atomic<cie::Executor*> running{nullptr};
std::atomic<bool> is_asked_to_stop{false};

void on_signal(int) {
  is_asked_to_stop = true;
  if (cie::Executor* const executor = running; executor != nullptr) executor->cancel();
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  for (const int signal : {SIGINT, SIGTERM})
    sigaction(signal, &action, nullptr);
}

std::unique_ptr<cie::Executor> make_executor(const Settings& settings) {
  cie::ExecutorOptions options;
  options.threads = settings.threads;
  options.on_error = settings.on_error == "warn" ? cie::OnError::warn : cie::OnError::refuse;
  const bool refuses = options.on_error == cie::OnError::refuse;
  options.on_parameter_problem = [refuses](const cie::ParameterProblem& problem) {
    const bool is_thrown_too = refuses && !problem.is_from_outside;
    if (!is_thrown_too) std::fprintf(stderr, "cie-demo: warning: %s\n", problem.text().c_str());
  };
  if (!settings.spec.empty()) {
    options.spec = std::make_shared<cie::SchedulingSpec>(cie::SchedulingSpec::load(settings.spec));
  }
  return cie::make_executor(settings.executor, std::move(options));
}

// Until everybody who is meant to listen does, so that no chain begins in the middle. Bounded: the
// other process may not be there.
void wait_for_readers(const Nodes& nodes) {
  using namespace std::chrono_literals;
  const auto bound = std::chrono::steady_clock::now() + 5s;
  for (const auto& node : nodes) {
    while (!node->is_connected() && !is_asked_to_stop && std::chrono::steady_clock::now() < bound) {
      std::this_thread::sleep_for(5ms);
    }
  }
}

// At SIGHUP, in both processes.
void reload(cie::Executor& executor, const Settings& settings) noexcept {
  try {
    executor.reload_spec(
        std::make_shared<cie::SchedulingSpec>(cie::SchedulingSpec::load(settings.spec)));
    std::fprintf(stderr, "cie-demo: runs by %s as it is now\n", settings.spec.c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "cie-demo: the former spec stays in force: %s\n", error.what());
  }
}

void run_part(const Settings& settings, pid_t other_part = 0) {
  catch_signals();
  prctl(PR_SET_NAME, ("demo-" + settings.part).c_str());  // what `ps` and the trace call it
  Work::set_load(settings.load);
  const cie::Context context{{.domain = settings.domain, .loopback = true, .tag = settings.tag}};
  const auto nodes = settings.part == "planning" ? make_planning(context) : make_sensing(context);
  const auto executor = make_executor(settings);
  for (const auto& node : nodes)
    executor->add_node(node->node());
  running = executor.get();
  std::optional<cie::OnHangup> on_hangup;
  if (!settings.spec.empty()) {
    on_hangup.emplace([&executor, &settings, other_part] {
      if (other_part != 0) kill(other_part, SIGHUP);
      reload(*executor, settings);
    });
  }
  wait_for_readers(nodes);
  if (is_asked_to_stop) executor->cancel();
  executor->spin_for(std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>{settings.duration_s}));
  running = nullptr;
}

// The planning process, as a child that ends when it is told, when its parent is gone, or at the
// latest when its own time is up.
class PlanningProcess {
 public:
  explicit PlanningProcess(const Settings& settings) {
    constexpr double kMargin_s = 10;
    std::vector<std::string> arguments{"cie-demo",
                                       "--part",
                                       "planning",
                                       "--executor",
                                       settings.executor,
                                       "--duration",
                                       std::to_string(settings.duration_s + kMargin_s),
                                       "--load",
                                       std::to_string(settings.load),
                                       "--threads",
                                       std::to_string(settings.threads),
                                       "--on-error",
                                       settings.on_error,
                                       "--domain",
                                       std::to_string(settings.domain),
                                       "--tag",
                                       settings.tag};
    if (!settings.spec.empty()) {
      arguments.insert(arguments.end(), {"--spec", settings.spec});
    }
    std::vector<char*> raw;
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
    return WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }

 private:
  pid_t pid_ = 0;
};

int run(Settings settings) {
  if (!settings.spec.empty()) cie::hold_hangups();
  if (settings.part != "both") {
    run_part(settings);
    return 0;
  }
  if (settings.tag.empty()) settings.tag = "demo-" + std::to_string(getpid());
  PlanningProcess planning{settings};
  settings.part = "sensing";
  run_part(settings, planning.pid());
  return planning.stop() ? 0 : 1;
}

int command_line(int argc, char** argv) {
  Settings settings;
  CLI::App app{
      "A sensor -> transform -> fusion -> command graph over Cyclone DDS: 26 callbacks in two\n"
      "processes. Record it with `cie record -- cie-demo`, then `cie report` and `cie verify`."};
  app.name("cie-demo");
  app.add_option("--executor", settings.executor, "Who runs the callbacks")
      ->check(CLI::IsMember(
          std::vector<std::string>(cie::kExecutorNames.begin(), cie::kExecutorNames.end())))
      ->capture_default_str();
  app.add_option("--duration", settings.duration_s, "Seconds to run")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  app.add_option("--load", settings.load, "Factor of the callbacks' CPU work")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str();
  app.add_option("--threads", settings.threads, "Threads of `multi`; 0: one for each CPU")
      ->check(CLI::Range(0U, 256U))
      ->capture_default_str();
  app.add_option("--spec", settings.spec, "Scheduling spec of the threads")
      ->check(CLI::ExistingFile);
  app.add_option("--on-error", settings.on_error, "When the spec cannot be applied")
      ->check(CLI::IsMember({"refuse", "warn"}))
      ->capture_default_str();
  app.add_option("--part", settings.part, "Run one of the two processes only")
      ->check(CLI::IsMember({"both", "sensing", "planning"}))
      ->capture_default_str();
  app.add_option("--domain", settings.domain, "DDS domain")
      ->check(CLI::Range(0U, 230U))
      ->capture_default_str();
  app.add_option("--tag", settings.tag, "Only processes of the same tag see each other");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return run(settings);
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
