// The state events of one object each, filled in from what the registry knows.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include "process_info.hpp"
#include "state.hpp"

#include <string>

namespace cie::trace {

void emit_run_begin(const ProcessInfo& process, ExecutorKind executor,
                    const std::string& spec_sha256, RunMoment moment) noexcept;
void emit_clock_sync() noexcept;

void emit_init(const CallbackState& callback) noexcept;
void emit_init(const PublisherState& publisher) noexcept;
void emit_init(const ThreadState& thread) noexcept;
void emit_sched(const ThreadState& thread, const SchedRecord& record) noexcept;

void emit_fini(const CallbackState& callback) noexcept;
void emit_fini(const PublisherState& publisher) noexcept;
void emit_fini(const ThreadState& thread) noexcept;

}  // namespace cie::trace
