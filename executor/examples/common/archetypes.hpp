// The six kinds of nodes that the reference system builds its Autoware-like graph from.
#pragma once

#include <cie/executor/node.hpp>

#include "work.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <cie_messages.hpp>

namespace example {

using cie_msgs::Sample;
using SamplePublisher = std::shared_ptr<cie::Publisher<Sample>>;

// Where nodes are: their context and namespace, and how many messages wait for a subscription.
struct Place {
  const cie::Context& context;
  std::string name_space;
  std::uint32_t queue_depth = 10;
};

// One output of a node: numbers its messages and passes the origin's stamp on.
class Output {
 public:
  Output(cie::Node& node, const Place& place, const std::string& topic,
         std::uint32_t payload_bytes);
  // `stamp`: when the oldest data in it was sensed.
  void publish(std::int64_t stamp);
  bool has_readers() const { return publisher_->subscription_count() > 0; }
  std::uint64_t published() const noexcept { return message_->seq; }

 private:
  SamplePublisher publisher_;
  cie::MessagePtr<Sample> message_;
};

// One input of a node: counts what comes, and by the gaps in its numbers what does not.
class Input {
 public:
  using Function = std::function<void(const Sample&)>;
  Input(cie::Node& node, const Place& place, const std::string& topic, Function function);
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;
  ~Input() = default;
  // Once nobody spins.
  std::uint64_t received() const noexcept { return received_; }
  std::uint64_t missed() const noexcept { return missed_; }

 private:
  void on_sample(const Sample& sample);

  Function function_;
  std::uint64_t received_ = 0;
  std::uint64_t missed_ = 0;  // since the first
  std::uint64_t next_ = 0;
  std::shared_ptr<cie::Subscription<Sample>> subscription_;
};

// Every node of an example: its name, and whether somebody listens to all it says.
class ExampleNode {
 public:
  ExampleNode(const cie::Context& context, const std::string& name, const std::string& name_space)
      : node_(context, name, name_space) {}
  ExampleNode(const ExampleNode&) = delete;
  ExampleNode& operator=(const ExampleNode&) = delete;
  virtual ~ExampleNode() = default;
  virtual bool is_connected() const { return true; }
  cie::Node& node() noexcept { return node_; }

 private:
  cie::Node node_;
};

// Publishes on its timer.
class Sensor final : public ExampleNode {
 public:
  Sensor(const Place& place, const std::string& name, std::chrono::milliseconds period,
         std::chrono::milliseconds phase, const std::string& output, std::uint32_t payload_bytes,
         Work work);
  bool is_connected() const override { return output_.has_readers(); }
  const Output& output() const noexcept { return output_; }

 private:
  Work work_;
  Output output_;
  std::shared_ptr<cie::Timer> timer_;
};

// Publishes what came in, worked on; `on_done` is told of every message after that.
class Transform final : public ExampleNode {
 public:
  Transform(const Place& place, const std::string& name, const std::string& input,
            const std::string& output, std::uint32_t payload_bytes, Work work,
            Input::Function on_done = {});
  bool is_connected() const override { return output_.has_readers(); }
  const Input& input() const noexcept { return input_; }

 private:
  Work work_;
  Output output_;
  Input::Function on_done_;
  Input input_;
};

// Publishes when both inputs have come, in the callback of the later one. Its callbacks run side by
// side under the isolated executor, so what they share is locked.
class Fusion final : public ExampleNode {
 public:
  Fusion(const Place& place, const std::string& name, const std::array<std::string, 2>& inputs,
         const std::string& output, std::uint32_t payload_bytes, Work work);
  bool is_connected() const override { return output_.has_readers(); }

 private:
  void on_input(std::size_t index, const Sample& sample);

  Work work_;
  Output output_;
  std::mutex mutex_;                      // of stamps_, and of publishing
  std::array<std::int64_t, 2> stamps_{};  // 0: not come yet
  std::vector<std::unique_ptr<Input>> inputs_;
};

// Two independent paths through one node.
class Intersection final : public ExampleNode {
 public:
  struct Path {
    std::string input;
    std::string output;
  };
  Intersection(const Place& place, const std::string& name, const std::array<Path, 2>& paths,
               std::uint32_t payload_bytes, Work work);
  bool is_connected() const override;

 private:
  Work work_;
  std::vector<std::unique_ptr<Output>> outputs_;
  std::vector<std::unique_ptr<Input>> inputs_;
};

// Remembers the latest of each input and publishes on its timer; `on_cycle` is told of every start.
class Cyclic final : public ExampleNode {
 public:
  Cyclic(const Place& place, const std::string& name, std::chrono::milliseconds period,
         const std::vector<std::string>& inputs, const std::string& output,
         std::uint32_t payload_bytes, Work work, std::function<void()> on_cycle = {});
  bool is_connected() const override { return output_.has_readers(); }

 private:
  void on_timer();

  Work work_;
  Output output_;
  std::mutex mutex_;  // of stamps_
  std::vector<std::int64_t> stamps_;
  std::function<void()> on_cycle_;
  std::vector<std::unique_ptr<Input>> inputs_;
  std::shared_ptr<cie::Timer> timer_;
};

// The end of a chain.
class Command final : public ExampleNode {
 public:
  Command(const Place& place, const std::string& name, const std::string& input, Work work);

 private:
  Work work_;
  Input input_;
};

}  // namespace example
