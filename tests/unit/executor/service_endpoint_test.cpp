#include "service_endpoint.hpp"

#include <cstring>
#include <string>

#include <gtest/gtest.h>

namespace cie::executor {
namespace {

TEST(EndpointId, IsFoundAgainInItsUserData) {
  const EndpointId id;
  EXPECT_EQ(client_guid(id.user_data("clientid")), id.guid());
  EXPECT_EQ(client_guid("enclave=/;" + id.user_data("clientid")), id.guid());
  EXPECT_NE(EndpointId{}.guid(), id.guid());
}

TEST(EndpointId, IsWrittenAsRos2WritesIt) {
  const std::string text = EndpointId{}.user_data("serviceid");
  EXPECT_EQ(text.size(), std::strlen("serviceid=") + 16 * 3);
  EXPECT_EQ(text.back(), ';');
  EXPECT_EQ(text[12], '.');
}

TEST(ClientGuid, IsTheFirstHalf) {
  const unsigned char bytes[8] = {0x01, 0x10, 0x2b, 0xff, 0x00, 0x7f, 0x80, 0x09};
  std::uint64_t expected = 0;
  std::memcpy(&expected, bytes, sizeof expected);
  EXPECT_EQ(client_guid("clientid=01.10.2b.ff.00.7f.80.09.01.02.03.04.05.06.07.08;"), expected);
}

TEST(ClientGuid, IsNoneOfWhatIsNotOne) {
  for (const char* const text :
       {"", "clientid", "clientid=", "clientid=;", "clientid=01", "clientid=01.02.03.04.05.06.07",
        "clientid=xx.02.03.04.05.06.07.08;", "clientid=1.2.3.4.5.6.7.8;", "clientid=-1.02",
        "clientid=01.02.03.04.05.06.07.08", "clientid=01,02,03,04,05,06,07,08;",
        "serviceid=01.02.03.04.05.06.07.08;"}) {
    EXPECT_EQ(client_guid(text), std::nullopt) << text;
  }
}

}  // namespace
}  // namespace cie::executor
