// The paper's experiment with nodes of rclcpp. A message is a time alone; payload and passing are rclcpp's own.
#include "workload.hpp"

#include "measured_part.hpp"

#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <cie_rclcpp/callback_isolated_executor.hpp>

#ifdef WITH_PUBLISHED
#include <callback_isolated_executor/callback_isolated_executor.hpp>
#endif
#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/int64.hpp>

namespace bench {
namespace {

using std_msgs::msg::Int64;
using namespace std::chrono_literals;

std::unique_ptr<rclcpp::Executor> make_executor(const Workload& workload) {
  if (workload.executor == "isolated") {
    return std::make_unique<cie_rclcpp::CallbackIsolatedExecutor>();
  }
#ifdef WITH_PUBLISHED
  if (workload.executor == "published") return std::make_unique<::CallbackIsolatedExecutor>();
#endif
  if (workload.executor == "single") {
    return std::make_unique<rclcpp::executors::SingleThreadedExecutor>();
  }
  if (workload.executor == "multi") {
    return std::make_unique<rclcpp::executors::MultiThreadedExecutor>(
        rclcpp::ExecutorOptions{}, workload.threads > 0 ? workload.threads : 2);
  }
  throw std::invalid_argument{"no executor of rclcpp is called " + workload.executor};
}

class WithGroups : public rclcpp::Node {
 public:
  WithGroups(const std::string& name, const rclcpp::Context::SharedPtr& context)
      : Node(name, rclcpp::NodeOptions{}.context(context)) {}

 protected:
  rclcpp::CallbackGroup::SharedPtr own_group() {
    groups_.push_back(create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive));
    return groups_.back();
  }

 private:
  std::vector<rclcpp::CallbackGroup::SharedPtr> groups_;
};

class Publishing : public WithGroups {
 public:
  Publishing(const rclcpp::Context::SharedPtr& context, const Workload& workload,
             const rclcpp::QoS& qos)
      : WithGroups("publisher", context) {
    const auto step = std::chrono::nanoseconds{workload.period} / workload.pairs;
    const auto begin = std::chrono::steady_clock::now() + 10ms;
    for (unsigned i = 0; i < workload.pairs; ++i)
      publishers_.push_back(create_publisher<Int64>(topic(i), qos));
    for (unsigned i = 0; i < workload.pairs; ++i) {
      // A timer's grid begins where it is created.
      if (workload.phases == Phases::staggered) {
        std::this_thread::sleep_until(begin + i * (workload.period + step));
      }
      timers_.push_back(create_wall_timer(
          workload.period,
          [publisher = publishers_[i]] {
            Int64 message;
            message.data = now_ns();
            publisher->publish(message);
          },
          own_group()));
    }
  }
  bool is_connected() const {
    for (const auto& publisher : publishers_) {
      if (publisher->get_subscription_count() == 0) return false;
    }
    return true;
  }

 private:
  std::vector<rclcpp::Publisher<Int64>::SharedPtr> publishers_;
  std::vector<rclcpp::TimerBase::SharedPtr> timers_;
};

class Subscribing : public WithGroups {
 public:
  Subscribing(const rclcpp::Context::SharedPtr& context, const Workload& workload,
              const rclcpp::QoS& qos, Board& board)
      : WithGroups("subscriber", context) {
    for (unsigned i = 0; i < workload.pairs; ++i) {
      rclcpp::SubscriptionOptions options;
      options.callback_group = own_group();
      subscriptions_.push_back(create_subscription<Int64>(
          topic(i), qos, [&board](const Int64& message) { count(board, message.data); }, options));
    }
  }

 private:
  std::vector<rclcpp::Subscription<Int64>::SharedPtr> subscriptions_;
};

}  // namespace

std::vector<std::string> executor_names() {
  std::vector<std::string> names{"isolated", "single", "multi"};
#ifdef WITH_PUBLISHED
  names.insert(names.begin() + 1, "published");
#endif
  return names;
}

void run_part(const Workload& workload, Part part, const std::string&, Board& board) {
  become_real_time(workload.fifo_priority);
  rclcpp::init(0, nullptr);
  const auto context = rclcpp::contexts::get_global_default_context();
  rclcpp::QoS qos{10};
  if (workload.best_effort) qos.best_effort();
  std::shared_ptr<Publishing> publishing;
  std::shared_ptr<Subscribing> subscribing;
  if (part != Part::publisher) {
    subscribing = std::make_shared<Subscribing>(context, workload, qos, board);
  }
  if (part != Part::subscriber) publishing = std::make_shared<Publishing>(context, workload, qos);
  const auto executor = make_executor(workload);
  if (subscribing) executor->add_node(subscribing);
  if (publishing) executor->add_node(publishing);
  spin_until_ended(
      board, [&] { return !publishing || publishing->is_connected(); },
      [] { std::this_thread::sleep_for(200ms); }, [&] { executor->spin(); },
      [] { rclcpp::shutdown(); });
}

}  // namespace bench
