#include "any_loop.hpp"

#include <cie/scheduling/events_loop.hpp>
#include <cie/scheduling/pool_loop.hpp>
#include <cie/scheduling/serial_loop.hpp>

namespace cie::scheduling {
namespace {

using Loops = testing::Types<SerialLoop, EventsLoop, PoolLoop>;
INSTANTIATE_TYPED_TEST_SUITE_P(Scheduling, AnyLoop, Loops);

}  // namespace
}  // namespace cie::scheduling
