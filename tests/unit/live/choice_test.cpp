#include "choice.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

CallbackView callback(const std::string& id, std::int64_t p99, std::uint64_t late) {
  CallbackView view;
  view.logical_id = id;
  view.pid = 7;
  view.host = "robot";
  view.total_late = late;
  if (p99 >= 0) view.response = analysis::Summary{.count = 1, .max = p99, .p50 = p99, .p99 = p99};
  return view;
}

std::vector<std::string> names(const Snapshot& snapshot, SortKey key, std::string_view filter) {
  std::vector<std::string> result;
  for (const auto* chosen : choose(snapshot, key, filter))
    result.push_back(chosen->logical_id);
  return result;
}

using Chosen = std::vector<std::string>;

TEST(Choice, SortsTheLargestFirstAndTheUnmeasuredLast) {
  Snapshot snapshot;
  snapshot.callbacks = {callback("b", -1, 5), callback("c", 10, 0), callback("a", 30, 0)};
  EXPECT_EQ(names(snapshot, SortKey::response, ""), (Chosen{"a", "c", "b"}));
  EXPECT_EQ(names(snapshot, SortKey::late, ""), (Chosen{"b", "a", "c"}));
  EXPECT_EQ(names(snapshot, SortKey::name, ""), (Chosen{"a", "b", "c"}));
}

TEST(Choice, FiltersByNameHostAndPidInAnyCase) {
  Snapshot snapshot;
  snapshot.callbacks = {callback("/Plan@Timer(1)", 1, 0), callback("/drive", 2, 0)};
  snapshot.callbacks[1].pid = 815;
  EXPECT_EQ(names(snapshot, SortKey::name, "plan"), (Chosen{"/Plan@Timer(1)"}));
  EXPECT_EQ(names(snapshot, SortKey::name, "815"), (Chosen{"/drive"}));
  EXPECT_EQ(names(snapshot, SortKey::name, "ROBOT").size(), 2U);
  EXPECT_TRUE(names(snapshot, SortKey::name, "nobody").empty());
}

TEST(Choice, FiltersByTheShortNameToo) {
  Snapshot snapshot;
  snapshot.callbacks = {callback("/a/plan@Timer(100000000)", 1, 0), callback("/drive", 2, 0)};
  snapshot.callbacks[0].name = "plan timer 100 ms";
  EXPECT_EQ(names(snapshot, SortKey::name, "timer 100 MS"), (Chosen{"/a/plan@Timer(100000000)"}));
}

TEST(Choice, EveryKeyHasAName) {
  for (const auto* name : {"p99", "p50", "max", "rate", "late", "missed", "name"}) {
    const auto key = sort_key(name);
    ASSERT_TRUE(key) << name;
    EXPECT_EQ(label(*key), name);
  }
  EXPECT_FALSE(sort_key("size"));
}

}  // namespace
}  // namespace cie::live
