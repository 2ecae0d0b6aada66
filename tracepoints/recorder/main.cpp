// cie-record: records a run with LTTng into a directory.
#include "base/program.hpp"
#include "keeping/flight_recorder.hpp"
#include "kernel/kernel_trial.hpp"
#include "options/command_line.hpp"
#include "record.hpp"

#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include <unistd.h>

namespace {

using namespace cie::record;

int run(const std::vector<std::string>& arguments) {
  const ParsedCommandLine parsed = parse_command_line(arguments, geteuid() == 0);
  if (parsed.save) {
    std::printf("%s\n", ask_to_save(*parsed.save, parsed.save_reason).c_str());
    return cie::kSuccess;
  }
  if (parsed.is_kernel_trial) {
    const auto text = kernel_trial_json(
        parsed.options->kernel_route, parsed.options->kernel_buffer_size, std::chrono::seconds(1));
    std::printf("%s\n", text.c_str());
    return cie::kSuccess;
  }
  if (!parsed.options) {
    std::fputs(parsed.text.c_str(), stdout);
    return cie::kSuccess;
  }
  if (parsed.options->live_socket >= 0) {
    return stream_live(*parsed.options) ? cie::kSuccess : cie::kFailed;
  }
  return record(*parsed.options);
}

}  // namespace

int main(int argc, char** argv) {
  return cie::run_program("cie record", "cie", [&] { return run({argv + 1, argv + argc}); });
}
