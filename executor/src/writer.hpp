// The sending end of a topic.
#pragma once

#include <cie/executor/publisher.hpp>
#include <cie/executor/qos.hpp>
#include <cie/tracepoints/trace.hpp>

#include "dds_entity.hpp"
#include "pi_mutex.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace cie::executor {

class ContextState;

// Owns a DDS writer and its topic. Thread-safe.
class Writer {
 public:
  // `topic` is the absolute ROS name. Throws dds::Error, std::logic_error (QoS).
  Writer(std::shared_ptr<ContextState> context, NodeId node, const std::string& topic,
         const QoS& qos, const dds_topic_descriptor& type);
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() = default;

  // The event comes first, so that it lies before the arrival in time. Throws dds::Error.
  void publish(const void* message);

  const std::string& topic() const noexcept { return name_; }
  std::uint64_t gid() const noexcept { return gid_; }
  std::uint32_t matched() const;

 private:
  std::shared_ptr<ContextState> context_;
  std::string name_;
  dds::Entity topic_;
  dds::Entity writer_;
  std::uint64_t gid_ = 0;
  PiMutex mutex_;  // keeps number, timestamp and message in one order
  std::optional<trace::Publisher> trace_;
};

}  // namespace cie::executor
