#include "workload.hpp"

#include <cie/executor/executor.hpp>

#include "measured_part.hpp"

#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <cie_messages.hpp>

namespace bench {
namespace {

using cie_msgs::Sample;
using namespace std::chrono_literals;

std::unique_ptr<cie::Executor> make_executor(const Workload& workload) {
  cie::ExecutorOptions options;
  options.threads = workload.threads;
  return cie::make_executor(workload.executor, options);
}

struct Publishing {
  Publishing(const cie::Context& context, const Workload& workload, const cie::QoS& qos)
      : node(context, "publisher") {
    const auto step = std::chrono::nanoseconds{workload.period} / workload.pairs;
    for (unsigned i = 0; i < workload.pairs; ++i) {
      auto publisher = node.create_publisher<Sample>(topic(i), qos);
      publishers.push_back(publisher);
      auto message = std::shared_ptr<Sample>{cie::make_message<Sample>()};
      const unsigned payload = workload.payload;
      const bool is_handed_over = workload.passing == Passing::pointer;
      cie::resize(message->payload, payload);
      cie::TimerOptions options;
      // One grid for all, also for those of other processes.
      options.start = workload.phases == Phases::staggered ? step * i : 0ns;
      options.name = "timer" + std::to_string(i);
      timers.push_back(node.create_wall_timer(
          workload.period,
          [publisher, message, payload, is_handed_over] {
            if (is_handed_over) {
              auto own = cie::make_message<Sample>();
              cie::resize(own->payload, payload);
              own->stamp = now_ns();
              publisher->publish(std::move(own));
            } else {
              ++message->seq;
              message->stamp = now_ns();
              publisher->publish(*message);
            }
          },
          options));
    }
  }
  bool is_connected() const {
    for (const auto& publisher : publishers) {
      if (publisher->subscription_count() == 0) return false;
    }
    return true;
  }
  cie::Node node;
  std::vector<std::shared_ptr<cie::Publisher<Sample>>> publishers;
  std::vector<std::shared_ptr<cie::Timer>> timers;
};

struct Subscribing {
  Subscribing(const cie::Context& context, const Workload& workload, const cie::QoS& qos,
              Board& board)
      : node(context, "subscriber") {
    for (unsigned i = 0; i < workload.pairs; ++i) {
      subscriptions.push_back(node.create_subscription<Sample>(
          topic(i), qos, [&board](const Sample& sample) { count(board, sample.stamp); }));
    }
  }
  cie::Node node;
  std::vector<std::shared_ptr<cie::Subscription<Sample>>> subscriptions;
};

}  // namespace

std::vector<std::string> executor_names() {
  return {cie::kExecutorNames.begin(), cie::kExecutorNames.end()};
}

void run_part(const Workload& workload, Part part, const std::string& tag, Board& board) {
  become_real_time(workload.fifo_priority);
  const cie::Context context{{.domain = 99,
                              .loopback = true,
                              .tag = tag,
                              .pass_pointers = workload.passing != Passing::serialized,
                              .shared_memory = workload.passing == Passing::shared}};
  cie::QoS qos{cie::KeepLast{10}};
  if (workload.best_effort) qos.best_effort();
  std::unique_ptr<Publishing> publishing;
  std::unique_ptr<Subscribing> subscribing;
  if (part != Part::publisher) {
    subscribing = std::make_unique<Subscribing>(context, workload, qos, board);
  }
  if (part != Part::subscriber) publishing = std::make_unique<Publishing>(context, workload, qos);
  const auto executor = make_executor(workload);
  if (subscribing) executor->add_node(subscribing->node);
  if (publishing) executor->add_node(publishing->node);
  spin_until_ended(
      board, [&] { return !publishing || publishing->is_connected(); },
      [&] {
        while (!executor->is_spinning())
          std::this_thread::sleep_for(1ms);
      },
      [&] { executor->spin(); }, [&] { executor->cancel(); });
}

}  // namespace bench
