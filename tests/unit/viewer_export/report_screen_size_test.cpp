// How many lines and columns the first screen takes.
#include <cie/viewer_export/report_writers.hpp>

#include "report_screens.hpp"
#include "sample_report.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

TEST(ReportScreen, FillsTheLinesThatThereAre) {
  auto report = shared_report();
  for (std::uint32_t i = 0; i < 40; ++i) {
    report.callbacks.push_back(report.callbacks[0]);
    report.callbacks.back().index = analysis::CallbackIndex{100 + i};
    report.callbacks.back().logical_id = fmt::format("/n{}@Timer(20000000)", i);
  }
  for (const std::size_t lines : {23U, 21U}) {
    const auto text = screen_of(report, test::sample_verdicts(), {.columns = 80, .lines = lines},
                                usual_context());
    EXPECT_EQ(std::ranges::count(text, '\n'), lines) << text;
  }
}

TEST(ReportScreen, NeverTakesMoreThan24LinesNorMoreColumnsThanThereAre) {
  auto report = shared_report();
  report.recordings.emplace_back().problems = {"LTTng did not end the session"};
  for (int i = 0; i < 500; ++i) {
    auto callback = report.callbacks[static_cast<std::size_t>(i) % 3];
    callback.index = analysis::CallbackIndex{static_cast<std::uint32_t>(report.callbacks.size())};
    callback.logical_id = "/" + std::string(static_cast<std::size_t>(i % 200), 'n') + "@Timer(" +
                          std::to_string(i) + ")";
    callback.missed_releases = 7;
    report.callbacks.push_back(callback);
    report.chains.push_back(report.chains[0]);
    report.chains.back().name += std::string(static_cast<std::size_t>(i % 100), 'c');
    report.defects.push_back({.kind = analysis::DefectKind::seq_gaps,
                              .severity = analysis::Severity::loss,
                              .count = 7,
                              .advice = std::string(300, 'a')});
    report.trace.hosts.push_back(std::string(60, 'h'));
  }
  auto long_arguments = usual_context();
  for (const auto& arguments :
       {std::string("run"), std::string(35, 'x') + " --spec " + std::string(30, 'y')}) {
    long_arguments.verify.verify_arguments = arguments;
    long_arguments.verify.view_arguments = arguments;
    for (const std::size_t columns : {60U, 80U, 120U, 200U}) {
      std::istringstream text(screen_of(report, test::sample_verdicts(),
                                        {.columns = columns, .unicode = true}, long_arguments));
      std::size_t lines = 0;
      for (std::string line; std::getline(text, line); ++lines)
        EXPECT_LE(display_width(line), columns) << line;
      EXPECT_LE(lines, 24U) << columns << " columns";
    }
  }
}

}  // namespace
}  // namespace cie::viewer_export
