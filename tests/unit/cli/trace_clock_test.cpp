#include "trace_clock.hpp"

#include <cstdint>
#include <cstring>
#include <string>

#include <gtest/gtest.h>

namespace cie::cli {
namespace {

constexpr const char* kClock =
    "trace {\n\tmajor = 1;\n};\n"
    "clock {\n\tname = \"monotonic\";\n\tfreq = 1000000000; /* Hz */\n"
    "\t/* clock value offset from Epoch is: offset * (1/freq) */\n"
    "\toffset = 1649336703604441153;\n};\n";

// One metadata packet as CTF 1.8 lays it out: 37 bytes of header, content, padding.
std::string packet(const std::string& content, std::size_t padding = 5) {
  std::string bytes(37, '\0');
  const std::uint32_t magic = 0x75D11D57;
  const auto content_bits = static_cast<std::uint32_t>((37 + content.size()) * 8);
  const auto packet_bits = static_cast<std::uint32_t>(content_bits + padding * 8);
  std::memcpy(bytes.data(), &magic, 4);
  std::memcpy(bytes.data() + 24, &content_bits, 4);
  std::memcpy(bytes.data() + 28, &packet_bits, 4);
  return bytes + content + std::string(padding, '\0');
}

TEST(ClockOffset, IsTheSumOfSecondsAndNanoseconds) {
  EXPECT_EQ(clock_offset_ns(kClock), 1'649'336'703'604'441'153);
  EXPECT_EQ(clock_offset_ns("\nclock {\n freq = 1000000000;\n offset_s = 17;\n offset = 5;\n};"),
            17'000'000'005);
  EXPECT_EQ(clock_offset_ns("\nclock {\n name = x;\n};"), 0) << "CTF's default";
}

TEST(ClockOffset, IsEmptyWhenItCannotBeUsed) {
  EXPECT_EQ(clock_offset_ns(""), std::nullopt);
  EXPECT_EQ(clock_offset_ns("\nclock {\n freq = 27000000;\n offset = 5;\n};"), std::nullopt);
  EXPECT_EQ(clock_offset_ns("\nclock {\n offset_s = 9223372036854775807;\n};"), std::nullopt);
}

TEST(MetadataText, JoinsPackets) {
  const std::string text = kClock;
  const auto split = packet(text.substr(0, 60)) + packet(text.substr(60));
  EXPECT_EQ(metadata_text(split), text);
  EXPECT_EQ(metadata_text("/* CTF 1.8 */ plain text of some length"),
            "/* CTF 1.8 */ plain text of some length");
}

TEST(MetadataText, EndsAtADamagedPacket) {
  auto bytes = packet("first") + packet("second");
  const std::uint32_t huge = 0xFFFFFFFF;
  std::memcpy(bytes.data() + packet("first").size() + 28, &huge, 4);
  EXPECT_EQ(metadata_text(bytes), "first");
  EXPECT_EQ(metadata_text(packet("x").substr(0, 36)).size(), 36U) << "too short for a packet";
}

TEST(FindClockOffset, OfNothingIsEmpty) {
  EXPECT_EQ(find_clock_offset({"/nonexistent", "/dev/null"}), std::nullopt);
}

}  // namespace
}  // namespace cie::cli
