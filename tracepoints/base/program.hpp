// How programs that parse with CLI11 begin and end.
#pragma once

#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace cie {

// Exit codes of every program; what else one has, its help tells.
inline constexpr int kSuccess = 0;
inline constexpr int kWrongUsage = 2;  // also a file or spec that was named and cannot be used
inline constexpr int kFailed = 4;

// A command line that cannot be carried out as written; what() says which part and what to do.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The help or the version, if that was asked for: for standard output. Throws UsageError, in the
// words of the help, also for what no option takes.
std::optional<std::string> parse_arguments(CLI::App& app,
                                           const std::vector<std::string>& arguments);

// Runs `body`, which returns the exit code. What it throws is told on standard error: a UsageError
// as that of `command` ("cie record"), others as `speaker`'s.
int run_program(std::string_view command, std::string_view speaker,
                const std::function<int()>& body);

}  // namespace cie
