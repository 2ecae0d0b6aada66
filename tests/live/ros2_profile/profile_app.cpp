// An application that does a known number of everything, by the facade alone: of the node
// /robot/arm a timer (5 instances), a subscription (7), a service (3), a client (2) and a waitable (2).
// The timer's thread publishes 7 messages on /robot/angle, which the subscription takes.
//
//   profile_app [FILE]     FILE: writes it when everything is registered, and waits for its removal
//                          between two of everything
#include <cie/tracepoints/trace.hpp>

#include <chrono>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#ifdef CIE_TEST_PROVIDER_ROS2
// What a program that links ROS 2's own tracepoints has.
extern "C" int lttng_ust_tracepoint_provider_ros2;
int lttng_ust_tracepoint_provider_ros2 = 0;
#endif

namespace {

namespace trace = cie::trace;

struct Arm {
  trace::Run run{cie::ExecutorKind::isolated, ""};
  trace::Node node{"/robot/arm"};
  trace::Group group{node.id(), cie::GroupType::mutually_exclusive};
  trace::Publisher publisher{node.id(), "/robot/angle", 0x0102030405060708, 9};
  trace::Callback timer{info(cie::CallbackKind::timer, "")};
  trace::Callback subscription{info(cie::CallbackKind::subscription, "/robot/angle")};
  trace::Callback service{info(cie::CallbackKind::service, "/robot/reset")};
  trace::Callback client{info(cie::CallbackKind::client, "/robot/calibrate")};
  trace::Callback waitable{info(cie::CallbackKind::waitable, "")};

  trace::CallbackInfo info(cie::CallbackKind kind, const std::string& source) const {
    trace::CallbackInfo info;
    info.group = group.id();
    info.node = node.id();
    info.kind = kind;
    info.source = source;
    info.symbol = "Arm::" + std::string(cie::label(kind));
    info.logical_id = "/robot/arm@" + info.symbol;
    info.period_ns = kind == cie::CallbackKind::timer ? 2'000'000 : 0;
    info.queue_depth = kind == cie::CallbackKind::subscription ? 4 : 0;
    return info;
  }
};

void run(trace::Callback& callback, const trace::Callback::Release& release = {}) {
  trace::thread_wait(trace::kWaitForever);
  trace::thread_wakeup(callback.id(), cie::WakeupReason::data);
  const std::uint64_t seq = callback.start(release);
  callback.end(seq, cie::CallbackStatus::ok);
}

void do_everything(Arm& arm) {
  std::vector<std::int64_t> stamps;
  for (int i = 0; i < 5; ++i) {
    const std::uint64_t seq = arm.timer.start({.kind = cie::ReleaseKind::timer});
    for (int message = i == 0 ? 3 : 1; message > 0; --message) {
      stamps.push_back(arm.publisher.publish());
    }
    arm.timer.end(seq, cie::CallbackStatus::ok);
  }
  for (const std::int64_t stamp : stamps) {
    run(arm.subscription, {.kind = cie::ReleaseKind::data, .source_timestamp_realtime_ns = stamp});
  }
  for (int i = 0; i < 3; ++i)
    run(arm.service);
  for (int i = 0; i < 2; ++i) {
    run(arm.client);
    run(arm.waitable);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Arm arm;
    const trace::Thread thread{cie::ThreadRole::pool, cie::kNoCallback, arm.group.id(), "arm"};
    if (argc > 1) {
      const std::filesystem::path file = argv[1];
      std::ofstream{file};
      while (exists(file))
        std::this_thread::sleep_for(std::chrono::milliseconds{5});
    }
    do_everything(arm);
    if (argc > 1) std::this_thread::sleep_for(std::chrono::seconds{20});
    return 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 3;
  }
}
