// What a variant costs to lay out grows as its options do: none is held against every label of the tag.
#include "metadata_error.hpp"

#include <algorithm>
#include <cstdint>
#include <ctime>
#include <string>

#include <gtest/gtest.h>

namespace cie::test {
namespace {

std::int64_t used_cpu_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

std::string tsdl(int count) {
  std::string labels;
  std::string options;
  for (int i = 0; i < count; ++i) {
    labels += (i == 0 ? "o" : ", o") + std::to_string(i);
    options += "u32 o" + std::to_string(i) + "; ";
  }
  return "typealias integer { size = 32; } := u32;\n"
         "trace { major = 1; minor = 8; byte_order = le; };\n"
         "event { name = e; fields := struct { enum : u32 { " +
         labels + " } tag; variant <tag> { " + options + " } v; }; };";
}

std::string json(int count) {
  const std::string u32 =
      R"({"type":"fixed-length-unsigned-integer","length":32,"byte-order":"little-endian"})";
  std::string options;
  for (int i = 0; i < count; ++i) {
    const auto value = std::to_string(i);
    options += std::string(i == 0 ? "" : ",") + R"({"name":"o)" + value +
               R"(","selector-field-ranges":[[)" + value + ',' + value + R"(]],"field-class":"u"})";
  }
  return "\x1e{\"type\":\"preamble\",\"version\":2}\n\x1e"
         R"({"type":"field-class-alias","name":"u","field-class":)" +
         u32 + "}\n\x1e" + R"({"type":"data-stream-class"})" + "\n\x1e" +
         R"({"type":"event-record-class","payload-field-class":{"type":"structure","member-classes":[)" +
         R"({"name":"tag","field-class":"u"},{"name":"v","field-class":{"type":"variant",)" +
         R"("selector-field-location":{"path":["tag"]},"options":[)" + options + "]}}]}}\n";
}

// The least of several.
std::int64_t cost_of(const std::string& metadata) {
  auto least = std::int64_t{1} << 62;
  for (int i = 0; i < 3; ++i) {
    const auto begin = used_cpu_time();
    EXPECT_EQ(error_of(metadata), "none");
    least = std::min(least, used_cpu_time() - begin);
  }
  return least;
}

TEST(VariantGrowth, IsLinear) {
  constexpr int kFew = 1'000;
  constexpr int kTimes = 8;
  for (const auto& metadata : {tsdl, json}) {
    EXPECT_LE(cost_of(metadata(kTimes * kFew)), cost_of(metadata(kFew)) * kTimes * 5 / 2);
  }
}

}  // namespace
}  // namespace cie::test
