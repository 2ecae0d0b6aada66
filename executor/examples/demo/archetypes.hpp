// The six kinds of nodes that the reference system builds its Autoware-like graph from.
#pragma once

#include <cie/executor/node.hpp>

#include "work.hpp"

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <cie_messages.hpp>

namespace demo {

using cie_msgs::Sample;
using SamplePublisher = std::shared_ptr<cie::Publisher<Sample>>;

// One output of a node: numbers its messages and passes the origin's stamp on.
class Output {
 public:
  Output(cie::Node& node, const std::string& topic, std::uint32_t payload_bytes);
  // `stamp`: when the oldest data in it was sensed.
  void publish(std::int64_t stamp);
  bool has_readers() const { return publisher_->subscription_count() > 0; }

 private:
  SamplePublisher publisher_;
  cie::MessagePtr<Sample> message_;
};

// Every node of the demo: its name, and whether somebody listens to all it says.
class DemoNode {
 public:
  DemoNode(const cie::Context& context, const std::string& name, const std::string& name_space)
      : node_(context, name, name_space) {}
  DemoNode(const DemoNode&) = delete;
  DemoNode& operator=(const DemoNode&) = delete;
  virtual ~DemoNode() = default;
  virtual bool is_connected() const { return true; }
  cie::Node& node() noexcept { return node_; }

 private:
  cie::Node node_;
};

struct Place {
  const cie::Context& context;
  std::string name_space;
};

// Publishes on its timer.
class Sensor final : public DemoNode {
 public:
  Sensor(const Place& place, const std::string& name, std::chrono::milliseconds period,
         std::chrono::milliseconds phase, const std::string& output, std::uint32_t payload_bytes,
         Work work);
  bool is_connected() const override { return output_.has_readers(); }

 private:
  Work work_;
  Output output_;
  std::shared_ptr<cie::Timer> timer_;
};

// Publishes what came in, worked on.
class Transform final : public DemoNode {
 public:
  Transform(const Place& place, const std::string& name, const std::string& input,
            const std::string& output, std::uint32_t payload_bytes, Work work);
  bool is_connected() const override { return output_.has_readers(); }

 private:
  Work work_;
  Output output_;
  std::shared_ptr<cie::Subscription<Sample>> subscription_;
};

// Publishes when both inputs have come, in the callback of the later one. Its callbacks run side by
// side under the isolated executor, so what they share is locked.
class Fusion final : public DemoNode {
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
  std::array<std::shared_ptr<cie::Subscription<Sample>>, 2> subscriptions_;
};

// Two independent paths through one node.
class Intersection final : public DemoNode {
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
  std::vector<std::shared_ptr<cie::Subscription<Sample>>> subscriptions_;
};

// Remembers the latest of each input and publishes on its timer.
class Cyclic final : public DemoNode {
 public:
  Cyclic(const Place& place, const std::string& name, std::chrono::milliseconds period,
         const std::vector<std::string>& inputs, const std::string& output,
         std::uint32_t payload_bytes, Work work);
  bool is_connected() const override { return output_.has_readers(); }

 private:
  void on_timer();

  Work work_;
  Output output_;
  std::mutex mutex_;  // of stamps_
  std::vector<std::int64_t> stamps_;
  std::vector<std::shared_ptr<cie::Subscription<Sample>>> subscriptions_;
  std::shared_ptr<cie::Timer> timer_;
};

// The end of a chain.
class Command final : public DemoNode {
 public:
  Command(const Place& place, const std::string& name, const std::string& input, Work work);

 private:
  Work work_;
  std::shared_ptr<cie::Subscription<Sample>> subscription_;
};

}  // namespace demo
