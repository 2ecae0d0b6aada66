// What a thread ran as after its parameters first changed, and what started on it meanwhile.
#pragma once

#include "facts.hpp"

#include <cstdint>

namespace cie::analysis {

// A read-back that the thread's facts do not have yet, and that is none older than those they have.
void note_in_force(const Model& model, ThreadFacts& thread, const ReadBack& read_back);

// Starts on the thread since its last read-back, so many of all. `next`: the read-back that follows; null: none.
void note_starts_in_force(const Model& model, const ThreadFacts& thread, std::uint64_t starts,
                          const ReadBack* next, InForce& in_force);

}  // namespace cie::analysis
