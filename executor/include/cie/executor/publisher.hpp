// Sends messages of one type on one topic. Made by Node::create_publisher.
#pragma once

#include <cie/executor/message.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

namespace cie {

namespace executor {
class Writer;
// False: it could not be sent in time. Throws std::runtime_error when DDS refuses the message.
bool publish(Writer& writer, const void* message);
// Takes over a message of allocate_message(); frees it when it throws. Null: std::invalid_argument.
bool publish_owned(Writer& writer, void* message);
bool publish_shared(Writer& writer, std::shared_ptr<const void> message);
const std::string& topic_of(const Writer& writer) noexcept;
std::uint64_t writer_gid_of(const Writer& writer) noexcept;
std::uint32_t matched_readers(const Writer& writer);
std::uint64_t unsent_messages(const Writer& writer) noexcept;
void assert_liveliness(const Writer& writer);
}  // namespace executor

namespace executor {
// Does nothing; where it lies tells which component publishes messages of this type.
template <Message T>
void code_of_publisher() noexcept {}
}  // namespace executor

// Goes with the last copy of its handle. May outlive its node. Thread-safe: messages of several
// threads are put in one order.
template <Message T>
class Publisher {
 public:
  explicit Publisher(std::shared_ptr<executor::Writer> writer) : writer_(std::move(writer)) {}
  // Copies the message out before it returns. False: it could not be sent within the QoS's
  // max_blocking_time, and nobody gets it. Throws std::runtime_error when DDS refuses it.
  bool publish(const T& message) { return executor::publish(*writer_, &message); }
  // Hands the message over, without copying it: every subscription of this process gets this very
  // message, and only for other processes is it serialised. A value that the type forbids (an
  // enumerator that does not exist) is refused as above if somebody outside the process listens;
  // then subscriptions within have got it. Null throws std::invalid_argument.
  bool publish(MessagePtr<T> message) {
    return executor::publish_owned(*writer_, message.release());
  }
  // Likewise. Nobody may change the message any more. It is freed when the last subscription is
  // done with it, possibly on its thread; until then the component that published it stays loaded.
  bool publish(std::shared_ptr<const T> message) {
    return executor::publish_shared(*writer_, std::move(message));
  }
  // Says that the publisher is alive, as publishing does: for Liveliness::manual_by_topic, before
  // its lease is over. Afterwards subscriptions of this process need it to publish.
  void assert_liveliness() const { executor::assert_liveliness(*writer_); }
  const std::string& topic() const noexcept { return executor::topic_of(*writer_); }
  // The writer's number in traces and in MessageInfo.
  std::uint64_t writer_gid() const noexcept { return executor::writer_gid_of(*writer_); }
  // How many messages could not be sent in time so far.
  std::uint64_t unsent_count() const noexcept { return executor::unsent_messages(*writer_); }
  // Subscriptions connected now, in this process and others.
  std::uint32_t subscription_count() const { return executor::matched_readers(*writer_); }

 private:
  std::shared_ptr<executor::Writer> writer_;
};

}  // namespace cie
