// The sending end of a topic.
#pragma once

#include <cie/executor/publisher.hpp>
#include <cie/executor/qos.hpp>
#include <cie/tracepoints/priority_mutex.hpp>
#include <cie/tracepoints/trace.hpp>

#include "dds_entity.hpp"
#include "names.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace cie::executor {

class ContextState;

// Owns a DDS writer and its topic. Thread-safe.
class Writer {
 public:
  // `node` empty: a writer of ours that is not traced. `user_data` is seen by whoever discovers the
  // writer. Throws dds::Error, std::logic_error (QoS).
  Writer(std::shared_ptr<ContextState> context, std::optional<NodeId> node, const TopicName& topic,
         const QoS& qos, const dds_topic_descriptor& type, const std::string& user_data = {});
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() = default;

  // The event comes first, so that it lies before the arrival in time. Throws dds::Error.
  void publish(const void* message);

  const std::string& topic() const noexcept { return name_; }
  std::uint64_t gid() const noexcept { return gid_; }
  std::uint32_t matched() const;
  dds_entity_t entity() const noexcept { return writer_.get(); }

 private:
  std::shared_ptr<ContextState> context_;
  std::string name_;
  dds::Entity topic_;
  dds::Entity writer_;
  std::uint64_t gid_ = 0;
  PriorityMutex mutex_;  // keeps number, timestamp and message in one order
  std::optional<trace::Publisher> trace_;
};

}  // namespace cie::executor
