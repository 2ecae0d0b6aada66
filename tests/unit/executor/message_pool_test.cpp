#include "dds/message_pool.hpp"

#include <cie/executor/message.hpp>

#include <memory>

#include <cie_messages.hpp>
#include <gtest/gtest.h>

namespace cie::executor {
namespace {

using cie_msgs::String;

class MessagePoolTest : public testing::Test {
 protected:
  // Lends a message, has `use` do something with it, and says where it was.
  template <typename Use>
  const void* lend(Use use) {
    MessagePool::Loan message{pool};
    const void* const memory = message.memory();
    use(message);
    return memory;
  }
  MessagePool pool{std::make_shared<const MessageLayout>(MessageTraits<String>::descriptor())};
  MessagePool::MessageHandle kept;
};

TEST_F(MessagePoolTest, LendsTheSameMemoryAgain) {
  const void* const first = lend([](auto&) {});
  EXPECT_EQ(lend([](auto& message) { EXPECT_EQ(message.memory(), message.get()); }), first);
}

TEST_F(MessagePoolTest, LendsNothingThatSomebodyKept) {
  const void* const first = lend([&](auto& message) { kept = message.handle(); });
  EXPECT_NE(lend([](auto&) {}), first);
  EXPECT_EQ(kept.get(), first);
}

TEST_F(MessagePoolTest, LendsTwoAtOnce) {
  lend([&](auto& one) { EXPECT_NE(lend([](auto&) {}), one.get()); });
}

TEST_F(MessagePoolTest, HasNoPartInAMessageOfSomebodyElse) {
  const std::shared_ptr<const String> other{make_message<String>()};
  {
    MessagePool::Loan message{pool};
    message.refer_to(other);
    EXPECT_EQ(message.get(), other.get());
  }
  EXPECT_EQ(other.use_count(), 1);
  EXPECT_NE(lend([](auto&) {}), other.get());
}

TEST_F(MessagePoolTest, GetsItsMemoryBackWhenAMessageOfSomebodyElseTakesItsPlace) {
  const std::shared_ptr<const String> other{make_message<String>()};
  const void* const first = lend([&](auto& message) {
    message.refer_to(other);
    EXPECT_EQ(message.get(), other.get());
  });
  EXPECT_EQ(lend([](auto&) {}), first);
  EXPECT_EQ(other.use_count(), 1);
}

}  // namespace
}  // namespace cie::executor
