#include "parameters_in_force.hpp"

#include <algorithm>
#include <tuple>

namespace cie::analysis {
namespace {

constexpr std::size_t kMostKept = 1024;

// Everything that a spec may ask for; another change of them is another reason to ask.
bool is_alike(const ReadBack& a, const ReadBack& b) {
  const auto key = [](const ReadBack& read) {
    return std::tie(read.policy, read.nice, read.priority, read.runtime_ns, read.deadline_ns,
                    read.period_ns, read.cpus, read.slice_ns, read.util_min, read.util_max,
                    read.change);
  };
  return key(a) == key(b);
}

// What later read-backs are compared with while none differs from it.
const ReadBack* first_configuration(const ThreadFacts& thread) {
  if (!thread.applied.empty()) return &thread.applied.front();
  return thread.first_audit ? &*thread.first_audit : nullptr;
}

// An audit that tells that the parameters change now: until the next `applied` any may be in force.
bool is_changing(const ThreadFacts& thread, const ReadBack& read_back) {
  if (read_back.moment != SchedMoment::audit) return false;
  const auto* last = thread.first_audit ? &*thread.first_audit : nullptr;
  if (is_given_parameters(thread)) last = &thread.applied.back();
  return last != nullptr && read_back.change > last->change;
}

// The last start on the thread since then, of the callback that it was announced for if that ran.
std::optional<InForce::Start> last_start(const Model& model, const ThreadFacts& thread,
                                         Timestamp since) {
  std::optional<InForce::Start> found;
  for (const auto* pair : thread.ran) {
    const auto& callback = model.callbacks[at(pair->callback)];
    const auto& where = callback.starts.last_at;
    const bool is_here = callback.starts.last && where.tid && *where.tid == thread.tid;
    if (!is_here || where.time < since) continue;
    found = InForce::Start{
        .callback = pair->callback, .seq = *callback.starts.last, .at = where, .is_certain = false};
    if (thread.callback == callback.id) break;
  }
  return found;
}

}  // namespace

void note_starts_in_force(const Model& model, const ThreadFacts& thread, std::uint64_t starts,
                          const ReadBack* next, InForce& in_force) {
  const auto& last = *thread.last_read_back;
  if (starts <= last.starts_before) return;
  auto start = last_start(model, thread, last.at.time);
  // Events of two CPUs have no order within a nanosecond.
  const bool is_between =
      start && last.at.time < start->at.time && (next == nullptr || start->at.time < next->at.time);
  const bool is_certain = is_between && (next == nullptr || next->n == last.n + 1);
  const bool was_certain = in_force.start && in_force.start->is_certain;
  if (was_certain && !is_certain) return;
  if (is_certain && !was_certain) in_force.starts = 0;  // of these alone
  in_force.starts += starts - last.starts_before;
  if (was_certain || !start) return;
  start->is_certain = is_certain;
  in_force.start = start;
}

void note_in_force(const Model& model, ThreadFacts& thread, const ReadBack& read_back) {
  auto& all = thread.in_force;
  auto* open = all.empty() || all.back().until ? nullptr : &all.back();
  if (open != nullptr)
    note_starts_in_force(model, thread, read_back.starts_before, &read_back, *open);
  const bool is_known = read_back.moment != SchedMoment::initial && !is_changing(thread, read_back);
  if (open != nullptr && is_known && is_alike(open->since, read_back)) return;
  if (open != nullptr) open->until = read_back.at.time;
  const auto* first = first_configuration(thread);
  const bool is_first = first == nullptr || (all.empty() && is_alike(*first, read_back));
  if (!is_known || is_first) return;
  if (all.size() < kMostKept) {
    all.push_back({.since = read_back});
  } else {
    thread.is_in_force_cut = true;
  }
}

}  // namespace cie::analysis
