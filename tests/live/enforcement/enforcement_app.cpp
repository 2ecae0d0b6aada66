// 24 callbacks in one process, under a spec: enforcement_app SPEC REPORT [AUDIT-PERIOD-MS]. Runs
// until SIGTERM and then prints how often each callback ran; SIGHUP has it read SPEC again. It
// writes its process id to REPORT once all of them did run, and exits with 3 if its spec is
// refused.
#include <cie/executor/executor.hpp>
#include <cie/executor/on_hangup.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <cie_messages.hpp>
#include <unistd.h>

namespace {

using namespace std::chrono_literals;

constexpr std::size_t kPairs = 12;  // of a timer and a subscription
constexpr int kRefused = 3;

std::atomic<cie::Executor*> running{nullptr};

void on_terminate(int) {
  if (cie::Executor* const executor = running; executor != nullptr) executor->cancel();
}

struct Counts {
  std::array<std::atomic<long>, kPairs> timers{};
  std::array<std::atomic<long>, kPairs> subscriptions{};

  bool did_all_run() const {
    for (std::size_t i = 0; i < kPairs; ++i) {
      if (timers[i] == 0 || subscriptions[i] == 0) return false;
    }
    return true;
  }
  void print() const {
    for (std::size_t i = 0; i < kPairs; ++i)
      std::printf("ran %ld %ld\n", timers[i].load(), subscriptions[i].load());
  }
};

void say(const std::string& text) { std::fprintf(stderr, "enforcement_app: %s\n", text.c_str()); }

int run(const char* spec, const char* report, const char* audit_period_ms) {
  cie::hold_hangups();
  Counts counts;
  const cie::Context context;
  cie::Node node{context, "app", "/enforced"};
  std::array<std::shared_ptr<cie::Publisher<cie_msgs::Sample>>, kPairs> publishers;
  std::vector<std::shared_ptr<void>> callbacks;
  for (std::size_t i = 0; i < kPairs; ++i) {
    const std::string topic = "topic" + std::to_string(i);
    publishers[i] = node.create_publisher<cie_msgs::Sample>(topic, 10);
    callbacks.push_back(node.create_subscription<cie_msgs::Sample>(
        topic, 10, [&counts, i](const cie_msgs::Sample&) { ++counts.subscriptions[i]; }));
    // Periods that differ, so that the ids do.
    callbacks.push_back(node.create_wall_timer(20ms + std::chrono::microseconds{i},
                                               [&counts, i, publisher = publishers[i]] {
                                                 ++counts.timers[i];
                                                 publisher->publish(cie_msgs::Sample{});
                                               }));
  }
  cie::ExecutorOptions options;
  options.spec = std::make_shared<cie::SchedulingSpec>(cie::SchedulingSpec::load(spec));
  if (audit_period_ms != nullptr) {
    options.audit_period = std::chrono::milliseconds{std::atol(audit_period_ms)};
  }
  options.on_scheduling_problem = [](const cie::SchedulingProblem& problem) {
    say(problem.text());
  };
  cie::CallbackIsolatedExecutor executor{options};
  executor.add_node(node);
  executor.spawn_thread("reporter", [&](const std::stop_token& stop) {
    while (!stop.stop_requested() && !counts.did_all_run())
      std::this_thread::sleep_for(5ms);
    std::ofstream{report} << getpid() << std::endl;
  });
  const cie::OnHangup on_hangup{[&] {
    try {
      executor.reload_spec(std::make_shared<cie::SchedulingSpec>(cie::SchedulingSpec::load(spec)));
      say("reloaded");
    } catch (const std::exception& error) {
      say(std::string{"the former spec stays in force: "} + error.what());
    }
  }};
  running = &executor;
  std::signal(SIGTERM, on_terminate);
  int status = 0;
  try {
    executor.spin();
  } catch (const cie::SchedulingRefused&) {
    status = kRefused;  // each refusal was said
  }
  running = nullptr;
  counts.print();
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc < 3) return 2;
    return run(argv[1], argv[2], argc > 3 ? argv[3] : nullptr);
  } catch (const std::exception& error) {
    say(error.what());
  }
  return 2;
}
