#include <cie/tracepoints/scheduling_spec.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "output.hpp"
#include "text_layout.hpp"

#include <fmt/format.h>

namespace cie::cli {
namespace {

constexpr const char* kDescription =
    "Works on scheduling specs: what each callback's thread is meant to run as.\n"
    "ACTION is check: reads FILE as cie run and cie verify do, and says what it holds or where it\n"
    "is wrong. (template, which writes a spec from a trace, is not available in this version.)";

constexpr const char* kFooter =
    "Example:\n"
    "  cie spec check app.yaml\n"
    "\n"
    "Exit codes: 0 the spec can be used, 2 it cannot or wrong usage, 4 result not writable.\n";

}  // namespace

int spec_command(const Arguments& arguments) {
  std::string action;
  std::string file;
  CommandLine line({"cie spec check FILE", kDescription, kFooter});
  line.argument("ACTION", action, "check");
  line.argument("FILE", file, "Scheduling spec (YAML)");
  if (!line.parse(arguments)) {
    return ok;
  }
  if (action.empty()) {
    throw UsageError("no ACTION was given; available: check");
  }
  check_choice("spec", action, {"check"}, {"template"});
  if (file.empty()) {
    throw UsageError("no FILE was given: name the spec to check");
  }
  const auto spec = SchedulingSpec::load(file);
  auto output = open_output("-");
  output.stream() << fmt::format(
      "{}: good: {}, {}, {}; sha256 {}\n", viewer_export::printable(spec.name()),
      viewer_export::counted(spec.callbacks().size(), "callback"),
      viewer_export::counted(spec.threads().size(), "thread"),
      viewer_export::counted(spec.chains().size(), "chain"), spec.sha256());
  output.commit();
  return ok;
}

}  // namespace cie::cli
