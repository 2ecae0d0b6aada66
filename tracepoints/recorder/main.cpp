// cie-record: records a run with LTTng into a directory.
#include "flight_recorder.hpp"
#include "live_stream.hpp"
#include "options.hpp"
#include "recording.hpp"

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <unistd.h>

namespace {

constexpr int kUsage = 2;
constexpr int kFailed = 4;

int fail(int status, const std::string& text) {
  std::fprintf(stderr, "cie record: %s\n", text.c_str());
  return status;
}

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
    if (!parsed.options) {
      std::fputs(parsed.text.c_str(), stdout);
      return 0;
    }
    if (parsed.options->live_socket >= 0) {
      return cie::record::stream_live(std::move(*parsed.options)) ? 0 : kFailed;
    }
    cie::record::Recording recording(std::move(*parsed.options));
    return recording.run() ? 0 : kFailed;
  } catch (const cie::record::UsageError& error) {
    return fail(kUsage, error.what());
  } catch (const std::exception& error) {
    return fail(kFailed, error.what());
  }
}
