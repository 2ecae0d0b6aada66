// `cie live`, which `cie` starts: it alone needs libbabeltrace2 and ncurses.
#include <cie/viewer_export/version.hpp>

#include "program.hpp"

#include <algorithm>

#include <babeltrace2/babeltrace.h>
#include <fmt/core.h>

int main(int argc, char** argv) {
  using namespace cie::cli;
  reserve_standard_descriptors();
  const Arguments arguments(argv + std::min(argc, 1), argv + argc);
  turn_signals_into_errors();
  if (!arguments.empty() && arguments.front() == "--version") {
    return print_text(fmt::format("cie-live {}\nlibbabeltrace2 {}.{}.{}\n",
                                  cie::viewer_export::tool_version(), bt_version_get_major(),
                                  bt_version_get_minor(), bt_version_get_patch()));
  }
  return run_command(live_command, arguments, "cie live");
}
