// Verdicts for other programs: JUnit, TAP, SARIF. That independent readers accept them is tested in
// tests/golden/formats.
#include <cie/viewer_export/verify_writers.hpp>

#include "sample_report.hpp"
#include "text/xml.hpp"
#include "words/verify_words.hpp"

#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::viewer_export {
namespace {

using ::testing::AllOf;
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

TEST(Xml, ShowsWhatItCannotHoldAndWhatNobodyCanSee) {
  EXPECT_EQ(xml_escaped("\x1b[31m\xFF\xEF\xBF\xBE\xC3\xA9"),
            "\\x1b[31m\xEF\xBF\xBD\\u{fffe}\xC3\xA9");
  EXPECT_EQ(xml_escaped("a\xC2\x9B\x7F\xE2\x80\xAE"), "a\\x9b\\x7f\\u{202e}");
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
              HasSubstr("name=\"&quot;&gt;&lt;x&gt;\\x1b\""));
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

TEST(VerifyJunit, ASuppressedVerdictIsSkippedWithItsReasonAndKeepsItsEvidence) {
  const auto text = written(write_verify_junit, test::suppressed_verdicts(false));
  EXPECT_THAT(text, HasSubstr("tests=\"5\" failures=\"0\" errors=\"1\" skipped=\"2\">"));
  EXPECT_THAT(text,
              HasSubstr("<skipped message=\"FAIL suppressed until 2026-12-31 (ok.yaml:2): known "
                        "&lt;since&gt; May\"/>\n      <system-out>at 983005016596 ns"));
  const auto expired = written(write_verify_junit, test::suppressed_verdicts(true));
  EXPECT_THAT(expired, HasSubstr("tests=\"5\" failures=\"1\" errors=\"1\" skipped=\"1\">"));
  EXPECT_THAT(expired, HasSubstr("suppression expired after 2026-12-31"));
}

TEST(VerifyTap, ASuppressedVerdictIsATodo) {
  EXPECT_THAT(
      written(write_verify_tap, test::suppressed_verdicts(false)),
      HasSubstr("not ok 4 - M2 one-callback-per-thread: thread 4008 # TODO suppressed until "
                "2026-12-31 (ok.yaml:2): known <since> May\n  ---\n"));
  const auto expired = written(write_verify_tap, test::suppressed_verdicts(true));
  EXPECT_THAT(expired, HasSubstr("not ok 4 - M2 one-callback-per-thread: thread 4008\n"));
  EXPECT_THAT(expired, HasSubstr("  suppression: \"suppression expired after 2026-12-31"));
}

TEST(VerifySarif, OnceAResultHasSuppressionsEveryResultHas) {
  const auto results_of = [](bool is_expired) {
    return nlohmann::json::parse(written(write_verify_sarif, test::suppressed_verdicts(is_expired)))
        .at("runs")
        .at(0)
        .at("results");
  };
  const auto results = results_of(false);
  ASSERT_EQ(results.size(), 5U);
  for (const auto& result : results)
    EXPECT_EQ(result.at("suppressions").size(), result.at("kind") == "fail" ? 1U : 0U);
  const auto suppression = results[3]["suppressions"][0];
  EXPECT_EQ(suppression["kind"], "external");
  EXPECT_EQ(suppression["status"], "accepted");
  EXPECT_EQ(suppression["justification"], "known <since> May");
  EXPECT_EQ(suppression["location"]["physicalLocation"]["artifactLocation"]["uri"], "ok.yaml");
  EXPECT_EQ(suppression["location"]["physicalLocation"]["region"]["startLine"], 2);
  EXPECT_EQ(results_of(true)[3]["suppressions"][0]["status"], "rejected");
  EXPECT_THAT(written(write_verify_sarif), Not(HasSubstr("suppressions")));
}

// A tool that keys test cases by their names has one for each subject.
TEST(VerifyFormats, TellSubjectsOfOneNameApart) {
  auto verdicts = test::sample_verdicts();
  auto& subjects = verdicts.rules[2].subjects;  // of M2
  subjects[1].subject = subjects[0].subject;
  subjects[1].ordinal = " (lifetime 2)";
  EXPECT_THAT(
      written(write_verify_junit, verdicts),
      AllOf(HasSubstr("name=\"thread 4005\""), HasSubstr("name=\"thread 4005 (lifetime 2)\"")));
  EXPECT_THAT(written(write_verify_tap, verdicts), HasSubstr("thread 4005 (lifetime 2)"));
  EXPECT_THAT(written(write_verify_sarif, verdicts),
              AllOf(HasSubstr("\"M2 thread 4005\""), HasSubstr("\"M2 thread 4005 (lifetime 2)\"")));
}

// The only line that servers show: what is violated, not its first event, which alone is no violation.
TEST(VerifyFormats, SayWhatIsViolatedAndByWhat) {
  auto verdicts = test::sample_verdicts();
  const std::string several =
      "ran several callbacks: started /a/plan@Timer(20000000), instance 0; started /b@Timer(1), "
      "instance 0";
  EXPECT_THAT(written(write_verify_junit), HasSubstr("message=\"" + several + "\""));
  EXPECT_THAT(written(write_verify_tap), HasSubstr("message: \"" + several + "\""));
  EXPECT_THAT(written(write_verify_sarif), HasSubstr("\"thread 4008: " + several + "\""));
  auto& rule = verdicts.rules[2];
  rule.id = "R3";  // of an instance's two events the end has all
  EXPECT_EQ(message_of(rule, rule.subjects[1]),
            "missed deadlines: started /b@Timer(1), instance 0");
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
