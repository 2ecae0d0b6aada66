// Bytes that are no spec end in one clear error: no crash, no hang, no memory beyond the file's.
#include <cie/tracepoints/scheduling_spec.hpp>

#include "spec_error.hpp"

#include <cstddef>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string repeat(std::string_view text, std::size_t times) {
  std::string all;
  all.reserve(text.size() * times);
  for (std::size_t i = 0; i < times; ++i)
    all += text;
  return all;
}

TEST(HostileSpec, IsNotText) {
  using namespace std::string_literals;
  EXPECT_THAT(error_of("callback_groups: []\n\xff\n"), StartsWith("spec.yaml:2: not UTF-8"));
  EXPECT_THAT(error_of("\xc0\xaf"), HasSubstr("not UTF-8"));          // overlong
  EXPECT_THAT(error_of("a: \xed\xa0\x80"), HasSubstr("not UTF-8"));   // surrogate
  EXPECT_THAT(error_of("\xf4\x90\x80\x80"), HasSubstr("not UTF-8"));  // beyond U+10FFFF
  EXPECT_THAT(error_of("a: \xe2\x82"), HasSubstr("not UTF-8"));       // cut
  EXPECT_THAT(error_of("c\0a\0"s), HasSubstr("control character"));   // UTF-16
  EXPECT_THAT(error_of("\x7f"
                       "ELF\x02\x01"),
              HasSubstr("control character"));
  EXPECT_EQ(error_of("hardware_info: {model: \"µ-€-𝛑\"}"), "");
  EXPECT_EQ(error_of("\xef\xbb\xbf"
                     "callback_groups: []\r\n"),
            "");
}

TEST(HostileSpec, HidesTerminalEscapesInAnId) {
  const auto error = error_of("callback_groups:\n  - id: \"/a\\e[31m\"\n");
  EXPECT_THAT(error, HasSubstr("control character"));
  EXPECT_EQ(error.find('\x1b'), std::string::npos);
  EXPECT_THAT(error_of("callback_groups:\n  - id: |\n      /a\n    nice: 0\n"),
              HasSubstr("line break"));
}

TEST(HostileSpec, LooksLikeSomethingElse) {
  // A right-to-left override, as bytes and as YAML's escape; a zero-width space; an isolate; C1's
  // CSI.
  EXPECT_THAT(
      error_of("callback_groups:\n  - id: /a\xe2\x80\xae/b\n"),
      AllOf(StartsWith("spec.yaml:2: "), HasSubstr("/a\\u{202e}/b"), HasSubstr("bidirectional")));
  EXPECT_THAT(error_of("callback_groups:\n  - nice: 0\n    id: \"/a\\u202e/b\"\n"),
              AllOf(StartsWith("spec.yaml:3: "), HasSubstr("/a\\u{202e}/b")));
  EXPECT_THAT(error_of("non_ros_threads:\n  - name: w\xe2\x80\x8b\n"), StartsWith("spec.yaml:2: "));
  EXPECT_THAT(error_of("chains:\n  - name: \"c\\u2066\"\n    callbacks: [/a@Timer(1)]\n"),
              StartsWith("spec.yaml:2: "));
  EXPECT_THAT(error_of("chains:\n  - name: c\n    callbacks:\n      - \"/a\\x9b@Timer(1)\"\n"),
              StartsWith("spec.yaml:4: "));
  EXPECT_EQ(error_of("callback_groups:\n  - id: \"/größe@Timer(1)\"  # \xe2\x80\xae\n"), "");
}

TEST(HostileSpec, IsNotYaml) {
  EXPECT_THAT(error_of("callback_groups:\n  - id: \"a\n"), HasSubstr("not YAML"));
  EXPECT_THAT(error_of("a: b: c"), HasSubstr("not YAML"));
  EXPECT_THAT(error_of("callback_groups: [}"), HasSubstr("; check the indentation and brackets"));
  EXPECT_THAT(error_of("callback_groups: [}"), HasSubstr("not YAML"));
  EXPECT_THAT(error_of("a: *unknown"), StartsWith("spec.yaml:1: "));
}

// More than a second of each second.
TEST(HostileSpec, AllowsAThreadMoreForeignWorkThanThereIsTime) {
  EXPECT_EQ(error_of("callback_groups:\n  - {id: a, foreign_work_budget: 1s}\n"), "");
  EXPECT_THAT(error_of("callback_groups:\n  - {id: a, foreign_work_budget: 2s}\n"),
              HasSubstr("\"foreign_work_budget\" is \"2s\"; write a whole number from 0 to "
                        "1000000000 of nanoseconds"));
}

TEST(HostileSpec, IsTooLarge) {
  EXPECT_THAT(error_of("#" + std::string(std::size_t{4} << 20U, 'x')), HasSubstr("4 MiB"));
  EXPECT_THAT(error_of("chains: [{name: c, callbacks: [" + repeat("a,", 1001) + "]}]"),
              HasSubstr("more than 1000 callbacks"));
}

TEST(HostileSpec, IsNestedTooDeeply) {
  for (const auto* open : {"[", "{", "- ", "? ", "[{", "{a: "}) {
    EXPECT_THAT(error_of(repeat(open, 100'000)), StartsWith("spec.yaml:")) << open;
  }
  EXPECT_THAT(error_of(repeat("[", 65) + repeat("]", 65)), HasSubstr("nested too deeply"));
}

TEST(HostileSpec, IsAnAliasBomb) {
  std::string bomb = "a: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 30; ++i) {
    const auto previous = "*a" + std::to_string(i - 1);
    bomb += "k" + std::to_string(i) + ": &a" + std::to_string(i) + " [" +
            repeat(previous + ", ", 10) + "]\n";
  }
  EXPECT_THAT(error_of(bomb), HasSubstr("unknown key"));
  EXPECT_THAT(error_of("chains: &a [*a]"), HasSubstr("inside the value it names"));
  // Lists shared by many chains are counted each time.
  std::string shared = "chains:\n  - {name: c, callbacks: &ids [" + repeat("a,", 1000) + "]}\n";
  for (int i = 0; i < 1000; ++i)
    shared += "  - {name: " + std::to_string(i) + ", callbacks: *ids}\n";
  EXPECT_THAT(error_of(shared), HasSubstr("more than 100000 callbacks"));
}

TEST(HostileSpec, AnchorsOfHonestFilesWork) {
  const auto spec = SchedulingSpec::parse(R"(
callback_groups:
  - {id: a, affinity: &cpus [2, 3]}
  - {id: b, affinity: *cpus}
)",
                                          "spec.yaml");
  EXPECT_EQ(spec.callbacks()[1].parameters.cpus, spec.callbacks()[0].parameters.cpus);
}

TEST(HostileSpec, RepeatsATokenWithoutEnd) {
  for (const auto* token : {"\n", "---\n", "...\n", "a: ", "!t ", "&a ", "*a ", "\"", "'", "|\n",
                            "#", "%YAML 1.2\n", "- a\n", "? a\n", ": ", "a\n", "\t", ",", "]"}) {
    EXPECT_NE(error_of(repeat(token, 20'000)), "") << token;
  }
}

}  // namespace
}  // namespace cie
