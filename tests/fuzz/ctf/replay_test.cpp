#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

int answer(const std::string& bytes) {
  return LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

TEST(FuzzCtf, SeedsWholeCutAndChangedAreAnswered) {
  constexpr std::size_t kTrials = 200;  // per seed and kind of damage
  int seeds = 0;
  for (const auto& file : std::filesystem::directory_iterator(CIE_SEEDS)) {
    std::ifstream stream(file.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    EXPECT_EQ(answer(bytes), 0);
    for (std::size_t trial = 0; trial < kTrials; ++trial) {
      const auto at = bytes.size() * trial / kTrials;
      EXPECT_EQ(answer(bytes.substr(0, at)), 0);
      auto changed = bytes;
      changed[at] = static_cast<char>(changed[at] ^ (1 << trial % 8));
      EXPECT_EQ(answer(changed), 0);
    }
    ++seeds;
  }
  EXPECT_GE(seeds, 3);
}

}  // namespace
