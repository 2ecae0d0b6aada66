// One application on two hosts: names, pids, tids and ids of both are the same, times are not.
#pragma once

#include "support/move_to_host.hpp"
#include "support/trace_text.hpp"

#include <string>

namespace cie::test {

// On CPU 0 of "robot" `plan` responds in 2 and is more urgent than `show`, which responds in 3; on
// that of "desk" in 52 and 90, and it is the other way around. `idle` never runs.
inline TextTrace application_on_two_hosts() {
  const std::string application = R"(
    process app pid=100
    publisher out topic=/a
    callback plan timer period=100 cpu=0
    callback show subscription topic=/a cpu=0
    callback idle service
    1 initial plan
    2 initial show)";
  const auto robot = trace_of(application + R"(
    3 applied plan policy=fifo priority=80 cpus=0
    4 applied show policy=fifo priority=70 cpus=0
    10 start plan release=10
    11 publish out on=plan
    12 end plan
    15 start show release=14 from=out:0
    17 end show)");
  const auto desk = trace_of(application + R"(
    3 applied plan policy=fifo priority=60 cpus=0
    4 applied show policy=fifo priority=70 cpus=0
    20 start plan release=20
    25 publish out on=plan
    72 end plan
    130 start show release=100 from=out:0
    190 end show)");
  return beside(robot, desk, {.name = "desk", .monotonic = 5'000'000, .realtime = 300});
}

}  // namespace cie::test
