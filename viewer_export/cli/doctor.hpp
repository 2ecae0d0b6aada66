// Whether a machine is fit to run, trace and record callbacks, and what to change where it is not.
#pragma once

#include "machine.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::cli {

// problem: something does not work; warning: it works, and something is worse than it could be.
enum class Health : std::uint8_t { ok, warning, problem };
std::string_view label(Health health) noexcept;

struct Finding {
  std::string_view id;  // stable, "clock-source"
  Health health = Health::ok;
  std::string what;    // what there is
  std::string advice;  // what to change; empty if ok
};

// Every check of the machine, in a fixed order. Nothing is changed. The kernel's events are judged
// by what the kernel and this user's rights promise.
std::vector<Finding> examine(const Machine& machine);

// Whether there is a `cie-record`, where, and what to install if not.
Finding examine_recorder(const std::optional<std::string>& program);

// The finding about the kernel's events by what was seen when they were recorded for a moment, in
// place of what was `promised`. `trial` is what `cie-record --try-kernel` prints, a line of
// cie.kernel-trial/1. Throws std::runtime_error if it is none.
Finding examine_kernel_trial(const std::string& trial, const Finding& promised);

// Whether the buffers of a recording are large enough for what they recorded, from its manifest and
// its files. Throws std::runtime_error if it is no recording of `cie record`.
Finding examine_buffers(const std::filesystem::path& recording);

}  // namespace cie::cli
