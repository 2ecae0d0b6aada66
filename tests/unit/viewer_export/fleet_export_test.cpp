#include <cie/viewer_export/fleet_export.hpp>

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

analysis::Report report_of(std::int64_t begin_realtime_ns) {
  analysis::Report report;
  report.trace.begin = analysis::Timestamp{5};
  report.trace.end = analysis::Timestamp{9};
  report.trace.begin_realtime_ns = begin_realtime_ns;
  report.trace.hosts = {"robot"};
  report.processes.push_back(
      {.host = "robot", .boot_id = "b", .pid = 7, .name = "app", .executor = std::nullopt});
  return report;
}

TEST(FleetExport, TheDayIsThatOfTheBeginInUtc) {
  constexpr std::int64_t kLeapDay = 1'709'164'800 * kSecond;  // date -u -d 2024-02-29 +%s
  EXPECT_EQ(day_text(identify(report_of(kLeapDay), {})), "2024-02-29");
  EXPECT_EQ(day_text(identify(report_of(kLeapDay + 86'399 * kSecond), {})), "2024-02-29");
  EXPECT_EQ(day_text(identify(report_of(kLeapDay + 86'400 * kSecond), {})), "2024-03-01");
  EXPECT_EQ(day_text(identify(report_of(kLeapDay - 1), {})), "2024-02-28");
}

TEST(FleetExport, WithoutWallClockTheDayIsUnknownUnlessALabelSaysIt) {
  auto report = report_of(0);
  report.trace.begin_realtime_ns.reset();
  EXPECT_FALSE(identify(report, {}).day.has_value());
  EXPECT_EQ(day_text(identify(report, {})), "1970-01-01");
  EXPECT_EQ(day_text(identify(report, {label_of("day=2026-11-20")})), "2026-11-20");
}

TEST(FleetExport, ARecordingIsTheSameWhateverItIsCalled) {
  const auto report = report_of(kSecond);
  auto moved = report;
  moved.trace.paths = {"elsewhere"};
  moved.trace.events = 12;  // a later version may count another way
  const auto id = identify(report, {}).id;
  EXPECT_EQ(id, identify(moved, {label_of("software=2")}).id);
  EXPECT_EQ(id.size(), 32U);
  EXPECT_EQ(id.find_first_not_of("0123456789abcdef"), std::string::npos);
}

TEST(FleetExport, AnotherHostBootProcessOrWindowIsAnotherRecording) {
  const auto report = report_of(kSecond);
  const auto id = identify(report, {}).id;
  auto other = report;
  other.trace.hosts = {"robot2"};
  EXPECT_NE(id, identify(other, {}).id);
  other = report;
  other.processes.front().boot_id = "c";
  EXPECT_NE(id, identify(other, {}).id);
  other = report;
  other.processes.front().pid = 8;
  EXPECT_NE(id, identify(other, {}).id);
  other = report;
  other.trace.end = analysis::Timestamp{10};
  EXPECT_NE(id, identify(other, {}).id);
  EXPECT_NE(id, identify(report_of(2 * kSecond), {}).id);
}

TEST(FleetExport, LabelsAreNamesAndValues) {
  const auto label = label_of("note=a=b");
  EXPECT_EQ(label.name, "note");
  EXPECT_EQ(label.value, "a=b");
  EXPECT_EQ(label_of("note=").value, "");
  EXPECT_EQ(identify(report_of(0), {label_of("software=1.2")}).software, "1.2");
  for (const char* text : {"", "note", "=a", "day=yesterday", "day=2026-02-29", "day=2026-1-1",
                           "day=1969-12-31", "day=2150-01-01", "day=2026-11-20x", "day=-026-11-20"})
    EXPECT_THROW(label_of(text), std::invalid_argument) << text;
  EXPECT_EQ(label_of("day=2024-02-29").value, "2024-02-29");
}

TEST(FleetExport, NamesBecomePartsOfPathsThatCannotLeadElsewhere) {
  EXPECT_EQ(partition_value("car-1_a.b"), "car-1_a.b");
  EXPECT_EQ(partition_value("a/b=c d%\n"), "a%2Fb%3Dc%20d%25%0A");
  EXPECT_EQ(partition_value(std::string("\0\xff", 2)), "%00%FF");
  EXPECT_EQ(partition_value("."), "%2E");
  EXPECT_EQ(partition_value(".."), "%2E%2E");
  EXPECT_EQ(partition_value(""), "__HIVE_DEFAULT_PARTITION__");
}

TEST(FleetExport, LongNamesFitAFileSystemAndStayApart) {
  const auto a = partition_value(std::string(5000, 'x'));
  const auto b = partition_value(std::string(5001, 'x'));
  EXPECT_LE(std::string("process=").size() + a.size(), 255U);
  EXPECT_NE(a, b);
  // No escape is cut in half, wherever the cut falls.
  for (std::size_t plain = 0; plain < 3; ++plain) {
    const auto value = partition_value(std::string(plain, 'x') + std::string(300, ' '));
    const auto escapes = value.substr(plain, value.find('~') - plain);
    ASSERT_EQ(escapes.size() % 3, 0U);
    for (std::size_t i = 0; i < escapes.size(); i += 3)
      EXPECT_EQ(escapes.substr(i, 3), "%20");
  }
}

}  // namespace
}  // namespace cie::viewer_export
