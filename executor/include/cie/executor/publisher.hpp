// Sends messages of one type on one topic. Made by Node::create_publisher.
#pragma once

#include <cie/executor/message.hpp>

#include <cstdint>
#include <memory>
#include <string>

namespace cie {

namespace executor {
class Writer;
// Throws std::runtime_error when DDS refuses the message.
void publish(Writer& writer, const void* message);
const std::string& topic_of(const Writer& writer) noexcept;
std::uint64_t writer_gid_of(const Writer& writer) noexcept;
std::uint32_t matched_readers(const Writer& writer);
}  // namespace executor

// May outlive its node. Thread-safe: messages of several threads are put in one order.
template <Message T>
class Publisher {
 public:
  explicit Publisher(std::shared_ptr<executor::Writer> writer) : writer_(std::move(writer)) {}
  // Copies the message out before it returns. Throws std::runtime_error when DDS refuses it.
  void publish(const T& message) { executor::publish(*writer_, &message); }
  const std::string& topic() const noexcept { return executor::topic_of(*writer_); }
  // The writer's number in traces and in MessageInfo.
  std::uint64_t writer_gid() const noexcept { return executor::writer_gid_of(*writer_); }
  // Subscriptions connected now, in this process and others.
  std::uint32_t subscription_count() const { return executor::matched_readers(*writer_); }

 private:
  std::shared_ptr<executor::Writer> writer_;
};

}  // namespace cie
