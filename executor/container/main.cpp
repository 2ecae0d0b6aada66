// cie-run: the component container. `cie run` starts it.
#include "app_file.hpp"
#include "container.hpp"

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <mutex>
#include <string>

#include <CLI/CLI.hpp>

namespace cie::container {
namespace {

enum ExitCode : int { kEndedWell = 0, kUnusable = 2, kFailed = 4 };

constexpr const char* kDescription =
    "Runs the components that APP.yaml names, by default every callback on a thread of its own,\n"
    "until SIGINT or SIGTERM.";
constexpr const char* kFooter =
    "\nExample:\n"
    "  cie run app.yaml --executor single\n"
    "  cie record -o out -- cie run app.yaml\n"
    "\n"
    "Exit codes: 0 ended as asked, 2 wrong usage or APP.yaml or its spec cannot be used, 4 "
    "nothing\n"
    "could be loaded, the spec could not be applied, or a callback threw.";

// For the signal handler. A signal that comes before the container is there is remembered.
std::atomic<Container*> running{nullptr};
std::atomic<bool> is_asked_to_stop{false};

void on_signal(int) {
  is_asked_to_stop = true;
  if (Container* const container = running; container != nullptr) container->cancel();
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  for (const int signal : {SIGINT, SIGTERM})
    sigaction(signal, &action, nullptr);
}

void say(const std::string& line) {
  static std::mutex mutex;
  const std::lock_guard lock{mutex};
  std::fprintf(stderr, "cie-run: %s\n", line.c_str());
}

std::string counted(std::size_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

// The container is there while it is the signal handler's.
class Registration {
 public:
  explicit Registration(Container& container) {
    running = &container;
    if (is_asked_to_stop) container.cancel();
  }
  Registration(const Registration&) = delete;
  Registration& operator=(const Registration&) = delete;
  ~Registration() { running = nullptr; }
};

int serve(Container& container, const AppFile& app) {
  const std::size_t loaded = container.load_all();
  if (loaded == 0) {
    say("none of the components could be loaded");
    return kFailed;
  }
  const std::size_t missing = app.components.size() - loaded;
  say(counted(loaded, "component") + " under the executor \"" +
      std::string{executor_name(app.executor)} + "\"" +
      (missing == 0 ? "" : ", " + std::to_string(missing) + " could not be loaded"));
  try {
    const Registration registration{container};
    container.run();
  } catch (const std::exception& error) {
    say(error.what());
    return kFailed;
  }
  const std::uint64_t failures = container.failures();
  if (failures == 0) return kEndedWell;
  say("callbacks ended by an exception " + counted(failures, "time"));
  return kFailed;
}

int run(const std::string& file, const std::string& executor) {
  catch_signals();
  try {
    AppFile app = AppFile::load(file);
    if (!executor.empty()) app.executor = *executor_from_name(executor);
    Container container{app, say};
    return serve(container, app);
  } catch (const SpecError& error) {
    say(error.what());
    return kUnusable;
  } catch (const std::invalid_argument& error) {
    say(error.what());
    return kUnusable;
  } catch (const std::exception& error) {
    say(error.what());
    return kFailed;
  }
}

}  // namespace
}  // namespace cie::container

int main(int argc, char** argv) {
  std::string file;
  std::string executor;
  CLI::App app{cie::container::kDescription};
  app.name("cie-run");
  app.footer(cie::container::kFooter);
  app.add_option("APP", file, "Application file (YAML)")->required();
  app.add_option("--executor", executor, "Instead of the file's: isolated, single, multi")
      ->check(CLI::IsMember({"isolated", "single", "multi"}));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : cie::container::kUnusable;
  }
  return cie::container::run(file, executor);
}
