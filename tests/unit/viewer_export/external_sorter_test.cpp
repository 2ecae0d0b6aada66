#include "external_sorter.hpp"

#include <cie/viewer_export/output_file.hpp>

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

struct Less {
  bool operator()(std::uint64_t a, std::uint64_t b) const { return a < b; }
};

std::vector<std::uint64_t> sorted(std::size_t records_in_memory, std::uint64_t count) {
  ExternalSorter<std::uint64_t, Less> sorter(records_in_memory, {});
  for (std::uint64_t i = 0; i < count; ++i) {
    sorter.add((i * 7919) % count);  // 7919 is prime: every number below count comes once
  }
  std::vector<std::uint64_t> result;
  sorter.drain([&](std::uint64_t value) { result.push_back(value); });
  return result;
}

TEST(ExternalSorter, SortsInMemoryAndOnDiskAlike) {
  constexpr std::uint64_t kCount = 10'000;
  std::vector<std::uint64_t> expected(kCount);
  for (std::uint64_t i = 0; i < kCount; ++i) {
    expected[i] = i;
  }
  EXPECT_EQ(sorted(kCount + 1, kCount), expected) << "all in memory";
  EXPECT_EQ(sorted(kCount, kCount), expected) << "one run";
  EXPECT_EQ(sorted(17, kCount), expected) << "589 runs";
  EXPECT_EQ(sorted(1, 100), std::vector(expected.begin(), expected.begin() + 100));
}

TEST(ExternalSorter, MergesRunsLongerThanOneBlock) {
  constexpr std::uint64_t kCount = 20'000;  // two runs of 80 kB, read in blocks of 32 kB
  const auto result = sorted(kCount / 2, kCount);
  ASSERT_EQ(result.size(), kCount);
  for (std::uint64_t i = 0; i < kCount; ++i) {
    ASSERT_EQ(result[i], i);
  }
}

TEST(ExternalSorter, OfNothingIsNothing) { EXPECT_TRUE(sorted(10, 0).empty()); }

TEST(ExternalSorter, NamesTheDirectoryItCannotUse) {
  ExternalSorter<std::uint64_t, Less> sorter(1, "/nonexistent/directory");
  try {
    sorter.add(1);
    FAIL() << "spilled into a directory that does not exist";
  } catch (const WriteError& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/directory"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("No such file or directory"), std::string::npos);
  }
}

}  // namespace
}  // namespace cie::viewer_export
