// The subcommands of `cie`. Each takes its arguments without the program's and its own name, and
// returns the exit code. Errors leave as exceptions; main.cpp turns them into messages and codes.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cie::cli {

using Arguments = std::vector<std::string>;

int report_command(const Arguments& arguments);
int events_command(const Arguments& arguments);
int instances_command(const Arguments& arguments);
int verify_command(const Arguments& arguments);
int export_command(const Arguments& arguments);
int spec_command(const Arguments& arguments);
int diff_command(const Arguments& arguments);
int live_command(const Arguments& arguments);
int view_command(const Arguments& arguments);
int analyze_command(const Arguments& arguments);
int doctor_command(const Arguments& arguments);

// The package that has `cie-record` and the other programs of cie but cie-live.
inline constexpr std::string_view kRobotPackage = "cie-robot";
// Path of `cie-record` or another program of cie's: beside this one, or in PATH. Throws
// std::runtime_error when it is not installed.
std::string program_path(const std::string& name);
// The same; empty if it is not installed.
std::optional<std::string> find_program(const std::string& name);

// Replaces this process by such a program. Returns only by throwing std::runtime_error when it is
// not installed.
[[noreturn]] void start_program(const std::string& name, const Arguments& arguments);

struct Command {
  std::string_view name;
  std::string_view summary;
  int (*run)(const Arguments&);  // null: a program of its own, cie-NAME
};
// In the order of a newcomer's work.
std::span<const Command> commands();

}  // namespace cie::cli
