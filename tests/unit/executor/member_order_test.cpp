// What check_member_order() refuses. Without a node: the order alone matters.
#include <cie/executor/member_order.hpp>

#include <cstdint>
#include <memory>
#include <stdexcept>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

using testing::HasSubstr;
using testing::Property;
using testing::Throws;
using Handle = std::shared_ptr<int>;

struct DataAbove final {
  DataAbove() { check_member_order(*this, first, second); }
  std::vector<int> data;
  std::uint8_t small = 0;
  Handle first, second;
};

TEST(MemberOrder, TakesHandlesBelowTheDataInWhateverOrder) {
  EXPECT_NO_THROW(DataAbove{});
  struct Turned final {
    Turned() { check_member_order(*this, second, first); }
    std::uint8_t small = 0;
    Handle first, second;
  };
  EXPECT_NO_THROW(Turned{});
}

struct DataBelow final {
  DataBelow() { check_member_order(*this, handle); }
  Handle handle;
  std::vector<int> data;
};

TEST(MemberOrder, RefusesDataBelowAHandleAndSaysWhere) {
  EXPECT_THAT([] { DataBelow{}; }, Throws<std::logic_error>(Property(
                                       &std::logic_error::what,
                                       HasSubstr("at byte " + std::to_string(sizeof(Handle))))));
}

struct SmallDataBelow final {
  SmallDataBelow() { check_member_order(*this, handle); }
  Handle handle;
  bool is_small = false;
};

struct DataBetween final {
  DataBetween() { check_member_order(*this, first, second); }
  Handle first;
  std::int32_t data = 0;
  Handle second;
};

TEST(MemberOrder, RefusesDataHoweverSmallAndBetweenHandles) {
  EXPECT_THROW(SmallDataBelow{}, std::logic_error);
  EXPECT_THROW(DataBetween{}, std::logic_error);
}

TEST(MemberOrder, RefusesWhatIsNoMember) {
  struct Owner final {
    Handle handle;
  };
  const Owner owner;
  const Handle other;
  EXPECT_THAT([&] { check_member_order(owner, other); },
              Throws<std::logic_error>(Property(&std::logic_error::what, HasSubstr("no member"))));
}

}  // namespace
}  // namespace cie
