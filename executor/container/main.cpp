// cie-run: the component container. `cie run` starts it.
#include <cie/executor/cancel_on_signals.hpp>
#include <cie/executor/on_hangup.hpp>
#include <cie/tracepoints/utf8.hpp>

#include "app_file.hpp"
#include "base/help_text.hpp"
#include "base/program.hpp"
#include "base/text.hpp"
#include "container.hpp"
#include "control.hpp"
#include "end_in_time.hpp"
#include "parameter_orders.hpp"
#include "parameter_overrides.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace cie::container {
namespace {

constexpr const char* kDescription =
    "Runs the components that APP.yaml names, by default every callback on a thread of its own,\n"
    "until SIGINT or SIGTERM. With --control, gives an order to a container that runs:\n"
    "  list                   its components: name, class, library\n"
    "  param list [NODE]      parameters of one component or of all, with their values\n"
    "  param get NODE NAME, param set NODE NAME VALUE, param describe NODE NAME\n"
    "  reload                 the spec's file, as SIGHUP does";
constexpr const char* kFooter =
    R"(Example:
  cie run app.yaml --executor single
  cie record -o out -- cie run app.yaml
  cie run --control param get /example/talker period_ms

Exit codes: 0 ended as asked, 2 wrong usage or APP.yaml or its spec cannot be used, 4 nothing
could be loaded, the spec could not be applied, a callback threw, or an order was not followed.)";

// Its lines stay; what else controls a terminal does not.
std::string printable_lines(std::string_view text) {
  std::string lines;
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    lines += printable(text.substr(0, end));
    if (end < text.size()) lines += '\n';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

void say(const std::string& text) {
  static std::mutex mutex;
  const std::lock_guard lock{mutex};
  std::fprintf(stderr, "cie-run: %s\n", printable_lines(text).c_str());
}

Answer unusable(const std::string& text) { return {.exit_code = kWrongUsage, .text = text + "\n"}; }

// What an order of another terminal comes to.
Answer follow(Container& container, const std::vector<std::string>& words) noexcept {
  try {
    const std::string order = words.empty() ? "" : words.front();
    if (order == "list" && words.size() == 1) return {.text = container.list()};
    if (order == "reload" && words.size() == 1) return {.text = container.reload_spec()};
    if (order == "param") {
      return {.text = follow_parameter_order(container, {words.begin() + 1, words.end()})};
    }
    return unusable("no such order: list, reload and param … are known");
  } catch (const SpecError& error) {
    return unusable(error.what());
  } catch (const std::invalid_argument& error) {
    return unusable(error.what());
  } catch (const std::exception& error) {
    std::string text = error.what();
    if (!text.ends_with('\n')) text += '\n';
    return {.exit_code = kFailed, .text = text};
  }
}

int give_order(int pid, const std::vector<std::string>& words) {
  try {
    const Answer answer = send_order(pid, words);
    std::fputs(printable_lines(answer.text).c_str(), answer.exit_code == 0 ? stdout : stderr);
    return answer.exit_code;
  } catch (const std::invalid_argument& error) {
    say(error.what());
    return kWrongUsage;
  } catch (const std::exception& error) {
    say(error.what());
    return kFailed;
  }
}

// Null without a spec: SIGHUP then ends the process, as it does others.
std::unique_ptr<OnHangup> reload_on_hangup(Container& container) {
  if (!container.has_spec()) return nullptr;
  return std::make_unique<OnHangup>([&container] {
    try {
      container.reload_spec();
    } catch (const std::exception&) {
      // It was said already, and the former spec stays in force.
    }
  });
}

// Null if it cannot be; the components run all the same.
std::unique_ptr<ControlServer> listen_for_orders(Container& container) {
  try {
    return std::make_unique<ControlServer>(
        [&container](const auto& words) { return follow(container, words); });
  } catch (const std::exception& error) {
    say("no orders are taken: " + std::string{error.what()});
    return nullptr;
  }
}

int serve(Container& container, const AppFile& app, CancelOnSignals& signals, EndInTime& end) {
  const std::size_t loaded = container.load_all();
  if (loaded == 0) {
    say("none of the components could be loaded");
    return kFailed;
  }
  try {
    container.cancel_on(signals);
    const auto control = listen_for_orders(container);
    const auto hangup = reload_on_hangup(container);
    const std::size_t missing = app.components.size() - loaded;
    say(fmt::format("{} under the executor \"{}\"{}", counted(loaded, "component"), app.executor,
                    missing == 0 ? "" : fmt::format(", {} could not be loaded", missing)));
    const EndInTime::Patience patience{end};
    container.run();
  } catch (const std::exception& error) {
    say(error.what());
    return kFailed;
  }
  const std::uint64_t failures = container.failures();
  if (failures == 0) return kSuccess;
  say("callbacks ended by an exception " + counted(failures, "time"));
  return kFailed;
}

// What the command line says.
struct Arguments {
  std::string file;
  std::string executor;
  std::vector<std::string> parameters;
  std::vector<std::string> parameter_files;
};

int run(const Arguments& arguments) {
  try {
    CancelOnSignals signals;  // first: a signal that comes while components load counts
    EndInTime end;
    AppFile app = AppFile::load(arguments.file);
    if (!arguments.executor.empty()) app.executor = arguments.executor;
    for (const std::string& file : arguments.parameter_files)
      override_parameters(app, file);
    for (const std::string& assignment : arguments.parameters)
      override_parameter(app, assignment);
    if (app.spec) hold_hangups();
    std::optional<EndInTime::Patience> patience;  // beyond the container
    Container container{app, say};
    const int code = serve(container, app, signals, end);
    patience.emplace(end);  // components end in their own time
    return code;
  } catch (const SpecError& error) {
    say(error.what());
    return kWrongUsage;
  } catch (const std::invalid_argument& error) {
    say(error.what());
    return kWrongUsage;
  } catch (const std::exception& error) {
    say(error.what());
    return kFailed;
  }
}

int command_line(const std::vector<std::string>& words) {
  Arguments arguments;
  CLI::App app{kDescription};
  app.name("cie-run");
  app.footer(kFooter);
  lay_out_help(app,
               "cie run APP.yaml [OPTIONS]\n       cie run --control ORDER [ARG...] [--pid PID]");
  std::vector<std::string> order;
  int pid = 0;
  auto* const application =
      app.add_option("APP", arguments.file, "Application file (YAML)")->type_name("");
  auto* const control = app.add_option("--control", order, "Give an order to a running container")
                            ->option_text("ORDER")
                            ->expected(1, -1);
  control->excludes(application);
  app.add_option("--pid", pid, "With --control: the container's process id, if several run")
      ->option_text("PID")
      ->check(CLI::Range(1, std::numeric_limits<int>::max()))
      ->needs(control);
  app.add_option("--executor", arguments.executor,
                 fmt::format("Instead of the file's: {}", fmt::join(cie::kExecutorNames, ", ")))
      ->option_text("NAME")
      ->check(one_of({cie::kExecutorNames.begin(), cie::kExecutorNames.end()}));
  app.add_option("-p,--parameter", arguments.parameters,
                 "A parameter's value, instead of the file's: /example/talker:period_ms:=50")
      ->type_name("NODE:NAME:=VALUE")
      ->allow_extra_args(false);
  app.add_option("--params-file", arguments.parameter_files,
                 "A parameter file of ROS 2, read before -p")
      ->type_name("FILE")
      ->allow_extra_args(false);
  if (const auto help = parse_arguments(app, words)) {
    std::fputs(help->c_str(), stdout);
    return kSuccess;
  }
  if (arguments.file.empty() && order.empty())
    throw UsageError("no APP was given: name an application file (YAML)");
  if (!order.empty()) return give_order(pid, order);
  return run(arguments);
}

}  // namespace
}  // namespace cie::container

int main(int argc, char** argv) {
  return cie::run_program("cie run", "cie-run", [&] {
    return cie::container::command_line({argv + 1, argv + argc});
  });
}
