// Whom a service may answer, and how seldom it has to look.
#include "services/service_clients.hpp"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace cie::executor {
namespace {

class Clients : public testing::Test {
 protected:
  Clients() {
    clients.begin(
        [this] {
          ++looks;
          return there;
        },
        [this] { ++wakes; });
  }
  ServiceClients clients;
  std::vector<ServiceClients::Client> there;
  int looks = 0;
  int wakes = 0;
};

TEST_F(Clients, AreLookedForOnceHoweverManyThereAre) {
  constexpr std::uint64_t kClients = 300;
  for (std::uint64_t gid = kClients; gid > 0; --gid) {
    there.push_back({.writer_gid = gid, .can_hear = true});
    clients.readers_changed();
    EXPECT_TRUE(clients.can_hear(gid));
  }
  EXPECT_EQ(looks, kClients);
  for (std::uint64_t gid = 1; gid <= kClients; ++gid)
    EXPECT_TRUE(clients.can_hear(gid));
  EXPECT_EQ(looks, kClients);
}

TEST_F(Clients, ThatCannotHearAreLookedForAgainWhenAReaderCame) {
  there = {{.writer_gid = 7, .can_hear = false}};
  EXPECT_FALSE(clients.can_hear(7));
  EXPECT_FALSE(clients.can_hear(7));
  EXPECT_EQ(looks, 1);
  EXPECT_EQ(wakes, 0);
  there = {{.writer_gid = 7, .can_hear = true}};
  clients.readers_changed();
  EXPECT_EQ(wakes, 1);
  EXPECT_TRUE(clients.can_hear(7));
  EXPECT_EQ(looks, 2);
}

TEST_F(Clients, ThatAreGoneAreNotWaitedFor) { EXPECT_TRUE(clients.can_hear(7)); }

TEST(ClientsBefore, MayBeNoticedBeforeAnybodyAsks) {
  ServiceClients clients;
  clients.readers_changed();
  clients.begin([] { return std::vector{ServiceClients::Client{7, true}}; }, [] {});
  EXPECT_TRUE(clients.can_hear(7));
}

}  // namespace
}  // namespace cie::executor
