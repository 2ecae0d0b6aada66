#include <cie/viewer_export/verify_writers.hpp>

#include "sample_report.hpp"

#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace cie::viewer_export {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const analysis::VerdictReport& verdicts) {
  std::ostringstream out;
  write_verify_json(out, verdicts);
  return Json::parse(out.str());
}

TEST(VerifyJson, IsTheContractsObject) {
  const auto expected = Json::parse(R"({
    "schema": "cie.verify/2", "verdict": "FAIL",
    "rules": [
      {"id": "T1", "name": "trace-readable", "verdict": "PASS", "subjects": [
        {"subject": "trace", "verdict": "PASS", "checked": 980, "evidence": [],
         "kind": "trace", "index": null, "process": null}]},
      {"id": "T4", "name": "run-complete", "verdict": "INCONCLUSIVE", "subjects": [
        {"subject": "process 4001", "verdict": "INCONCLUSIVE", "checked": 0, "evidence": [
          {"event": "missing", "time_ns": 983130000000, "cpu": null, "pid": null, "tid": null,
           "note": "no run_end: the process was interrupted", "code": "text",
           "arguments": {"text": "no run_end: the process was interrupted"}, "stream": null, "packet": null}],
         "kind": "process", "index": 0, "process": 0}]},
      {"id": "M2", "name": "one-callback-per-thread", "verdict": "FAIL", "subjects": [
        {"subject": "thread 4005", "verdict": "PASS", "checked": 7, "evidence": [],
         "kind": "thread", "index": 0, "process": 0},
        {"subject": "thread 4008", "verdict": "FAIL", "checked": 9, "evidence": [
          {"event": "callback_start", "time_ns": 983005016596, "cpu": 0, "pid": 4001, "tid": 4008,
           "note": "started /a/plan@Timer(20000000), instance 0", "code": "text",
           "arguments": {"text": "started /a/plan@Timer(20000000), instance 0"},
           "stream": "ust/channel0_1", "packet": 2},
          {"event": "callback_start", "time_ns": 983005187272, "cpu": null, "pid": 4001,
           "tid": 4008, "note": "started /b@Timer(1), instance 0", "code": "text",
           "arguments": {"text": "started /b@Timer(1), instance 0"}, "stream": null, "packet": null}],
         "kind": "thread", "index": 1, "process": 0}]},
      {"id": "M5", "name": "mapping-survives-restart", "verdict": "NOT_APPLICABLE",
       "subjects": []}]})");
  // Compared as text, so that the order of keys counts.
  EXPECT_EQ(json_of(test::sample_verdicts()).dump(1), expected.dump(1));
}

TEST(VerifyJson, NamesSuppressionsOfASubjectAndOfTheFile) {
  const auto json = json_of(test::suppressed_verdicts(false));
  EXPECT_EQ(json["verdict"], "INCONCLUSIVE");
  EXPECT_EQ(json["rules"][2]["verdict"], "FAIL");
  const auto subject = json["rules"][2]["subjects"][1];
  EXPECT_EQ(subject["verdict"], "FAIL");
  EXPECT_EQ(
      subject["suppression"].dump(),
      R"({"state":"active","reason":"known <since> May","expires":"2026-12-31","place":"ok.yaml:2"})");
  EXPECT_FALSE(json["rules"][2]["subjects"][0].contains("suppression"));
  EXPECT_EQ(json["suppressions"]["date"], "2026-12-31");
  EXPECT_EQ(json["suppressions"]["entries"][1].dump(),
            R"({"rule":"M5","subject":"thread *","reason":"known <since> May","expires":"never",)"
            R"("place":"ok.yaml:6","state":"active","matched":0})");
  EXPECT_EQ(
      json_of(test::suppressed_verdicts(true))["rules"][2]["subjects"][1]["suppression"]["state"],
      "expired");
}

// The contract has "thread TID"; what tells two of them apart is beside it.
TEST(VerifyJson, TellsSubjectsOfOneNameApart) {
  auto verdicts = test::sample_verdicts();
  auto& second = verdicts.rules[2].subjects[1];
  second.subject = "thread 4005 (pid 7)";
  second.place = " (pid 7)";
  second.ordinal = " (lifetime 2)";
  const auto subjects = json_of(verdicts)["rules"][2]["subjects"];
  EXPECT_EQ(subjects[1]["subject"], "thread 4005 (pid 7)");
  EXPECT_EQ(subjects[1]["name"], "thread 4005 (lifetime 2) (pid 7)");
  EXPECT_FALSE(subjects[0].contains("name"));
}

TEST(VerifyJson, ATimeThatIsNotKnownIsNull) {
  auto verdicts = test::sample_verdicts();
  verdicts.rules[2].subjects[1].evidence[0].time.reset();
  const auto evidence = json_of(verdicts)["rules"][2]["subjects"][1]["evidence"];
  EXPECT_TRUE(evidence[0]["time_ns"].is_null());
  EXPECT_EQ(evidence[1]["time_ns"], 983'005'187'272);
}

TEST(VerifyJson, AnOverallVerdictIsNeverNotApplicable) {
  EXPECT_EQ(json_of(analysis::VerdictReport{}).at("verdict"), "PASS");
}

TEST(VerifyJson, SurvivesHostileNames) {
  auto verdicts = test::sample_verdicts();
  verdicts.rules[0].subjects[0].subject = "callback \"\x1b[31m\n\xFF";
  EXPECT_EQ(json_of(verdicts)["rules"][0]["subjects"][0]["subject"],
            "callback \"\x1b[31m\n\xEF\xBF\xBD");
}

}  // namespace
}  // namespace cie::viewer_export
