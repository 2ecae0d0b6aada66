#include "base/file.hpp"
#include "base/text.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "doctor.hpp"
#include "exit_code.hpp"
#include "json/json.hpp"
#include "output.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace cie::cli {
namespace {

using viewer_export::Json;

constexpr const char* kDoctorDescription =
    R"(Says whether this machine is fit to run callbacks under real-time policies, to trace and to
record them, and what to change where it is not. Nothing is changed; the scheduler is recorded
for a second, and thrown away. Rights and limits are those of the user who asks.)";

constexpr const char* kDoctorFooter =
    "Examples:\n"
    "  cie doctor                                         before the first recording\n"
    "  cie doctor --trace run1                            were the buffers large enough?\n"
    "  cie doctor -f json                                 for programs\n"
    "\n"
    "Exit codes: 0 no problem, 1 a problem was found, 2 wrong usage, 4 the\n"
    "recording is unreadable or the result not writable.\n";

std::size_t count(const std::vector<Finding>& findings, Health health) {
  return static_cast<std::size_t>(std::ranges::count(findings, health, &Finding::health));
}

constexpr std::size_t kIndent = 25;

// "health   check           what there is", and the advice below it.
void write_text(std::ostream& out, const std::vector<Finding>& findings, std::size_t columns) {
  const auto write = [&out, columns](std::string_view first, std::string_view text) {
    std::string indent(first);
    for (const auto& line : viewer_export::wrap(text, columns - kIndent)) {
      out << fmt::format("{:<{}}{}\n", indent, kIndent, line);
      indent.clear();
    }
  };
  for (const auto& finding : findings) {
    write(fmt::format("{:<9}{}", label(finding.health), finding.id), finding.what);
    if (!finding.advice.empty()) write("", "-> " + finding.advice);
  }
  out << fmt::format("problems: {}, warnings: {}, fine: {}\n", count(findings, Health::problem),
                     count(findings, Health::warning), count(findings, Health::ok));
}

void write_json_of(std::ostream& out, const std::vector<Finding>& findings) {
  Json checks = Json::array();
  for (const auto& finding : findings) {
    checks.push_back({{"id", finding.id},
                      {"health", label(finding.health)},
                      {"finding", finding.what},
                      {"advice", finding.advice.empty() ? Json(nullptr) : Json(finding.advice)}});
  }
  viewer_export::write_json(out, {{"schema", "cie.doctor/1"},
                                  {"problems", count(findings, Health::problem)},
                                  {"warnings", count(findings, Health::warning)},
                                  {"checks", std::move(checks)}});
}

// What `cie-record --try-kernel` prints. Throws std::runtime_error.
std::string kernel_trial() {
  const auto command = shell_quoted(program_path("cie-record")) + " --try-kernel";
  const Pipe pipe(::popen(command.c_str(), "re"));
  if (!pipe) throw std::runtime_error("cie-record cannot be started");
  std::string text;
  std::array<char, 4096> part{};
  while (const auto size = std::fread(part.data(), 1, part.size(), pipe.get()))
    text.append(part.data(), size);
  return text;
}

// Whether the scheduler can be recorded is tried, where this machine is the one in question. That
// takes the recorder.
void try_kernel_events(std::vector<Finding>& findings) {
  findings.insert(findings.begin(), examine_recorder(find_program("cie-record")));
  if (findings.front().health != Health::ok) return;
  const auto promised = std::ranges::find(findings, "kernel-events", &Finding::id);
  try {
    *promised = examine_kernel_trial(kernel_trial(), *promised);
  } catch (const std::exception& error) {
    promised->what += fmt::format("; not tried: {}", error.what());
  }
}

}  // namespace

int doctor_command(const Arguments& arguments) {
  std::string recording;
  std::string root = "/";
  std::string format = "text";
  std::string target = "-";
  CommandLine line({"cie doctor [OPTIONS]", kDoctorDescription, kDoctorFooter});
  line.option("--trace", "DIR", recording,
              "Also hold the buffers of this recording against what it recorded");
  line.option("--root", "DIR", root, "Read the files below DIR in place of this machine's");
  line.option("-f,--format", "FORMAT", format, "text (default) or json");
  line.option("-o,--output", "FILE", target, "Write to FILE instead of standard output");
  if (!line.parse(arguments)) return ok;
  check_choice("--format", format, {"text", "json"});

  if (!std::filesystem::is_directory(root)) {
    throw UsageError("--root: there is no directory \"" + root + '"');
  }

  auto findings = examine(Machine(root));
  if (root == "/") try_kernel_events(findings);
  if (!recording.empty()) findings.push_back(examine_buffers(recording));
  auto output = open_output(target);
  write_data(output, [&](std::ostream& out) {
    format == "json" ? write_json_of(out, findings)
                     : write_text(out, findings, screen_style(output).columns);
  });
  return count(findings, Health::problem) > 0 ? violation : ok;
}

}  // namespace cie::cli
