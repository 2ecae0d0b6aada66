// The reading side of run_guarded(): a sign of life that costs one relaxed store.
#pragma once

namespace cie::analysis {

// Called by readers whenever they got somewhere.
void guard_tick() noexcept;
// Called when reading is over: what follows may take its time.
void guard_reading_ended() noexcept;

}  // namespace cie::analysis
