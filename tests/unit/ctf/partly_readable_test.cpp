// Of what cannot be read as a whole everything is read that can be, and told what is not.
#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/recorded_events.hpp>

#include "ctf_trace.hpp"
#include "vocabulary/tracer_clock.hpp"

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string integer_of(std::uint64_t value, unsigned bytes) {
  std::string text;
  for (unsigned i = 0; i < bytes; ++i)
    text += static_cast<char>(value >> 8 * i & 0xff);
  return text;
}

const std::string kTypesOfPart =
    "typealias integer { size = 8; } := u8; typealias integer { size = 32; } := u32;\n"
    "typealias integer { size = 64; } := u64;\n"
    "clock { name = c; freq = 1000000000; };\n"
    "typealias integer { size = 64; map = clock.c.value; } := time_t;\n"
    "trace { major = 1; minor = 8; byte_order = le; packet.header := struct { u32 magic; }; };\n";
const std::string kMagicOfPart = integer_of(0xC1FC1FC1, 4);

std::vector<std::string> lines_with(const std::string& metadata, const std::string& stream) {
  TraceFolder folder;
  folder.write("metadata", metadata);
  folder.write("stream", stream);
  return read(folder);
}

TEST(PartlyReadable, AContentWithoutASizeOfItsPacketIsThePacket) {
  const auto packet = kMagicOfPart + integer_of(12 * 8, 4) + integer_of(7, 4);
  EXPECT_THAT(
      lines_with(kTypesOfPart + "stream { packet.context := struct { u32 content_size; }; };\n"
                                "event { name = e; fields := struct { u32 f; }; };",
                 packet + packet + packet),
      ElementsAre("0 e on ?", "0 e on ?", "0 e on ?"));
}

// As of tracers that write no packets.
class WithoutPackets : public testing::Test {
 protected:
  WithoutPackets() {
    folder_.write(
        "metadata",
        "typealias integer { size = 8; } := u8; typealias integer { size = 32; } := u32;\n"
        "trace { major = 1; minor = 8; byte_order = le; };\n"
        "stream { event.header := struct { u32 timestamp; u8 id; }; };\n"
        "event { name = e; id = 1; fields := struct { u32 f; }; };");
    for (std::uint64_t i = 1; i <= 19; ++i)
      events_ += event(i, 1);
  }
  static std::string event(std::uint64_t time, std::uint64_t id) {
    return integer_of(time, 4) + integer_of(id, 1) + integer_of(0, 4);
  }

  TraceFolder folder_;
  std::string events_;  // 19, of 9 bytes each
};

TEST_F(WithoutPackets, EventsBeforeOneThatCannotBeReadAreRead) {
  folder_.write("stream", events_ + event(20, 77) + event(21, 1));
  const auto lines = read(folder_);
  ASSERT_EQ(lines.size(), 20U);
  EXPECT_EQ(lines.front(), "1 e on ?");
  EXPECT_EQ(lines[18], "19 e on ?");
  EXPECT_EQ(lines.back(), "damaged at byte 171: an event's id is not in the metadata (id 77)");
}

TEST_F(WithoutPackets, WhatFollowsLeavesT1Undecided) {
  folder_.write("stream", events_ + event(20, 77));
  const std::vector<std::filesystem::path> traces{folder_.path()};
  const auto result = analyze(traces, {});
  EXPECT_EQ(result.report.trace.events, 19U);
  for (const auto& rule : result.verdicts.rules) {
    if (rule.id == "T1") {
      EXPECT_EQ(rule.verdict, Verdict::inconclusive);
    }
  }
}

TEST_F(WithoutPackets, AnEventThatIsCutIsMissing) {
  folder_.write("stream", events_ + "x");
  const auto lines = read(folder_);
  ASSERT_EQ(lines.size(), 20U);
  EXPECT_THAT(lines.back(), HasSubstr("at byte 171: an event reaches beyond"));
}

TEST_F(WithoutPackets, WithoutAnyGoodEventNothingCanBeRead) {
  folder_.write("stream", event(20, 77));
  EXPECT_THROW(read(folder_), UnreadableTrace);
}

TEST(PartlyReadable, ADamagedPacketNamesTheByteOfTheEvent) {
  auto packets =
      std::vector<PacketText>{{.begin = 100, .end = 190, .ticks = {{110}, {120}}},
                              {.begin = 200, .end = 290, .ticks = {{210}}, .sequence = 1}};
  auto bytes = bytes_of(packets);
  bytes[80 + 6] = '\x63';  // the id of the second event
  EXPECT_THAT(
      lines_with(metadata(), bytes),
      ElementsAre("damaged at byte 0: an event's id is not in the metadata (id 99), in byte 86",
                  "210 tick on 0"));
}

constexpr auto kBeyondTime = std::uint64_t{1} << 63U;

std::string with_times(const std::vector<std::uint64_t>& times, std::uint64_t begin) {
  std::string events;
  for (const auto time : times)
    events += integer_of(0, 4) + integer_of(time, 8) + integer_of(1, 4);
  const auto size = (4 + 4 * 8 + events.size()) * 8;
  return kMagicOfPart + integer_of(begin, 8) + integer_of(times.empty() ? begin : times.back(), 8) +
         integer_of(size, 8) + integer_of(size, 8) + events;
}
const std::string kWithTimesOfPart =
    kTypesOfPart +
    "stream { packet.context := struct { time_t timestamp_begin; time_t timestamp_end;\n"
    " u64 content_size; u64 packet_size; };\n"
    " event.header := struct { u32 id; time_t timestamp; }; };\n"
    "event { name = e; id = 0; fields := struct { u32 f; }; };";

TEST(PartlyReadable, TimesBeyond63BitsAreRefused) {
  const auto good = with_times({1000, 1001}, 1000);
  EXPECT_THAT(
      lines_with(kWithTimesOfPart, good + with_times({kBeyondTime, kBeyondTime + 1}, kBeyondTime)),
      ElementsAre("1000 e on ?", "1001 e on ?",
                  "damaged at byte 68: a time is 2^63 nanoseconds or more"));
  auto late = with_times({2000, kBeyondTime, 2001}, 2000);
  EXPECT_THAT(lines_with(kWithTimesOfPart, good + late),
              ElementsAre("1000 e on ?", "1001 e on ?",
                          "damaged at byte 68: a time is 2^63 nanoseconds or more, in byte 120"));
  EXPECT_THROW(lines_with(kWithTimesOfPart, with_times({kBeyondTime}, kBeyondTime)),
               UnreadableTrace);
}

TEST(PartlyReadable, TimesOfAnyFrequencyAreBounded) {
  constexpr auto kMost = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(time_of_cycles(kBeyondTime - 2, 1'000'000'000).ns,
            static_cast<std::int64_t>(kBeyondTime - 2));
  EXPECT_EQ(time_of_cycles(kBeyondTime, 1'000'000'000), kLatest);
  EXPECT_EQ(time_of_cycles(kMost, 1), kLatest);
  EXPECT_EQ(time_of_cycles(kMost, kMost).ns, 1'000'000'000);
  for (const std::uint64_t frequency :
       {std::uint64_t{1}, std::uint64_t{3}, std::uint64_t{1'000'000}, std::uint64_t{1'000'000'000},
        std::uint64_t{1'999'999'999}}) {
    const auto last = most_cycles(frequency);
    EXPECT_LT(time_of_cycles(last, frequency), kLatest) << frequency;
    EXPECT_EQ(time_of_cycles(last + 1, frequency), kLatest) << frequency;
  }
  EXPECT_EQ(most_cycles(kMost), kMost);
  EXPECT_EQ(clock_offset(0, static_cast<std::uint64_t>(-5), 1'000'000'000), -5) << "offsets wrap";
}

// Beside a class that can be read, one that cannot.
class MalformedClass : public testing::TestWithParam<const char*> {
 protected:
  MalformedClass() {
    folder_.write("metadata", kTypesOfPart +
                                  "stream { packet.context := struct { u32 content_size; };\n"
                                  " event.header := struct { u8 id; }; };\n"
                                  "event { name = bad; id = 0; fields := " +
                                  GetParam() +
                                  "; };\n"
                                  "event { name = good; id = 1; fields := struct { u32 f; }; };");
  }
  static std::string packet(std::uint64_t id) {
    return kMagicOfPart + integer_of(13 * 8, 4) + integer_of(id, 1) + integer_of(7, 4);
  }
  std::vector<std::filesystem::path> traces() const { return {folder_.path()}; }

  TraceFolder folder_;
};

TEST_P(MalformedClass, IsToldByEveryReader) {
  folder_.write("stream", packet(1) + packet(1));
  EXPECT_THAT(read(folder_), ElementsAre("0 good on ?", "0 good on ?"));
  const auto report = analyze(traces(), {}).report;
  ASSERT_THAT(report.defects, testing::SizeIs(testing::Ge(1U)));
  const auto& defect = report.defects.front();
  EXPECT_EQ(defect.kind, DefectKind::malformed_classes);
  EXPECT_EQ(defect.count, 1U);
  EXPECT_THAT(defect.advice, HasSubstr("event \"bad\": "));
  for (const bool has_fields : {true, false}) {
    std::vector<std::string> names;
    const auto missing = read_recorded_events(
        traces(), {.wants = [](std::string_view) { return true; }, .has_fields = has_fields},
        [&names](const RecordedEvent& event) { names.emplace_back(event.name); });
    EXPECT_THAT(names, ElementsAre("good", "good"));
    EXPECT_EQ(missing.malformed, 1U);
    EXPECT_THAT(missing.why_malformed, HasSubstr("event \"bad\": "));
  }
}

TEST_P(MalformedClass, CostsThePacketsThatHaveItsEvents) {
  folder_.write("stream", packet(1) + packet(0) + packet(1));
  EXPECT_THAT(read(folder_),
              ElementsAre("0 good on ?",
                          AllOf(HasSubstr("malformed"), HasSubstr("bad"), HasSubstr("in byte 21")),
                          "0 good on ?"));
}

INSTANTIATE_TEST_SUITE_P(OfAnyFault, MalformedClass,
                         testing::Values("struct { no_type x; }", "struct { u32 x[nowhere]; }",
                                         "struct { integer { size = 99; } x; string \"y\"; }",
                                         "struct { u32 x; } align(3)", "u32"));

TEST(PartlyReadable, WhatIsMalformedBeyondMeasureIsRefused) {
  std::string text = kTypesOfPart + "stream { event.header := struct { u8 id; }; };\n";
  for (int i = 0; i < 200; ++i)
    text +=
        "event { name = e; id = " + std::to_string(i) + "; fields := struct { no_type x; }; };\n";
  EXPECT_THROW(lines_with(text, "x"), UnreadableTrace);
}

}  // namespace
}  // namespace cie::test
