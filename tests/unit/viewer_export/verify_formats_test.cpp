// Verdicts for other programs: JUnit, TAP, SARIF. That independent readers accept them is tested in
// tests/golden/formats.
#include <cie/viewer_export/verify_writers.hpp>

#include "sample_report.hpp"
#include "xml.hpp"

#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::viewer_export {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using Write = void (&)(std::ostream&, const analysis::VerdictReport&, const analysis::Report&);

std::string written(Write write,
                    const analysis::VerdictReport& verdicts = test::sample_verdicts()) {
  std::ostringstream out;
  write(out, verdicts, test::sample_report());
  return out.str();
}

analysis::VerdictReport with_subject(const std::string& subject) {
  auto verdicts = test::sample_verdicts();
  verdicts.rules[0].subjects[0].subject = subject;
  return verdicts;
}

TEST(Xml, EscapesMarkupAndKeepsLines) {
  EXPECT_EQ(xml_escaped("a<b>&\"c\"\n\t\r"), "a&lt;b&gt;&amp;&quot;c&quot;&#10;&#9;&#13;");
}

TEST(Xml, ReplacesWhatItCannotHold) {
  EXPECT_EQ(xml_escaped("\x1b[31m\xFF\xEF\xBF\xBE\xC3\xA9"),
            "\xEF\xBF\xBD[31m\xEF\xBF\xBD\xEF\xBF\xBD\xC3\xA9");
}

TEST(VerifyJunit, CountsFailuresErrorsAndWhatIsNotApplicable) {
  const auto text = written(write_verify_junit);
  EXPECT_THAT(text, HasSubstr("<testsuites name=\"cie verify\" tests=\"5\" failures=\"1\" "
                              "errors=\"1\" skipped=\"1\">"));
  EXPECT_THAT(text, HasSubstr("<testsuite name=\"M2 one-callback-per-thread\" tests=\"2\" "
                              "failures=\"1\" errors=\"0\" skipped=\"0\">"));
}

TEST(VerifyJunit, InconclusiveIsAnErrorAndNeverSkipped) {
  EXPECT_THAT(written(write_verify_junit),
              HasSubstr("<testcase classname=\"cie.verify.T4\" name=\"process 4001\">\n"
                        "      <error type=\"INCONCLUSIVE\" message=\"no run_end: the process was "
                        "interrupted\">"));
}

TEST(VerifyJunit, SurvivesHostileNames) {
  EXPECT_THAT(written(write_verify_junit, with_subject("\"><x>\x1b")),
              HasSubstr("name=\"&quot;&gt;&lt;x&gt;\xEF\xBF\xBD\""));
}

TEST(VerifyTap, HasOneTestPerSubject) {
  const auto text = written(write_verify_tap);
  EXPECT_THAT(text, HasSubstr("TAP version 13\n1..5\nok 1 - T1 trace-readable: trace\n"
                              "not ok 2 - T4 run-complete: process 4001\n"
                              "  ---\n"
                              "  message: \"no run_end: the process was interrupted\"\n"
                              "  severity: inconclusive\n"));
  EXPECT_THAT(text, HasSubstr("ok 5 - M5 mapping-survives-restart # SKIP not applicable\n"));
}

TEST(VerifyTap, ANameIsNoDirective) {
  const auto text = written(write_verify_tap, with_subject("callback # TODO \\ later\nok 9"));
  EXPECT_THAT(text, HasSubstr("ok 1 - T1 trace-readable: callback \\# TODO \\\\ later"));
  EXPECT_THAT(text, Not(HasSubstr("\nok 9")));
}

TEST(VerifySarif, HasOneResultPerSubjectWithItsKind) {
  const auto run = nlohmann::json::parse(written(write_verify_sarif)).at("runs").at(0);
  std::string kinds;
  for (const auto& result : run.at("results")) {
    kinds += result.at("ruleId").get<std::string>() + ' ' + result.at("kind").get<std::string>() +
             ' ' + result.at("level").get<std::string>() + '\n';
    EXPECT_EQ(run.at("tool")
                  .at("driver")
                  .at("rules")
                  .at(result.at("ruleIndex").get<std::size_t>())
                  .at("id"),
              result.at("ruleId"));
  }
  EXPECT_EQ(kinds,
            "T1 pass none\nT4 open none\nM2 pass none\nM2 fail error\n"
            "M5 notApplicable none\n");
}

TEST(VerifySarif, LeadsToTheTraceAndToTheEvidence) {
  const auto result =
      nlohmann::json::parse(written(write_verify_sarif)).at("runs").at(0).at("results").at(3);
  EXPECT_EQ(result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"],
            "recordings/run%201");
  EXPECT_EQ(result["relatedLocations"].size(), 2U);
  EXPECT_THAT(result["relatedLocations"][0]["message"]["text"].get<std::string>(),
              HasSubstr("started /a/plan@Timer(20000000), instance 0"));
}

}  // namespace
}  // namespace cie::viewer_export
