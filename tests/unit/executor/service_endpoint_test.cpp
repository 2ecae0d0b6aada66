#include "services/service_endpoint.hpp"

#include <cstring>
#include <string>

#include <gtest/gtest.h>

namespace cie::executor {
namespace {

TEST(EndpointId, IsFoundAgainInItsUserData) {
  const EndpointId id;
  const std::string text = id.user_data("clientid");
  EXPECT_EQ("clientid=" + value_of("clientid", text).value() + ";", text);
  EXPECT_NE(EndpointId{}.guid(), id.guid());
}

TEST(EndpointId, IsWrittenAsRos2WritesIt) {
  const std::string text = EndpointId{}.user_data("serviceid");
  EXPECT_EQ(text.size(), std::strlen("serviceid=") + 16 * 3);
  EXPECT_EQ(text.back(), ';');
  EXPECT_EQ(text[12], '.');
}

TEST(UserData, GivesTheValueOfAKey) {
  EXPECT_EQ(value_of("clientid", "clientid=1.10.2b;"), "1.10.2b");
  EXPECT_EQ(value_of("clientid", "enclave=/;clientid=1.2;typehash=x;"), "1.2");
  EXPECT_EQ(value_of("clientid", "clientid=1.2"), "1.2");
  EXPECT_EQ(value_of("clientid", "clientid=;"), "");
}

TEST(UserData, GivesNothingForAKeyThatIsNotThere) {
  for (const char* const text : {"", ";", ";;", "clientid", "clientid;", "serviceid=1.2;",
                                 "xclientid=1;", "clientidx=1;", "serviceid=clientid=1;"}) {
    EXPECT_EQ(value_of("clientid", text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace cie::executor
