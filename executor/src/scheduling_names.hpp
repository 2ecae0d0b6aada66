// The names of cie::scheduling, in which this library is written as in its own.
#pragma once

namespace cie::scheduling {}

namespace cie::executor {
using namespace scheduling;
}
