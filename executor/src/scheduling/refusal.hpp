// Why the kernel refused a request, in words: the cause by its name, and the remedy.
#pragma once

#include <cie/scheduling/kernel_view.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include <cstdint>
#include <string>

namespace cie::scheduling {

// These begin with the kernel's own word for `error`: "Operation not permitted (CAP_SYS_NICE is …)".
// The calling thread is the one that was refused, or asked for another.
std::string why_policy_refused(int error, const ThreadParameters& asked, const KernelView& kernel);
std::string why_affinity_refused(int error, const KernelView& kernel);
std::string why_memory_lock_refused(int error, const KernelView& kernel);

// Without the kernel's word: why it gave no thread.
std::string why_no_thread(int error, const KernelView& kernel);

// "… (remedy)".
std::string refused(int error, const std::string& remedy);

}  // namespace cie::scheduling
