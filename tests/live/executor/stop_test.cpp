// Executors end within bounded time and leave nothing behind, whatever they are in the middle of.
//
// CIE_SOAK_ROUNDS=N runs every case N times instead of a few; `./run soak` does.
#include "executors.hpp"
#include "support.hpp"
#include "support/sanitizers.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>
#include <test_services.hpp>
#include <unistd.h>

namespace cie::test {
namespace {

using cie_msgs::Sample;
using test_services::Add_Request;
using test_services::Add_Response;

constexpr auto kBound = 20s;  // generous: a failure means "never", not "late"

int rounds(int few) {
  const char* const wanted = std::getenv("CIE_SOAK_ROUNDS");
  return wanted == nullptr ? few : std::atoi(wanted);
}

// What must not grow. Memory that malloc and the cache of thread stacks keep is not counted.
struct Resources {
  std::size_t threads = 0;
  std::size_t descriptors = 0;
  std::size_t mapped_files = 0;
  bool operator==(const Resources&) const = default;
};

std::size_t entries(const char* folder) {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator{folder})
    ++count;
  return count;
}

Resources resources() {
  Resources found{.threads = entries("/proc/self/task"), .descriptors = entries("/proc/self/fd")};
  // ThreadSanitizer maps debug information when it first has something to say.
#ifndef CIE_THREAD_SANITIZER
  std::ifstream maps{"/proc/self/maps"};
  for (std::string line; std::getline(maps, line);) {
    if (line.find(" /") != std::string::npos) ++found.mapped_files;
  }
#endif
  return found;
}

std::ostream& operator<<(std::ostream& out, const Resources& found) {
  return out << found.threads << " threads, " << found.descriptors << " descriptors, "
             << found.mapped_files << " mapped files";
}

// Ends the process, with a core of all its threads, when a round does not end.
class Watchdog {
 public:
  Watchdog() = default;
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;
  ~Watchdog() {
    {
      const std::lock_guard lock{mutex_};
      is_over_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }
  void progress() {
    {
      const std::lock_guard lock{mutex_};
      ++rounds_;
    }
    changed_.notify_one();
  }

 private:
  void watch() {
    std::unique_lock lock{mutex_};
    while (!is_over_) {
      const int before = rounds_;
      const bool is_alive =
          changed_.wait_for(lock, kBound, [&] { return is_over_ || rounds_ != before; });
      if (is_alive) continue;
      std::fprintf(stderr, "round %d does not end\n", before);
      std::abort();
    }
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  int rounds_ = 0;
  bool is_over_ = false;
  std::thread thread_{[this] { watch(); }};
};

// One round: everything is made, spun, stopped and destroyed. `round` varies the instant.
using Round = void (*)(Kind kind, Context& context, int round);

struct Case {
  const char* name;
  Round run;
};

// Spins until somebody cancels. `act` runs on another thread meanwhile.
void spin_while(Executor& executor, const std::function<void()>& act) {
  std::thread actor{[&] {
    act();
    executor.cancel();
  }};
  executor.spin();
  actor.join();
}

void pause(int round) { std::this_thread::sleep_for(std::chrono::microseconds{round % 7 * 150}); }

// A node with something of everything, all of it busy.
struct Busy {
  Busy(
      const Context& context, const std::string& name, std::function<void()> in_callback = [] {})
      : inside(std::move(in_callback)), node(context, name) {
    publisher = node.create_publisher<Sample>("data", 10);
    subscription = node.create_subscription<Sample>("data", 10, [this](const Sample&) { run(); });
    guard_condition = node.create_guard_condition("go", [this] { run(); });
    service = node.create_service<Add_Request, Add_Response>(
        "add", [this](const Add_Request& asked, Add_Response& response) {
          run();
          response.sum = asked.a + asked.b;
        });
    client = node.create_client<Add_Request, Add_Response>("add", {.timeout = 2ms});
    timer = node.create_wall_timer(1ms,
                                   [this] {
                                     run();
                                     publisher->publish(*message);
                                     guard_condition->trigger();
                                     if (client->pending_requests() < 5) {
                                       client->async_send_request(*request, [](const auto&) {});
                                     }
                                   },
                                   {.phase = 0ns});
    TimerOptions together;
    together.group = node.create_callback_group(GroupType::reentrant);
    reentrant = node.create_wall_timer(
        1ms, [this] { run(); }, together);
  }
  void run() {
    inside();
    ++runs;
  }

  std::function<void()> inside;
  std::atomic<int> runs{0};
  MessagePtr<Sample> message = make_message<Sample>();
  MessagePtr<Add_Request> request = make_message<Add_Request>();
  std::shared_ptr<Publisher<Sample>> publisher;
  std::shared_ptr<Subscription<Sample>> subscription;
  std::shared_ptr<GuardCondition> guard_condition;
  std::shared_ptr<Service<Add_Request, Add_Response>> service;
  std::shared_ptr<Client<Add_Request, Add_Response>> client;
  std::shared_ptr<Timer> timer;
  std::shared_ptr<Timer> reentrant;
  Node node;  // goes first, and takes the callbacks that use the others out of service
};

ExecutorOptions small_pools() { return {.reentrant_threads = 2, .threads = 2}; }

void before_spinning(Kind kind, Context& context, int) {
  const auto executor = make(kind, small_pools());
  Busy busy{context, "busy"};
  executor->add_node(busy.node);
  executor->cancel();
  executor->spin();
}

void never_spun(Kind kind, Context& context, int) {
  Busy busy{context, "busy"};
  const auto executor = make(kind, small_pools());
  executor->add_node(busy.node);
}

void while_idle(Kind kind, Context&, int round) {
  const auto executor = make(kind, small_pools());
  spin_while(*executor, [&] { pause(round); });
}

void while_busy(Kind kind, Context& context, int round) {
  Busy busy{context, "busy"};
  const auto executor = make(kind, small_pools());
  executor->add_node(busy.node);
  spin_while(*executor, [&] { pause(round); });
}

void inside_a_callback(Kind kind, Context& context, int) {
  std::atomic<bool> is_inside{false};
  std::atomic<bool> may_end{false};
  Busy busy{context, "busy", [&] {
              is_inside = true;
              while (!may_end)
                std::this_thread::yield();
            }};
  const auto executor = make(kind, small_pools());
  executor->add_node(busy.node);
  std::thread canceller{[&] {
    eventually([&] { return is_inside.load(); });
    executor->cancel();
    may_end = true;
  }};
  executor->spin();
  canceller.join();
}

void by_its_own_callback(Kind kind, Context& context, int) {
  const auto executor = make(kind, small_pools());
  Busy busy{context, "busy", [&] { executor->cancel(); }};
  executor->add_node(busy.node);
  executor->spin();
}

std::atomic<Executor*> interrupted{nullptr};

void by_a_signal_handler(Kind kind, Context& context, int round) {
  struct sigaction action {};
  struct sigaction before {};
  action.sa_handler = [](int) { interrupted.load()->cancel(); };
  Busy busy{context, "busy"};
  const auto executor = make(kind, small_pools());
  executor->add_node(busy.node);
  interrupted = executor.get();
  sigaction(SIGUSR1, &action, &before);
  std::thread sender{[&] {
    pause(round);
    kill(getpid(), SIGUSR1);  // whichever thread takes it
  }};
  executor->spin();
  sender.join();
  sigaction(SIGUSR1, &before, nullptr);
}

// Samples are delivered on the publisher's thread, through reader, cache and executor, up to the
// end.
void while_messages_are_delivered(Kind kind, Context& context, int round) {
  Node partner{context, "partner"};
  const auto publisher = partner.create_publisher<Sample>("data", 10);
  const auto message = make_message<Sample>();
  std::atomic<bool> is_over{false};
  std::thread publishing{[&] {
    while (!is_over)
      publisher->publish(*message);
  }};
  {
    const auto executor = make(kind, small_pools());
    auto busy = std::make_unique<Busy>(context, "busy");
    executor->add_node(busy->node);
    spin_while(*executor, [&] { pause(round); });
    if (round % 2 == 0) busy.reset();  // before the executor, or after it
  }
  is_over = true;
  publishing.join();
}

void while_a_service_call_is_pending(Kind kind, Context& context, int round) {
  Node node{context, "node"};
  const auto unanswered = node.create_client<Add_Request, Add_Response>("nobody");
  std::vector<std::future<std::shared_ptr<const Add_Response>>> futures;
  const auto request = make_message<Add_Request>();
  const auto executor = make(kind, small_pools());
  executor->add_node(node);
  spin_while(*executor, [&] {
    futures.push_back(unanswered->async_send_request(*request));
    pause(round);
    futures.push_back(unanswered->async_send_request(*request));
  });
}

void while_nodes_come_and_go(Kind kind, Context& context, int round) {
  const auto executor = make(kind, small_pools());
  Busy stays{context, "stays"};
  executor->add_node(stays.node);
  std::atomic<bool> is_over{false};
  std::thread adding{[&] {
    while (!is_over) {
      Busy passing{context, "passing"};
      executor->add_node(passing.node);
      const auto timer = passing.node.create_wall_timer(1ms, [] {});
    }
  }};
  spin_while(*executor, [&] { pause(round + 3); });
  is_over = true;
  adding.join();
}

void while_parameters_are_set(Kind kind, Context& context, int round) {
  const auto executor = make(kind, small_pools());
  Busy busy{context, "busy", [&busy] { busy.node.set_parameter("rate", 2); }};
  busy.node.declare_parameter("rate", 1);
  executor->add_node(busy.node);
  spin_while(*executor, [&] { pause(round); });
}

void after_a_callback_threw(Kind kind, Context& context, int) {
  const auto executor = make(kind, small_pools());
  Busy busy{context, "busy", [] { throw std::runtime_error{"no more fuel"}; }};
  executor->add_node(busy.node);
  EXPECT_THROW(executor->spin(), std::runtime_error);
}

void and_spins_again(Kind kind, Context& context, int round) {
  const auto executor = make(kind, small_pools());
  Busy busy{context, "busy"};
  executor->add_node(busy.node);
  for (int spin = 0; spin < 2; ++spin)
    spin_while(*executor, [&] { pause(round); });
}

void with_worker_threads(Kind kind, Context& context, int round) {
  Busy busy{context, "busy"};
  const auto executor = make(kind, small_pools());
  executor->add_node(busy.node);
  executor->spawn_thread("driver", [&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      busy.guard_condition->trigger();
      std::this_thread::yield();
    }
  });
  spin_while(*executor, [&] { pause(round); });
}

constexpr std::array<Case, 14> kCases{{
    {"BeforeSpinning", before_spinning},
    {"NeverSpun", never_spun},
    {"WhileIdle", while_idle},
    {"WhileBusy", while_busy},
    {"InsideACallback", inside_a_callback},
    {"ByItsOwnCallback", by_its_own_callback},
    {"ByASignalHandler", by_a_signal_handler},
    {"WhileMessagesAreDelivered", while_messages_are_delivered},
    {"WhileAServiceCallIsPending", while_a_service_call_is_pending},
    {"WhileNodesComeAndGo", while_nodes_come_and_go},
    {"WhileParametersAreSet", while_parameters_are_set},
    {"AfterACallbackThrew", after_a_callback_threw},
    {"AndSpinsAgain", and_spins_again},
    {"WithWorkerThreads", with_worker_threads},
}};

class Stop : public testing::TestWithParam<std::tuple<Case, Kind>> {};

INSTANTIATE_TEST_SUITE_P(Executors, Stop,
                         testing::Combine(testing::ValuesIn(kCases), every_executor()),
                         [](const testing::TestParamInfo<Stop::ParamType>& parameter) {
                           return std::string{std::get<0>(parameter.param).name} + "_" +
                                  name_of({std::get<1>(parameter.param), parameter.index});
                         });

TEST_P(Stop, EndsAndLeavesNothingBehind) {
  const auto& [stop, kind] = GetParam();
  Context context{private_options()};
  // The tracer's thread comes with the first executor, that of parameters with the first of those.
  const auto idle = make(kind);
  Node first{context, "first"};
  first.declare_parameter("any", 1);
  Watchdog watchdog;
  stop.run(kind, context, 0);  // what DDS makes once, it has made now
  const Resources before = settled(resources);
  const int last = rounds(10);
  for (int round = 1; round <= last; ++round) {
    stop.run(kind, context, round);
    watchdog.progress();
  }
  // DDS gives back what it had for the last round a little later.
  eventually([&] { return resources() == before; }, 5s);
  EXPECT_EQ(resources(), before) << "after " << last << " rounds";
}

TEST(StopAll, ContextsToo) {
  Watchdog watchdog;
  const auto round = [&](int number) {
    Context context{private_options()};
    while_busy("isolated", context, number);
    watchdog.progress();
  };
  round(0);
  const Resources before = settled(resources);
  const int last = rounds(20);
  for (int i = 1; i <= last; ++i)
    round(i);
  eventually([&] { return resources() == before; }, 5s);
  EXPECT_EQ(resources(), before) << "after " << last << " rounds";
}

}  // namespace
}  // namespace cie::test
