#include <cie/viewer_export/fleet_export.hpp>

#include "support/temporary_directory.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
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

std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  EXPECT_TRUE(in.is_open()) << file;
  return {std::istreambuf_iterator<char>(in), {}};
}

// One callback that ran once, on a host and in a process with names that need care.
class FleetFiles : public testing::Test {
 protected:
  FleetFiles() {
    result_.report = report_of(kSecond);
    result_.report.trace.hosts = {"a/b"};
    auto& process = result_.report.processes.front();
    process.host = "a/b";
    process.name = "\xff";
    analysis::CallbackReport callback;
    callback.logical_id = "cb";
    callback.duration = analysis::Summary{.count = 1, .min = 5, .max = 5, .sum = 5, .mean = 5};
    callback.duration->buckets = {{.value = 5, .count = 1}};
    result_.report.callbacks.push_back(callback);
    analysis::Instance instance;
    instance.logical_id = "cb";
    instance.pid = 7;
    instance.tid = 8;
    instance.seq = 3;
    instance.start = analysis::Timestamp{1};
    instance.end = analysis::Timestamp{6};
    instances_.on_instance(instance);
  }

  void write(
      const std::string& software = "2",
      const OpenFile& open = [](const std::filesystem::path& file) { return OutputFile(file); }) {
    write_partitions(directory_.path(),
                     identify(result_.report, {label_of("software=" + software)}), result_,
                     instances_, open);
  }

  std::map<std::string, std::string> contents() const {
    std::map<std::string, std::string> contents;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(directory_.path())) {
      if (entry.is_regular_file()) contents[entry.path()] = content_of(entry.path());
    }
    return contents;
  }

  std::string id() const { return identify(result_.report, {}).id; }

  test::TemporaryDirectory directory_;
  analysis::AnalysisResult result_;
  InstanceWriter instances_{{}, 10, InstanceOrder::by_process};
};

TEST_F(FleetFiles, PartitionsAreFilesOfTheirOwn) {
  write();
  const auto& root = directory_.path();
  const auto place = std::filesystem::path("day=1970-01-01") / "host=a%2Fb" / "process=%FF";
  for (const char* table : {"instances", "histograms", "summaries", "callbacks", "processes"}) {
    const auto bytes = content_of(root / table / place / (id() + "-7.parquet"));
    EXPECT_TRUE(bytes.starts_with("PAR1") && bytes.ends_with("PAR1")) << table;
  }
  const auto none = std::filesystem::path("process=__HIVE_DEFAULT_PARTITION__");
  EXPECT_TRUE(std::filesystem::exists(root / "recordings/day=1970-01-01/host=a%2Fb" / none /
                                      (id() + ".parquet")));
  // A table without rows has its columns all the same.
  EXPECT_TRUE(std::filesystem::exists(
      root / "losses/day=1970-01-01/host=__HIVE_DEFAULT_PARTITION__" / none / (id() + ".parquet")));
}

// The disk is full when the last of them is written.
TEST_F(FleetFiles, PartitionsAppearAllOrNoneOfThem) {
  const auto open = [](const std::filesystem::path& file) {
    if (file.filename() == "views.sql") throw WriteError("cannot write: No space left on device");
    return OutputFile(file);
  };
  EXPECT_THROW(write("3", open), WriteError);
  EXPECT_TRUE(contents().empty());
  write();
  const auto before = contents();
  EXPECT_GT(before.size(), 8U) << "of as many tables, and the views";
  EXPECT_THROW(write("3", open), WriteError);
  EXPECT_EQ(contents(), before);
}

}  // namespace
}  // namespace cie::viewer_export
