#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/viewer_export/html_report.hpp>

#include "sample_report.hpp"

#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

// What the page is told of its callbacks, beside the report.
std::string facts_of(const analysis::AnalysisResult& result, const SchedulingSpec* spec) {
  HtmlReport page;
  std::ostringstream out;
  page.write(out, result, spec);
  const std::string text = out.str();
  const auto begin = text.find("id=\"facts\"");
  return text.substr(begin, text.find("</script>", begin) - begin);
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(HtmlReport, MarksTheDeadlineOfTheSpecElseTheDeclaredOne) {
  analysis::AnalysisResult result{.report = test::sample_report(), .verdicts = {}};
  EXPECT_FALSE(has(facts_of(result, nullptr), "\"deadline_ns\":5"));
  result.report.callbacks[0].deadline_ns = 5'000'000;
  EXPECT_TRUE(has(facts_of(result, nullptr), "\"deadline_ns\":5000000"));
  const auto spec =
      SchedulingSpec::parse("callback_groups:\n  - id: \"" + result.report.callbacks[0].logical_id +
                                "\"\n    response_deadline: 7000000\n",
                            "spec");
  const auto facts = facts_of(result, &spec);
  EXPECT_TRUE(has(facts, "\"deadline_ns\":7000000"));
  EXPECT_FALSE(has(facts, "\"deadline_ns\":5000000"));
}

}  // namespace
}  // namespace cie::viewer_export
