// What explains that a response took longer than its bound.
#pragma once

#include "task_model.hpp"

namespace cie::analysis {

// Of a task whose longest response is above its bound: what is known to have lengthened that, whether it
// is all, and why its deadline is undecided if it is. Else nothing.
void explain_excess(const TaskModel& model, Task& task);

}  // namespace cie::analysis
