#include <cie/tracepoints/logical_id.hpp>

#include <gtest/gtest.h>

namespace cie {
namespace {

TEST(LogicalId, IsWhatTheExistingExecutorsWrite) {
  EXPECT_EQ(logical_id("/a/b", CallbackKind::timer, "100000000"), "/a/b@Timer(100000000)");
  EXPECT_EQ(logical_id("/b", CallbackKind::subscription, "/scan"), "/b@Subscription(/scan)");
  EXPECT_EQ(logical_id("/b", CallbackKind::service, "/set"), "/b@Service(/set)");
  EXPECT_EQ(logical_id("/b", CallbackKind::client, "/set"), "/b@Client(/set)");
}

TEST(LogicalId, IsTakenApart) {
  const auto id = LogicalId::parse("/a/b@Subscription(/scan)");
  ASSERT_TRUE(id.has_value());
  EXPECT_EQ(id->node, "/a/b");
  EXPECT_EQ(id->kind, "Subscription");
  EXPECT_EQ(id->what, "/scan");
  EXPECT_EQ(id->number, "");
}

TEST(LogicalId, HasANumberWhereSeveralWouldBeCalledAlike) {
  const auto id = LogicalId::parse("/b@Timer(5)#2");
  ASSERT_TRUE(id.has_value());
  EXPECT_EQ(id->what, "5");
  EXPECT_EQ(id->number, "2");
  EXPECT_EQ(LogicalId::without_number("/b@Timer(5)#2"), "/b@Timer(5)");
  EXPECT_EQ(LogicalId::without_number("/b@Timer(5)"), "/b@Timer(5)");
  EXPECT_EQ(LogicalId::without_number("/b#"), "/b#");
  EXPECT_EQ(LogicalId::without_number("/b#2#3"), "/b#2") << "of one whose name has one itself";
}

TEST(LogicalId, EndsWithItsLastParenthesis) {
  EXPECT_EQ(LogicalId::parse("/b@Timer(a)b)")->what, "a)b");
  EXPECT_EQ(LogicalId::parse("/b@Timer(a)#2)")->what, "a)#2");
  EXPECT_EQ(LogicalId::parse("/b@Timer()")->what, "");
}

TEST(LogicalId, IsNotAnyText) {
  for (const char* const text :
       {"", "odd", "?2", "/b/*", "/b@Timer", "/b@Timer(5", "/b@Timer)5(", "/b@Timer(5)x",
        "/b@Timer(5)#", "/b@Timer(5)#x", "/b@Timer(5)#2#3", "/b(5)"}) {
    EXPECT_FALSE(LogicalId::parse(text).has_value()) << text;
  }
}

TEST(LogicalId, HasANodeAndAKindAsExistingExecutorsWriteIt) {
  EXPECT_EQ(LogicalId::node_of("/b@Waitable"), "/b");
  EXPECT_EQ(LogicalId::kind_of("/b@Waitable"), "Waitable");
  EXPECT_EQ(LogicalId::kind_of("/b@Waitable(/x)"), "Waitable");
  EXPECT_EQ(LogicalId::node_of("fusion"), "fusion");
  EXPECT_EQ(LogicalId::kind_of("fusion"), "fusion");
}

}  // namespace
}  // namespace cie
