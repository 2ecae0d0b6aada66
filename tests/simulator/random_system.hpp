// Random systems. rapidcheck draws their shape, which it can shrink; what fills it follows from the
// seed.
#pragma once

#include "system.hpp"

#include <cstdint>
#include <iosfwd>

#include <rapidcheck.h>

namespace cie::sim {

struct Shape {
  int cpus = 1;
  int processes = 1;
  int timers = 1;
  int subscriptions = 0;
  int loads = 0;
  int mutexes = 0;
  int pool = 0;               // threads that share all callbacks of a process; 0: isolated ones
  int utilization = 50;       // of all processors, in percent: roughly what is asked of them
  bool is_reentrant = false;  // groups of pooled callbacks
  bool is_vague = false;      // some callbacks do not tell their release or the message they take
  bool has_policies = true;   // else SCHED_OTHER everywhere
  std::uint64_t seed = 0;
};
void showValue(const Shape& shape, std::ostream& out);

// Anything: overload, starvation, lost releases and overwritten samples included.
rc::Gen<Shape> shapes();
// Isolated, with room to spare: most of these keep every rule.
rc::Gen<Shape> calm_shapes();

System system_of(const Shape& shape);

}  // namespace cie::sim
