// The executor while it spins: who runs what, and what ends it.
#include "support/rclcpp/tests/recorded_releases.hpp"
#include "support/rclcpp/tests/spinning.hpp"
#include "support/temporary_directory.hpp"

#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>

#include <fcntl.h>
#include <rcl_interfaces/srv/set_parameters.hpp>
#include <unistd.h>

namespace cie_rclcpp {
namespace {

using namespace test;
using rcl_interfaces::srv::SetParameters;
using testing::HasSubstr;

class ExecutorTest : public WithContext {
 protected:
  CallbackIsolatedExecutor executor_{cie::ExecutorOptions{}, in_context()};
};

// What was written there since, also while others write.
class StandardError {
 public:
  StandardError() {
    const int file = ::open(path_.c_str(), O_CREAT | O_WRONLY | O_APPEND, 0600);
    ::dup2(file, STDERR_FILENO);
    ::close(file);
  }
  ~StandardError() {
    ::dup2(before_, STDERR_FILENO);
    ::close(before_);
  }
  StandardError(const StandardError&) = delete;
  StandardError& operator=(const StandardError&) = delete;
  bool has(const std::string& text) const {
    std::ifstream file{path_};
    return std::string{std::istreambuf_iterator<char>{file}, {}}.find(text) != std::string::npos;
  }

 private:
  const cie::test::TemporaryDirectory directory_;
  const std::string path_ = directory_.path() / "stderr";
  const int before_ = ::dup(STDERR_FILENO);
};

TEST_F(ExecutorTest, ServesEachGroupOnAThreadOfItsOwn) {
  const auto busy = node("busy");
  const auto own = busy->create_callback_group(CallbackGroupType::MutuallyExclusive);
  std::mutex mutex;
  std::map<std::string, std::set<std::thread::id>> threads;
  const auto note = [&](const std::string& who) {
    const std::lock_guard lock{mutex};
    threads[who].insert(std::this_thread::get_id());
  };
  const auto publisher = busy->create_publisher<Message>("topic", 10);
  const auto subscription = busy->create_subscription<Message>(
      "topic", 10, [&](const Message&) { note("subscription"); }, in(own));
  const auto timer = busy->create_wall_timer(1ms, [&] {
    note("timer");
    publisher->publish(Message{1});
  });
  executor_.add_node(busy);
  {
    const Spinning spinning{executor_};
    EXPECT_TRUE(comes([&] {
      const std::lock_guard lock{mutex};
      return threads.size() == 2;
    }));
  }
  EXPECT_EQ(threads["timer"].size(), 1U);
  EXPECT_EQ(threads["subscription"].size(), 1U);
  EXPECT_NE(threads["timer"], threads["subscription"]);
  EXPECT_FALSE(threads["timer"].contains(std::this_thread::get_id()));
}

// Each message through the middleware and through the process is handled once, in order.
TEST_F(ExecutorTest, HandlesEachMessageOnceWhicheverWayItComes) {
  const auto within =
      std::make_shared<rclcpp::Node>("within", "/test", options().use_intra_process_comms(true));
  const auto outside = node("outside");
  std::mutex mutex;
  std::vector<std::uint32_t> inner;
  std::vector<std::uint32_t> outer;
  const auto into = [&mutex](std::vector<std::uint32_t>& list) {
    return [&mutex, &list](std::unique_ptr<Message> message) {
      const std::lock_guard lock{mutex};
      list.push_back(message->data);
    };
  };
  const auto first = within->create_subscription<Message>("topic", 100, into(inner));
  const auto second = outside->create_subscription<Message>("topic", 100, into(outer));
  const auto of_process = within->create_publisher<Message>("topic", 100);
  executor_.add_node(within);
  executor_.add_node(outside);
  {
    const Spinning spinning{executor_};
    for (std::uint32_t i = 0; i < 20; ++i)
      of_process->publish(Message{i});
    EXPECT_TRUE(comes([&] {
      const std::lock_guard lock{mutex};
      return inner.size() >= 20 && outer.size() >= 20;
    }));
    std::this_thread::sleep_for(20ms);
  }
  std::vector<std::uint32_t> all(20);
  for (std::uint32_t i = 0; i < 20; ++i)
    all[i] = i;
  EXPECT_EQ(inner, all);
  EXPECT_EQ(outer, all);
}

TEST_F(ExecutorTest, HandlesSerializedAndLoanedMessages) {
  const auto both = node("both");
  std::atomic<int> serialized{0};
  std::atomic<int> loaned{0};
  const auto one = both->create_subscription<Message>(
      "topic", 10, [&](const std::shared_ptr<rclcpp::SerializedMessage>& message) {
        serialized = static_cast<int>(message->bytes[0]);
      });
  const auto other = both->create_subscription<Message>(
      "topic", 10, [&](const Message& message) { loaned = static_cast<int>(message.data); });
  const auto publisher = both->create_publisher<Message>("topic", 10);
  rmw_double::set_loans(true);
  executor_.add_node(both);
  {
    const Spinning spinning{executor_};
    publisher->publish(Message{42});
    EXPECT_TRUE(comes([&] { return serialized == 42 && loaned == 42; }));
  }
  rmw_double::set_loans(false);
}

TEST_F(ExecutorTest, AServiceAnswersItsClient) {
  const auto serving = node("serving");
  const auto asking = node("asking");
  const auto service = serving->create_service<SetBool>(
      "turn",
      [](const SetBool::Request::SharedPtr& request, const SetBool::Response::SharedPtr& response) {
        response->success = request->data;
      });
  const auto client = asking->create_client<SetBool>("turn");
  executor_.add_node(serving);
  executor_.add_node(asking);
  const Spinning spinning{executor_};
  auto request = std::make_shared<SetBool::Request>();
  request->data = true;
  const auto future = client->async_send_request(request);
  ASSERT_EQ(future.wait_for(20s), std::future_status::ready);
  EXPECT_TRUE(future.get()->success);
}

// Parameters: while it spins, on the thread "cie-rclcpp"; not before, and not by a callback's thread.
TEST_F(ExecutorTest, ServesParametersOnTheWorkerWhileItSpins) {
  const auto tuned = node("tuned");
  std::mutex mutex;
  std::vector<std::string> threads;
  const auto handle = tuned->add_on_set_parameters_callback([&](const auto&) {
    const std::lock_guard lock{mutex};
    threads.push_back(name_of_this_thread());
    return rcl_interfaces::msg::SetParametersResult{.successful = true};
  });
  const auto client = tuned->create_client<SetParameters>("/test/tuned/set_parameters");
  executor_.add_node(tuned);
  auto request = std::make_shared<SetParameters::Request>();
  request->parameters.push_back(
      {"gain", {rcl_interfaces::msg::ParameterType::PARAMETER_INTEGER, 7}});
  const auto future = client->async_send_request(request);
  EXPECT_EQ(future.wait_for(50ms), std::future_status::timeout) << "nobody spins";
  {
    const Spinning spinning{executor_};
    ASSERT_EQ(future.wait_for(20s), std::future_status::ready);
  }
  EXPECT_TRUE(future.get()->results.at(0).successful);
  EXPECT_EQ(tuned->get_parameter("gain"), 7);
  const auto after = client->async_send_request(request);
  EXPECT_EQ(after.wait_for(50ms), std::future_status::timeout) << "nobody spins any more";
  const std::lock_guard lock{mutex};
  EXPECT_THAT(threads, testing::ElementsAre("cie-rclcpp"));
}

// A LifecycleNode of Humble ends the handles of its services before these, which then end what listens.
TEST_F(ExecutorTest, ListensToNoServiceOfRclcppBetweenSpins) {
  const auto tuned = node("tuned");
  const auto client = tuned->create_client<SetParameters>("/test/tuned/set_parameters");
  executor_.add_node(tuned);
  for (int spin = 0; spin < 2; ++spin) {
    const auto future = client->async_send_request(std::make_shared<SetParameters::Request>());
    {
      const Spinning spinning{executor_};
      ASSERT_EQ(future.wait_for(20s), std::future_status::ready);
    }
    int services = 0;
    const auto ignored = [](const auto&) {};
    tuned->get_node_base_interface()->get_default_callback_group()->collect_all_ptrs(
        ignored,
        [&services](const auto& service) {
          ++services;
          EXPECT_FALSE(service->has_on_new_request_callback()) << service->get_service_name();
        },
        ignored, ignored, ignored);
    EXPECT_GE(services, 6);
  }
}

TEST_F(ExecutorTest, WhatAFunctionThrowsOnTheWorkerEndsIt) {
  const auto tuned = node("tuned");
  const auto handle = tuned->add_on_set_parameters_callback(
      [](const auto&) -> rcl_interfaces::msg::SetParametersResult {
        throw std::runtime_error{"not that one"};
      });
  const auto client = tuned->create_client<SetParameters>("/test/tuned/set_parameters");
  executor_.add_node(tuned);
  Spinning spinning{executor_};
  auto request = std::make_shared<SetParameters::Request>();
  request->parameters.push_back({"gain", {}});
  client->async_send_request(request);
  try {
    spinning.join();
    FAIL() << "it threw";
  } catch (const cie::CallbackError& error) {
    EXPECT_THAT(error.what(), HasSubstr("not that one"));
  }
}

TEST_F(ExecutorTest, AnEventOfTheUsersIsServedInItsGroup) {
  const auto picky = node("picky");
  const auto own = picky->create_callback_group(CallbackGroupType::MutuallyExclusive);
  std::atomic<int> events{0};
  auto handled = in(own);
  handled.event_callbacks.incompatible_qos_callback =
      [&](rclcpp::QOSRequestedIncompatibleQoSInfo& info) { events = info.total_count; };
  const auto reliable = picky->create_subscription<Message>(
      "x", 1, [](const Message&) {}, handled);
  executor_.add_node(picky);
  const Spinning spinning{executor_};
  const StandardError said;
  const auto best_effort = picky->create_publisher<Message>("x", rclcpp::QoS{1}.best_effort());
  EXPECT_TRUE(comes([&] { return events == 1; }));
  EXPECT_TRUE(comes([&] { return said.has("incompatible QoS on topic /test/x"); }))
      << "the publisher's own handler, on the worker";
}

TEST_F(ExecutorTest, AHandlerOfLostMessagesIsAskedBeforeUs) {
  const auto losing = node("losing");
  const auto own = losing->create_callback_group(CallbackGroupType::MutuallyExclusive);
  std::atomic<std::size_t> lost{0};
  auto handled = in(own);
  handled.event_callbacks.message_lost_callback = [&](rclcpp::QOSMessageLostInfo& info) {
    lost = info.total_count;
  };
  const auto with = losing->create_subscription<Message>(
      "x", 1, [](const Message&) {}, handled);
  const auto without = losing->create_subscription<Message>("x", 1, [](const Message&) {});
  executor_.add_node(losing);
  const Spinning spinning{executor_};
  for (const auto& each : {with, without})
    each->get_subscription_handle()->reader->lost.raise(3);
  EXPECT_TRUE(comes([&] { return lost == 3; }));
  EXPECT_TRUE(comes([&] { return !without->get_subscription_handle()->reader->lost.take(); }));
}

TEST_F(ExecutorTest, CancelOfTheBaseClassEndsIt) {
  rclcpp::Executor& base = executor_;
  for (int i = 0; i < 3; ++i) {
    std::atomic<int> runs{0};
    const auto ticking = node("ticking");
    const auto timer = ticking->create_wall_timer(1ms, [&] { ++runs; });
    executor_.add_node(ticking);
    Spinning spinning{executor_};
    EXPECT_TRUE(comes([&] { return runs > 0; }));
    base.cancel();
    spinning.join();
    const int until_now = runs;
    std::this_thread::sleep_for(5ms);
    EXPECT_EQ(runs, until_now);
    executor_.remove_node(ticking);
  }
}

// So that who cancels need not know whether the other thread came to spin() yet.
TEST_F(ExecutorTest, CancelBeforeSpinEndsTheNextOne) {
  executor_.cancel();
  executor_.spin();
  std::atomic<int> runs{0};
  const auto ticking = node("ticking");
  const auto timer = ticking->create_wall_timer(1ms, [&] { ++runs; });
  executor_.add_node(ticking);
  const Spinning spinning{executor_};
  EXPECT_TRUE(comes([&] { return runs > 0; })) << "that one alone";
}

TEST_F(ExecutorTest, SpinForEnds) {
  const auto before = std::chrono::steady_clock::now();
  executor_.spin_for(30ms);
  EXPECT_GE(std::chrono::steady_clock::now() - before, 30ms);
}

TEST_F(ExecutorTest, TheEndOfTheContextEndsIt) {
  Spinning spinning{executor_};
  std::this_thread::sleep_for(10ms);
  context_->shutdown("test");
  spinning.join();
  executor_.spin();  // returns at once
}

TEST_F(ExecutorTest, SpinsOnceAtATime) {
  std::atomic<int> runs{0};
  const auto ticking = node("ticking");
  const auto timer = ticking->create_wall_timer(1ms, [&] { ++runs; });
  executor_.add_node(ticking);
  const Spinning spinning{executor_};
  EXPECT_TRUE(comes([&] { return runs > 0; }));
  EXPECT_THROW(executor_.spin(), std::runtime_error);
  const int until_now = runs;
  EXPECT_TRUE(comes([&] { return runs > until_now; })) << "the first one goes on";
}

TEST_F(ExecutorTest, AnExceptionInACallbackEndsItWithCallbackError) {
  const auto failing = node("failing");
  const auto timer =
      failing->create_wall_timer(1ms, [] { throw std::runtime_error{"no more fuel"}; });
  executor_.add_node(failing);
  try {
    executor_.spin();
    FAIL() << "it threw";
  } catch (const cie::CallbackError& error) {
    EXPECT_STREQ(error.what(), "callback \"/test/failing@Timer(1000000)\" threw: no more fuel");
    EXPECT_THROW(std::rethrow_if_nested(error), std::runtime_error);
  }
}

class Mute : public rclcpp::Waitable {
 public:
  void add_to_wait_set(rclcpp::ToWaitSet) override {}
  bool is_ready(rclcpp::OfWaitSet) override { return false; }
  std::shared_ptr<void> take_data() override { return nullptr; }
  void execute(rclcpp::TakenData) override {}
};

TEST_F(ExecutorTest, SaysOnceThatAWaitableCannotTellAndServesTheRest) {
  const auto partly = node("partly");
  const auto mute = std::make_shared<Mute>();
  partly->get_node_waitables_interface()->add_waitable(mute, nullptr);
  std::atomic<int> runs{0};
  const auto timer = partly->create_wall_timer(1ms, [&] { ++runs; });
  executor_.add_node(partly);
  testing::internal::CaptureStderr();
  std::vector<rclcpp::TimerBase::SharedPtr> further;
  {
    const Spinning spinning{executor_};
    EXPECT_TRUE(comes([&] { return runs > 3; }));
    for (int i = 0; i < 3; ++i)  // has it look again
      further.push_back(partly->create_wall_timer(1ms, [&] { ++runs; }));
    const int until_now = runs;
    EXPECT_TRUE(comes([&] { return runs > until_now + 20; }));
  }
  const std::string said = testing::internal::GetCapturedStderr();
  const std::string sentence =
      "a callback of node /test/partly is not served, because rclcpp cannot tell when it is ready";
  EXPECT_THAT(said, HasSubstr(sentence));
  EXPECT_EQ(said.find(sentence), said.rfind(sentence));
}

// A waitable that can tell, by the number of its entity.
class Bell : public Mute {
 public:
  ~Bell() override { notice_.clear(); }
  std::shared_ptr<void> take_data_by_entity_id(std::size_t id) override {
    if (id != 3) return nullptr;
    const std::lock_guard lock{mutex_};
    if (waiting_ == 0) return nullptr;
    --waiting_;
    return std::make_shared<std::size_t>(id);
  }
  void execute(rclcpp::TakenData data) override {
    rung += static_cast<int>(*std::static_pointer_cast<std::size_t>(data));
  }
  void set_on_ready_callback(std::function<void(std::size_t, int)> callback) override {
    notice_.set([callback = std::move(callback)](std::size_t count) { callback(count, 3); });
  }
  void clear_on_ready_callback() override { notice_.clear(); }
  void ring() {
    {
      const std::lock_guard lock{mutex_};
      ++waiting_;
    }
    notice_.raise();
  }
  std::atomic<int> rung{0};

 private:
  rmw_double::Notice notice_;
  std::mutex mutex_;
  int waiting_ = 0;
};

TEST_F(ExecutorTest, ServesAWaitableByItsEntities) {
  const auto ringing = node("ringing");
  const auto bell = std::make_shared<Bell>();
  ringing->get_node_waitables_interface()->add_waitable(bell, nullptr);
  bell->ring();
  executor_.add_node(ringing);
  const Spinning spinning{executor_};
  EXPECT_TRUE(comes([&] { return bell->rung == 3; })) << "what came before";
  bell->ring();
  EXPECT_TRUE(comes([&] { return bell->rung == 6; }));
}

TEST_F(ExecutorTest, AReentrantGroupRunsOnSeveralThreadsAtOnce) {
  const auto wide = node("wide");
  const auto group = wide->create_callback_group(CallbackGroupType::Reentrant);
  std::atomic<int> inside{0};
  std::atomic<bool> were_two{false};
  const auto subscription = wide->create_subscription<Message>(
      "topic", 10,
      [&](const Message&) {
        ++inside;
        if (comes([&] { return inside >= 2 || were_two; })) were_two = true;
        --inside;
      },
      in(group));
  const auto publisher = wide->create_publisher<Message>("topic", 10);
  executor_.add_node(wide);
  const Spinning spinning{executor_};
  publisher->publish(Message{1});
  publisher->publish(Message{2});
  EXPECT_TRUE(comes([&] { return were_two && inside == 0; }));
}

TEST_F(ExecutorTest, SpawnsThreadsUntilItGoes) {
  std::atomic<bool> has_ended{false};
  std::string name;
  {
    CallbackIsolatedExecutor spawning{cie::ExecutorOptions{}, in_context()};
    EXPECT_THROW(spawning.spawn_thread("sixteen_letters_", [](const std::stop_token&) {}),
                 std::invalid_argument);
    std::atomic<bool> has_begun{false};
    spawning.spawn_thread("gnss", [&](const std::stop_token& stop) {
      name = name_of_this_thread();
      has_begun = true;
      while (!stop.stop_requested())
        std::this_thread::sleep_for(1ms);
      has_ended = true;
    });
    EXPECT_TRUE(comes([&] { return has_begun.load(); }));
  }
  EXPECT_TRUE(has_ended);
  EXPECT_EQ(name, "gnss");
}

}  // namespace
}  // namespace cie_rclcpp
