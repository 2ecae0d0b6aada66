#include <cie/tracepoints/nearest_name.hpp>

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie {
namespace {

const std::vector<std::string> kOptions{"--format", "--output", "--spec", "--help", "-o"};

TEST(NearestName, FindsWhatWasMeant) {
  EXPECT_EQ(nearest_name("--fromat", kOptions), "--format") << "neighbours swapped";
  EXPECT_EQ(nearest_name("--formt", kOptions), "--format") << "a letter left out";
  EXPECT_EQ(nearest_name("--specs", kOptions), "--spec") << "a letter too many";
  EXPECT_EQ(nearest_name("--outfut", kOptions), "--output") << "a wrong letter";
}

TEST(NearestName, SaysNothingRatherThanNonsense) {
  EXPECT_EQ(nearest_name("--verbose", kOptions), "");
  EXPECT_EQ(nearest_name("-x", kOptions), "");
  EXPECT_EQ(nearest_name("", kOptions), "");
  EXPECT_EQ(nearest_name(std::string(1'000'000, 'x'), kOptions), "");
}

TEST(NearestName, KnowsIdsOfCallbacks) {
  const std::vector<std::string> ids{"/sensing/lidar@Timer(100000000)",
                                     "/sensing/lidar@Subscription(/sensing/trigger)"};
  EXPECT_EQ(nearest_name("/sensing/lidar@Timer(10000000)", ids), ids[0]);
  EXPECT_EQ(nearest_name("/sesning/lidar@Subscription(/sensing/triger)", ids), ids[1]);
  EXPECT_EQ(nearest_name("/control/brake@Service(/control/release)", ids), "");
}

TEST(NearestName, TakesAPeriodWithItsUnit) {
  const std::vector<std::string> ids{"/a/slow@Timer(100000000)", "/a/slow@Timer(20000000)"};
  EXPECT_EQ(nearest_name("/a/slow@Timer(20ms)", ids), ids[1]);
  EXPECT_EQ(nearest_name("/a/slo@Timer(0.1s)", ids), ids[0]);
  EXPECT_EQ(nearest_name("/a/slow@Timer(20ms", ids), ids[1]);
  EXPECT_EQ(nearest_name("/b/fast@Timer(20 apples)", ids), "");
}

// What ids have in common with all others excuses no wrong letters.
TEST(NearestName, JudgesIdsByWhereTheyDiffer) {
  EXPECT_EQ(nearest_name("/a/plam@Timer(20000000)", {"/a/slow@Timer(20000000)"}), "");
  EXPECT_EQ(nearest_name("/a/plam@Timer(20000000)", {"/a/plan@Timer(20000000)"}),
            "/a/plan@Timer(20000000)");
  EXPECT_EQ(nearest_name("/plan@Timer(20000000)", {"/control/plan@Timer(20000000)"}),
            "/control/plan@Timer(20000000)")
      << "a namespace left out";
}

TEST(NearestName, IsSaidAsAQuestion) {
  EXPECT_EQ(did_you_mean("--fromat", kOptions), "; did you mean \"--format\"?");
  EXPECT_EQ(did_you_mean("--verbose", kOptions), "");
}

}  // namespace
}  // namespace cie
