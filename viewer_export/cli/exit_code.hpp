// Exit codes, the same for every subcommand.
#pragma once

#include <cie/analysis/verdict.hpp>

#include "base/program.hpp"

#include <cstdint>
#include <string>

namespace cie::cli {

enum ExitCode : std::uint8_t {
  ok = kSuccess,
  violation = 1,
  usage_error = kWrongUsage,  // also a spec that cannot be used
  inconclusive = 3,
  unreadable = kFailed  // also output that cannot be written, and errors of ours
};

// What --inconclusive asks for.
enum class OnInconclusive : std::uint8_t { report, warn, fail };

// Empty: it does not ask. Throws UsageError for what it does not know.
OnInconclusive on_inconclusive(const std::string& choice);

// An unreadable trace (T1) wins over everything, and one of which a part was not read is never
// waived by OnInconclusive::warn.
int exit_code(const analysis::VerdictReport& verdicts, OnInconclusive on_inconclusive);

}  // namespace cie::cli
