#include <cie/viewer_export/html_report.hpp>

#include "sample_report.hpp"

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::viewer_export {
namespace {

using analysis::Verdict;
using Json = nlohmann::ordered_json;

// What the page draws.
Json document_of(const analysis::AnalysisResult& result) {
  std::ostringstream out;
  HtmlReport().write(out, result, nullptr);
  const auto html = out.str();
  const auto begin = html.find('>', html.find("id=\"document\"")) + 1;
  return Json::parse(html.substr(begin, html.find("</script>", begin) - begin));
}

// The first callback takes up to 289.4 us, the second one 2.5 ms and more.
TEST(HtmlReport, HasTheCallbackFirstThatTheTextHas) {
  analysis::AnalysisResult result{.report = test::sample_report(), .verdicts = {}};
  EXPECT_EQ(document_of(result)["head"]["worst"], 1);
  auto& slowest = result.report.callbacks[1];
  slowest.kind = CallbackKind::service;
  slowest.source = "/container/_container/load_node";
  EXPECT_EQ(document_of(result)["head"]["worst"], 0) << "it is done when the application runs";
  for (auto& callback : result.report.callbacks) {
    callback.response_time.reset();
    callback.response_time_lower.reset();
  }
  EXPECT_TRUE(document_of(result)["head"]["worst"].is_null());
}

TEST(HtmlReport, IsCalledAfterTheRecording) {
  const auto titled = [](std::vector<std::string> paths) {
    analysis::AnalysisResult result{.report = test::sample_report(), .verdicts = {}};
    result.report.trace.paths = std::move(paths);
    std::ostringstream out;
    HtmlReport().write(out, result, nullptr);
    const auto html = out.str();
    const auto begin = html.find("<title>");
    return html.substr(begin, html.find("<style>") - begin);
  };
  EXPECT_EQ(titled({"recordings/run 1/"}), "<title>run 1: cie report</title>\n");
  EXPECT_EQ(titled({"a", "b", "c"}), "<title>a and 2 more: cie report</title>\n");
  EXPECT_EQ(titled({"</title><script>"}), "<title>title&gt;&lt;script&gt;: cie report</title>\n");
  EXPECT_EQ(titled({}), "<title>cie report</title>\n");
}

TEST(HtmlReport, TellsWhatIsWorstOfARuleFirstAndWhatToDo) {
  const auto failed = [](std::uint32_t index) {
    return analysis::SubjectVerdict{
        .about = {.kind = analysis::SubjectKind::callback, .index = index},
        .subject = "callback " + std::to_string(index),
        .verdict = Verdict::fail,
        .checked = 7,
        .evidence = {{.event = "callback_start",
                      .time = analysis::Timestamp{1},
                      .cpu = {},
                      .pid = {},
                      .tid = {},
                      .note = analysis::note("window-ends-later",
                                             {{"later", analysis::Duration{1}},
                                              {"deadline", analysis::Duration{20000000}}})}}};
  };
  analysis::AnalysisResult result{.report = test::sample_report(),
                                  .verdicts = {.verdict = Verdict::fail,
                                               .rules = {{.id = "R2",
                                                          .name = "missed-release",
                                                          .verdict = Verdict::fail,
                                                          .subjects = {failed(0), failed(1)}}}}};
  result.report.callbacks[0].missed_releases = 3;
  result.report.callbacks[1].missed_releases = 24;
  const auto document = document_of(result);
  EXPECT_EQ(document["names"]["order"]["R2"], Json::array({1, 0}));
  EXPECT_EQ(
      document["names"]["words"]["end of the window, 1 ns later; the deadline is 20000000 ns"],
      "end of the window, 1 ns later; the deadline is 20.00 ms");
  EXPECT_TRUE(document["head"]["remedies"].contains("R2"));
}

}  // namespace
}  // namespace cie::viewer_export
