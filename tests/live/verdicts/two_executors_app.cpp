// An isolated and a single-threaded executor spin side by side, with two timers each. The first argument
// says which is created first; a callback of that one throws if there is another argument.
#include <cie/executor/executor.hpp>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <thread>

namespace {

using namespace std::chrono_literals;

void run(std::string_view first_name, bool throws) {
  const cie::Context context;
  cie::Node first_node{context, "first", "/two"};
  cie::Node second_node{context, "second", "/two"};
  std::atomic<int> left{20};
  const auto count = [&] { --left; };
  const std::array timers{
      first_node.create_wall_timer(5ms, count), first_node.create_wall_timer(6ms, count),
      second_node.create_wall_timer(5ms, count), second_node.create_wall_timer(6ms, count)};
  const auto first = cie::make_executor(first_name);
  const auto second = cie::make_executor(first_name == "isolated" ? "single" : "isolated");
  first->add_node(first_node);
  second->add_node(second_node);
  std::jthread spinning{[&] {
    try {
      first->spin();
    } catch (const cie::CallbackError&) {  // which the program survives
    }
  }};
  std::jthread ending{[&] {
    while (left > 0)
      std::this_thread::sleep_for(1ms);
    std::shared_ptr<cie::Timer> failing;
    if (throws) {
      failing = first_node.create_one_shot_timer(1ms, [] { throw std::runtime_error("as asked"); });
    } else {
      first->cancel();
    }
    spinning.join();
    second->cancel();
  }};
  second->spin();
}

}  // namespace

int main(int argc, char* argv[]) {
  try {
    run(argc > 1 ? argv[1] : "isolated", argc > 2);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "two_executors_app: %s\n", error.what());
  } catch (...) {
    std::fputs("two_executors_app: unknown exception\n", stderr);
  }
  return 1;
}
