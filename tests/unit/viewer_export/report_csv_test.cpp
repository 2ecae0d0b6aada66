#include <cie/viewer_export/report_writers.hpp>

#include "sample_report.hpp"

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

std::vector<std::vector<std::string>> rows_of(const analysis::Report& report) {
  std::ostringstream out;
  write_report_csv(out, report);
  std::istringstream lines(out.str());
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(lines, line);) {
    auto& row = rows.emplace_back();
    std::istringstream fields(line + ",");
    for (std::string field; std::getline(fields, field, ',');) {
      row.push_back(field);
    }
  }
  return rows;
}

std::string cell(const std::vector<std::vector<std::string>>& rows, std::size_t row,
                 const std::string& column) {
  const auto at = std::find(rows[0].begin(), rows[0].end(), column);
  return at == rows[0].end() ? "no such column"
                             : rows[row].at(static_cast<std::size_t>(at - rows[0].begin()));
}

TEST(ReportCsv, HasOneRowPerCallbackAsWideAsTheHeader) {
  const auto rows = rows_of(test::sample_report());
  ASSERT_EQ(rows.size(), 4U);
  constexpr std::size_t kColumns = 14 + 11 * 9 + 9;
  for (const auto& row : rows) {
    EXPECT_EQ(row.size(), kColumns);
  }
  EXPECT_EQ(cell(rows, 1, "logical_id"), "/a/plan@Timer(20000000)");
  EXPECT_EQ(cell(rows, 1, "response_time_ns_max"), "289415");
  EXPECT_EQ(cell(rows, 1, "isolated"), "true");
  EXPECT_EQ(cell(rows, 1, "release_source"), "exact");
  EXPECT_EQ(cell(rows, 1, "wakeup_latency_ns_p99_9"), "8108");
  EXPECT_EQ(cell(rows, 2, "tids"), "4008 4009");
  EXPECT_EQ(cell(rows, 2, "response_time_ns_max"), "");
  EXPECT_EQ(cell(rows, 2, "response_time_lower_ns_max"), "2500000");
  EXPECT_EQ(cell(rows, 3, "missed_releases"), "");
}

TEST(ReportCsv, TellsEmptyTextFromUnknown) {
  auto report = test::sample_report();
  report.callbacks.resize(1);
  report.callbacks[0].source = "";
  report.callbacks[0].release_source.reset();
  const auto rows = rows_of(report);
  EXPECT_EQ(cell(rows, 1, "source"), "\"\"");
  EXPECT_EQ(cell(rows, 1, "release_source"), "");
}

TEST(ReportCsv, EndsWithWhatWasAddedLater) {
  auto report = test::sample_report();
  report.callbacks[0].deadline_ns = 5'000'000;
  report.callbacks[0].exceptions = 2;
  report.callbacks[1].longest_queue = 12;
  const auto rows = rows_of(report);
  EXPECT_EQ(rows[0].back(), "process_index");
  EXPECT_EQ(cell(rows, 1, "deadline_ns"), "5000000");
  EXPECT_EQ(cell(rows, 2, "deadline_ns"), "");
  EXPECT_EQ(cell(rows, 1, "exceptions"), "2");
  EXPECT_EQ(cell(rows, 2, "longest_queue"), "12");
}

}  // namespace
}  // namespace cie::viewer_export
