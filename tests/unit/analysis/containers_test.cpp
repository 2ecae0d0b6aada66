// The containers of the analyzer's hot path.
#include <cie/analysis/context_number.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <model/by_index.hpp>
#include <model/few.hpp>
#include <model/recent.hpp>
#include <model/sort_rows.hpp>
#include <trackers/flat_map.hpp>

namespace cie::analysis {
namespace {

template <typename Map>
class HashTable : public testing::Test {};
using HashTables =
    testing::Types<FlatMap<std::int64_t, std::uint64_t>, NearMap<std::int64_t, std::uint64_t>,
                   DenseMap<std::int64_t, std::uint64_t>>;
TYPED_TEST_SUITE(HashTable, HashTables);

TYPED_TEST(HashTable, FindsNothingWhereItIsEmpty) {
  const TypeParam map;
  EXPECT_EQ(map.find(0), nullptr);
}

TYPED_TEST(HashTable, KeepsWhatAnOrdinaryMapKeeps) {
  std::mt19937_64 random(1);
  TypeParam map;
  std::unordered_map<std::int64_t, std::uint64_t> expected;
  for (int i = 0; i < 20'000; ++i) {
    // Dense keys, negative ones, and ones that differ in their upper bits only.
    const auto number = static_cast<std::int64_t>(random() % 2'000) - 1'000;
    const auto key = i % 2 == 0 ? number : static_cast<std::int64_t>(random() % 100) << 56U;
    const auto is_known = expected.contains(key);
    const auto [value, is_new] = map.insert(key);
    ASSERT_EQ(is_new, !is_known);
    if (is_new) {
      ASSERT_EQ(*value, 0U);
    }
    map[key] = expected[key] = random();
  }
  for (const auto& [key, value] : expected) {
    const auto* found = map.find(key);
    ASSERT_NE(found, nullptr) << key;
    EXPECT_EQ(*found, value);
  }
  EXPECT_EQ(map.find(5'000), nullptr);
}

TEST(DenseMap, MovesNoValueWhenOthersAreInserted) {
  DenseMap<std::int64_t, std::uint64_t> map;
  std::vector<std::uint64_t*> places;
  for (std::int64_t number = -5'000; number < 5'000; number += 7)
    places.push_back(&map[number]);
  for (std::int64_t number = -5'000; auto* place : places) {
    EXPECT_EQ(map.find(number), place);
    EXPECT_EQ(map.find(number + 1), nullptr);  // of the same group, mostly
    number += 7;
  }
}

TEST(Recent, ForgetsTheOldest) {
  Recent<int, 4> recent;
  EXPECT_EQ(recent.size(), 0U);
  for (int i = 1; i <= 3; ++i)
    recent.push(i);
  EXPECT_EQ(recent.size(), 3U);
  EXPECT_EQ(recent.newest(0), 3);
  EXPECT_EQ(recent.newest(2), 1);
  for (int i = 4; i <= 6; ++i)
    recent.push(i);
  EXPECT_EQ(recent.size(), 4U);
  EXPECT_EQ(recent.newest(0), 6);
  EXPECT_EQ(recent.newest(3), 3);
}

TEST(Recent, FindsTheLatestOfSeveral) {
  Recent<std::pair<int, std::string>, 8> recent;
  recent.push({1, "early"});
  recent.push({1, "late"});
  recent.push({2, "other"});
  const auto* found = recent.find_newest([](const auto& value) { return value.first == 1; });
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->second, "late");
  EXPECT_EQ(recent.find_newest([](const auto& value) { return value.first == 3; }), nullptr);
}

TEST(ByIndex, GrowsToWhatIsAskedFor) {
  enum class Index : std::uint32_t {};
  ByIndex<Index, int> values;
  EXPECT_EQ(values.find(Index{0}), nullptr);
  values[Index{3}] = 7;
  EXPECT_EQ(*values.find(Index{3}), 7);
  EXPECT_EQ(*values.find(Index{2}), 0);
  EXPECT_EQ(values.find(Index{4}), nullptr);
}

TEST(SortRows, IsStable) {
  struct Row {
    int key = 0;
    std::string text;
  };
  std::vector<Row> rows;
  rows.reserve(100);
  for (const auto& [key, text] : {std::pair(2, "c"), {1, "a"}, {2, "b"}, {0, "d"}, {1, "e"}})
    rows.push_back({.key = key, .text = text});
  sort_rows(rows, [](const Row& a, const Row& b) { return a.key < b.key; });
  std::string order;
  for (const auto& row : rows)
    order += row.text;
  EXPECT_EQ(order, "daecb");
  EXPECT_EQ(rows.capacity(), 5U);
  const auto* const first = rows.data();
  sort_rows(rows, {}, &Row::key);
  EXPECT_EQ(rows.data(), first) << "they are sorted";
  std::vector<Row> none;
  sort_rows(none, [](const Row&, const Row&) { return true; });
  EXPECT_TRUE(none.empty());
}

TEST(ContextNumber, StandsForAnOptional) {
  constexpr ContextNumber<std::int64_t> kAbsent;
  EXPECT_FALSE(kAbsent.has_value());
  EXPECT_EQ(kAbsent.value_or(-1), -1);
  EXPECT_EQ(std::optional<std::int64_t>(kAbsent), std::nullopt);
  const ContextNumber<std::int64_t> pid = std::optional<std::int64_t>(4'194'304);
  EXPECT_EQ(*pid, 4'194'304);
  EXPECT_EQ(std::optional<std::int64_t>(pid), 4'194'304);
  EXPECT_EQ(*ContextNumber<std::int64_t>(-1), -1);
  EXPECT_EQ(kAbsent, ContextNumber<std::int64_t>()) << "of std::optional and it, they would differ";
  EXPECT_LT(kAbsent, ContextNumber<std::int64_t>(-1));
}

TEST(ContextNumber, HoldsWhatTheKernelNumbers) {
  EXPECT_FALSE(ContextNumber<std::int64_t>(std::int64_t{1} << 31U));
  EXPECT_TRUE(ContextNumber<std::int64_t>((std::int64_t{1} << 31U) - 1));
}

// The same as of a vector, which is what moves into one when a second comes.
TEST(Few, KeepsWhatAVectorKeeps) {
  std::mt19937_64 random(2);
  std::vector<int> numbers(8);
  Few<int*> few;
  std::vector<int*> expected;
  for (int i = 0; i < 2'000; ++i) {
    auto* const number = &numbers[random() % numbers.size()];
    switch (random() % 8) {
      case 0:
      case 1:
      case 2:
        few.push_back(number);
        expected.push_back(number);
        break;
      case 3:
        if (expected.empty()) break;
        {
          const auto place = static_cast<std::ptrdiff_t>(random() % expected.size());
          const auto* next = few.erase(few.begin() + place);
          expected.erase(expected.begin() + place);
          EXPECT_EQ(next, few.begin() + place);
        }
        break;
      case 4:
      case 5:
        few.remove(number);
        std::erase(expected, number);
        break;
      case 6:
        if (i % 20 != 0) break;
        few.clear();
        expected.clear();
        break;
      default:
        break;
    }
    ASSERT_EQ(few.size(), expected.size());
    EXPECT_EQ(few.empty(), expected.empty());
    ASSERT_TRUE(std::equal(few.begin(), few.end(), expected.begin(), expected.end()));
    ASSERT_TRUE(std::equal(few.rbegin(), few.rend(), expected.rbegin(), expected.rend()));
    if (expected.empty()) continue;
    EXPECT_EQ(few.front(), expected.front());
    EXPECT_EQ(few.back(), expected.back());
  }
}

TEST(Few, OwnsWhatItIsGiven) {
  Few<std::unique_ptr<int>> few;
  few.push_back(std::make_unique<int>(1));
  few.push_back(std::make_unique<int>(2));
  auto second = std::move(few.back());
  few.erase(few.end() - 1);
  EXPECT_EQ(*second, 2);
  ASSERT_EQ(few.size(), 1U);
  auto moved = std::move(few);
  EXPECT_EQ(*moved.front(), 1);
}

}  // namespace
}  // namespace cie::analysis
