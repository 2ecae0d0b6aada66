// The kernel's scheduler, recorded beside a session that writes into a directory.
#pragma once

#include "keeping/tracing.hpp"
#include "kernel/kernel_recording.hpp"

#include <memory>
#include <string>

namespace cie::record {

// As the options ask for it, into the directory of that name below the recording's; null: not at
// all, or it cannot be, which the manifest then explains. Throws RecordError if it must be.
std::unique_ptr<KernelRecording> start_kernel(const std::string& name, Tracing& tracing);

// Gives it the clock of the user-space trace as soon as that is known. Null is allowed here and
// below. Problems are the manifest's.
void adopt_clock(KernelRecording* kernel, Tracing& tracing);

// Stops it. The manifest has what was recorded.
void end_kernel(std::unique_ptr<KernelRecording> kernel, Tracing& tracing);

}  // namespace cie::record
