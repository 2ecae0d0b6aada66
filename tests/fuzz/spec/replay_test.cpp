#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gtest/gtest.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

TEST(FuzzSpec, SeedsAndTheirPrefixesAreAnswered) {
  int seeds = 0;
  for (const auto& file : std::filesystem::directory_iterator(CIE_SEEDS)) {
    std::ifstream stream(file.path(), std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
    for (std::size_t size = 0; size <= text.size(); ++size) {
      EXPECT_EQ(LLVMFuzzerTestOneInput(bytes, size), 0);
    }
    ++seeds;
  }
  EXPECT_GE(seeds, 3);
}

}  // namespace
