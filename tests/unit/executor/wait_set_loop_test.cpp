#include "baselines/wait_set_loop.hpp"

#include "unit/scheduling/any_loop.hpp"

namespace cie::scheduling {
namespace {

INSTANTIATE_TYPED_TEST_SUITE_P(WaitSet, AnyLoop, executor::WaitSetLoop);

}  // namespace
}  // namespace cie::scheduling
