// An executor that spins three times, with a pause of 30 ms before each, the last time on another thread,
// where it loses a node and gets it back. Two timers are reset after a pause, and one is not. The
// argument says which executor.
#include <cie/executor/executor.hpp>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <functional>
#include <thread>

namespace {

using namespace std::chrono_literals;

void run(const char* executor_name) {
  const cie::Context context;
  cie::Node stays{context, "stays", "/respinning"};
  cie::Node returns{context, "returns", "/respinning"};
  std::atomic<int> runs{0};
  std::atomic<int> runs_of_returning{0};
  const auto timer = stays.create_wall_timer(5ms, [&] { ++runs; });
  const auto returning = returns.create_wall_timer(5ms, [&] { ++runs_of_returning; });
  const auto not_reset = stays.create_wall_timer(10ms, [] {});
  const auto executor = cie::make_executor(executor_name);
  executor->add_node(stays);
  executor->add_node(returns);
  const auto wait_for_runs = [&] {
    const auto both_ran = [&, a = runs.load(), b = runs_of_returning.load()] {
      return runs > a + 2 && runs_of_returning > b + 2;
    };
    while (!both_ran())
      std::this_thread::sleep_for(1ms);
  };
  const auto spin_while = [&](const std::function<void()>& act) {
    std::jthread acting{[&] {
      act();
      executor->cancel();
    }};
    std::this_thread::sleep_for(30ms);
    timer->reset();
    returning->reset();
    executor->spin();
  };
  spin_while(wait_for_runs);
  spin_while(wait_for_runs);
  std::jthread{[&] {
    spin_while([&] {
      wait_for_runs();
      executor->reload_spec(nullptr);
      executor->remove_node(returns);
      std::this_thread::sleep_for(20ms);
      returning->reset();
      executor->add_node(returns);
      wait_for_runs();
    });
  }}.join();
}

}  // namespace

int main(int argc, char* argv[]) {
  try {
    run(argc > 1 ? argv[1] : "isolated");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "respinning_app: %s\n", error.what());
  } catch (...) {
    std::fputs("respinning_app: unknown exception\n", stderr);
  }
  return 1;
}
