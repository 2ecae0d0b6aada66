// cie-record: records a run with LTTng into a directory.
#include "base/messages.hpp"
#include "keeping/flight_recorder.hpp"
#include "keeping/outcome.hpp"
#include "kernel/kernel_trial.hpp"
#include "options/command_line.hpp"
#include "record.hpp"
#include "system/error.hpp"

#include <chrono>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <unistd.h>

namespace {

constexpr int kUsage = 2;

}  // namespace

int main(int argc, char** argv) {
  try {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    cie::record::ParsedCommandLine parsed =
        cie::record::parse_command_line(arguments, geteuid() == 0);
    if (parsed.save) {
      std::printf("%s\n", cie::record::ask_to_save(*parsed.save, parsed.save_reason).c_str());
      return 0;
    }
    if (parsed.is_kernel_trial) {
      const auto text = cie::record::kernel_trial_json(parsed.options->kernel_route,
                                                       parsed.options->kernel_buffer_size,
                                                       std::chrono::seconds(1));
      std::printf("%s\n", text.c_str());
      return 0;
    }
    if (!parsed.options) {
      std::fputs(parsed.text.c_str(), stdout);
      return 0;
    }
    if (parsed.options->live_socket >= 0) {
      return cie::record::stream_live(*parsed.options) ? 0 : cie::record::kFailed;
    }
    return cie::record::record(*parsed.options);
  } catch (const cie::record::UsageError& error) {
    cie::tell_wrong_usage(error.what(), "cie record");
    return kUsage;
  } catch (const std::exception& error) {
    cie::tell(error.what());
    return cie::record::kFailed;
  }
}
