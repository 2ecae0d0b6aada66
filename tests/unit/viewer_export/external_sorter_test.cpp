#include "output/external_sorter.hpp"

#include <cie/viewer_export/output_file.hpp>

#include <array>
#include <cstdint>
#include <string>
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
  EXPECT_EQ(sorted(2 * kCount + 2, kCount), expected) << "all in memory";
  EXPECT_EQ(sorted(2 * kCount, kCount), expected) << "one run";
  EXPECT_EQ(sorted(17, kCount), expected) << "1250 runs";
  EXPECT_EQ(sorted(1, 100), std::vector(expected.begin(), expected.begin() + 100));
}

TEST(ExternalSorter, MergesRunsLongerThanOneBlock) {
  constexpr std::uint64_t kCount = 20'000;  // two runs of 80 kB, read in blocks of 32 kB
  const auto result = sorted(kCount, kCount);
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
    sorter.add(2);
    FAIL() << "spilled into a directory that does not exist";
  } catch (const WriteError& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/directory"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("No such file or directory"), std::string::npos);
  }
}

struct Wide {
  std::int64_t key = 0;
  std::array<std::uint8_t, 13> bytes{};  // no multiple of a word
  double real = 0;
  friend bool operator==(const Wide&, const Wide&) = default;
};

// Values at the ends of what there is, so that steps between them wrap.
Wide wide(std::uint64_t i) {
  constexpr std::array<std::int64_t, 5> kKeys{0, -1, INT64_MIN, INT64_MAX,
                                              1'700'000'000'000'000'000};
  Wide record{.key = kKeys.at(i % 5), .bytes = {}, .real = static_cast<double>(i) / 3};
  for (std::size_t k = 0; k < record.bytes.size(); ++k)
    record.bytes.at(k) = static_cast<std::uint8_t>(i * 37 + k * (i % 3));
  return record;
}

TEST(RecordCodec, GivesBackWhatItWasGiven) {
  RecordCodec<Wide> encoder;
  RecordCodec<Wide> decoder;
  std::array<char, RecordCodec<Wide>::kMostBytes> bytes{};
  for (std::uint64_t i = 0; i < 1000; ++i) {
    const auto* const end = encoder.encode(wide(i), bytes.data());
    ASSERT_LE(end, bytes.data() + bytes.size());
    Wide decoded;
    ASSERT_EQ(decoder.decode(bytes.data(), decoded), end);
    ASSERT_EQ(decoded, wide(i)) << i;
  }
}

TEST(RecordCodec, OfAnEqualRecordIsItsMaskAlone) {
  RecordCodec<Wide> encoder;
  std::array<char, RecordCodec<Wide>::kMostBytes> bytes{};
  const auto record = wide(7);  // with its padding, which a second one need not share
  encoder.encode(record, bytes.data());
  EXPECT_EQ(encoder.encode(record, bytes.data()) - bytes.data(), 1);  // five words: one byte
}

}  // namespace
}  // namespace cie::viewer_export
