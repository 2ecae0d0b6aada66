#include <cie/analysis/suppressions.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>

#include "support/verdicts.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr Date kToday{2026y / 6 / 15};

// "/lidar@a" and "/radar@b" skip periods (R2 fails); "/plan@c" does not.
constexpr const char* kSuppressed = R"(
  callback lidar timer period=10 id=/lidar@a
  callback radar timer period=10 id=/radar@b
  callback plan timer period=10 id=/plan@c
  11 start lidar release=10 missed=2
  12 end lidar
  13 start radar release=10 missed=1
  14 end radar
  15 start plan release=10
  16 end plan)";

std::string entry(const std::string& rule, const std::string& subject, const std::string& expires) {
  return "  - {rule: " + rule + ", subject: \"" + subject +
         "\", reason: known, expires: " + expires + "}\n";
}

VerdictReport suppressed(const std::string& entries, Date today = kToday) {
  auto verdicts = Verified(kSuppressed).result.verdicts;
  Suppressions::parse("suppressions:\n" + entries, "accepted.yaml").apply(verdicts, today);
  return verdicts;
}

const RuleVerdict& missed_releases(const VerdictReport& verdicts) {
  for (const auto& rule : verdicts.rules) {
    if (rule.id == "R2") return rule;
  }
  throw std::out_of_range("R2");
}

std::string error_of(const std::string& text) {
  try {
    Suppressions::parse(text, "accepted.yaml");
  } catch (const SpecError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Suppressions, DoNotNeedThePlaceAndTakeNoNameForOne) {
  const auto is_suppressed = [](const std::string& place) {
    VerdictReport verdicts{.rules = {{.id = "R2", .name = "no-missed-release", .subjects = {}}}};
    verdicts.rules[0].subjects = {{.subject = "callback a (pid 3)",
                                   .place = place,
                                   .verdict = Verdict::fail,
                                   .checked = 1,
                                   .evidence = {}}};
    Suppressions::parse("suppressions:\n" + entry("R2", "callback a", "never"), "accepted.yaml")
        .apply(verdicts, kToday);
    return verdicts.rules[0].subjects[0].is_suppressed();
  };
  EXPECT_TRUE(is_suppressed(" (pid 3)"));
  EXPECT_FALSE(is_suppressed("")) << "of a callback that is called so";
}

// Of a tid that was given anew.
TEST(Suppressions, NameAllLifetimesUnlessTheyNameOne) {
  const auto suppressed_by = [](const std::string& subject) {
    VerdictReport verdicts{
        .rules = {{.id = "M2", .name = "one-callback-per-thread", .subjects = {}}}};
    auto& subjects = verdicts.rules[0].subjects;
    subjects.resize(2, {.subject = "thread 101 (pid 3)",
                        .place = " (pid 3)",
                        .verdict = Verdict::fail,
                        .checked = 1,
                        .evidence = {}});
    subjects[1].ordinal = " (lifetime 2)";
    Suppressions::parse("suppressions:\n" + entry("M2", subject, "never"), "accepted.yaml")
        .apply(verdicts, kToday);
    return std::pair(subjects[0].is_suppressed(), subjects[1].is_suppressed());
  };
  const std::pair both(true, true);
  const std::pair second(false, true);
  EXPECT_EQ(suppressed_by("thread 101"), both);
  EXPECT_EQ(suppressed_by("thread 101 (pid 3)"), both);
  EXPECT_EQ(suppressed_by("thread 101 (lifetime 2)"), second);
  EXPECT_EQ(suppressed_by("thread 101 (lifetime 2) (pid 3)"), second);
  EXPECT_EQ(suppressed_by("thread 101 (lifetime 3)"), std::pair(false, false));
}

TEST(Suppressions, TakeAVerdictOutOfTheOverallOneAndLeaveItVisible) {
  const auto verdicts = suppressed(entry("R2", "callback /lidar@a", "never") +
                                   entry("R2", "callback /radar*", "2026-06-15"));
  EXPECT_EQ(verdicts.verdict, Verdict::pass);
  const auto& rule = missed_releases(verdicts);
  EXPECT_EQ(rule.verdict, Verdict::fail) << "the rule's own verdict is that of all its subjects";
  EXPECT_EQ(counted_verdict(rule), Verdict::pass);
  ASSERT_EQ(rule.subjects.size(), 3U);
  EXPECT_EQ(rule.subjects[0].subject, "callback /lidar@a");
  EXPECT_EQ(rule.subjects[0].verdict, Verdict::fail);
  EXPECT_TRUE(rule.subjects[0].is_suppressed());
  EXPECT_FALSE(rule.subjects[0].evidence.empty());
  EXPECT_FALSE(rule.subjects[1].suppression) << "the plan's verdict is a PASS";
  EXPECT_EQ(rule.subjects[2].suppression->place, "accepted.yaml:3");
}

TEST(Suppressions, LeaveTheRestToCount) {
  EXPECT_EQ(suppressed(entry("R2", "callback /lidar@a", "never")).verdict, Verdict::fail);
  EXPECT_EQ(suppressed(entry("R3", "*", "never")).verdict, Verdict::fail) << "another rule";
  EXPECT_EQ(suppressed(entry("R2", "*", "never")).verdict, Verdict::pass);
}

TEST(Suppressions, HoldThroughTheirLastDayAndCountAgainFromTheNext) {
  const auto entries = entry("R2", "*", "2026-06-15");
  EXPECT_EQ(suppressed(entries, 2026y / 6 / 15).verdict, Verdict::pass);
  const auto expired = suppressed(entries, 2026y / 6 / 16);
  EXPECT_EQ(expired.verdict, Verdict::fail);
  EXPECT_TRUE(missed_releases(expired).subjects[0].suppression->is_expired);
  ASSERT_TRUE(expired.suppressions);
  EXPECT_EQ(expired.suppressions->date, "2026-06-16");
  EXPECT_TRUE(expired.suppressions->uses[0].suppression.is_expired);
  EXPECT_EQ(expired.suppressions->uses[0].matched, 2U);
  EXPECT_EQ(expired.suppressions->uses[0].counting, 2U);
}

TEST(Suppressions, OfWhatAnotherEntryStillSuppressesNothingCountsAgain) {
  const auto counting = [](const std::string& entries) {
    return suppressed(entries).suppressions->uses[0].counting;
  };
  const auto expired = entry("R2", "*", "2026-06-14");
  EXPECT_EQ(counting(expired + entry("R2", "callback /lidar@a", "never")), 1U);
  EXPECT_EQ(counting(entry("R2", "/lidar@a", "2026-06-14") + entry("R2", "*", "never")), 0U);
  EXPECT_EQ(counting(expired + entry("R2", "*", "2026-06-13")), 2U) << "expired, too";
  EXPECT_EQ(counting(entry("R2", "*", "never") + expired), 0U);
}

TEST(Suppressions, OfSeveralTheFirstThatIsNotExpiredCounts) {
  const auto verdicts = suppressed(entry("R2", "*", "2020-01-01") + entry("R2", "*", "2026-12-31") +
                                   entry("R2", "*", "never"));
  EXPECT_EQ(missed_releases(verdicts).subjects[0].suppression->place, "accepted.yaml:3");
  EXPECT_EQ(verdicts.suppressions->uses[2].matched, 2U) << "it names them all the same";
}

TEST(Suppressions, ThatAreUnusedAreTold) {
  const auto uses = suppressed(entry("R2", "callback /plan@c", "never") + entry("M2", "*", "never"))
                        .suppressions->uses;
  EXPECT_EQ(uses.size(), 2U);
  EXPECT_EQ(uses[0].matched, 0U) << "it passes";
  EXPECT_EQ(uses[1].matched, 0U);
}

TEST(Suppressions, OfRulesThatAreNotJudgedAreNotUnused) {
  auto verdicts = Verified(kSuppressed).result.verdicts;
  std::erase_if(verdicts.rules, [](const RuleVerdict& rule) { return rule.id == "M2"; });
  Suppressions::parse("suppressions:\n" + entry("M2", "*", "never"), "a").apply(verdicts, kToday);
  EXPECT_TRUE(verdicts.suppressions->uses.empty());
}

TEST(Suppressions, CoverWhatIsUndecidedToo) {
  auto verdicts =
      Verified("process app crash\n callback plan\n 1 start plan\n 2 end plan").result.verdicts;
  EXPECT_EQ(verdicts.verdict, Verdict::inconclusive);
  std::string entries = "suppressions:\n";
  for (const auto& rule : verdicts.rules) {
    if (rule.verdict == Verdict::inconclusive) entries += entry(rule.id, "*", "never");
  }
  Suppressions::parse(entries, "a").apply(verdicts, kToday);
  EXPECT_EQ(verdicts.verdict, Verdict::pass);
}

TEST(Suppressions, NameASubjectOfAnyProcess) {
  auto verdicts = Verified(R"(
    process first pid=100
    callback a timer period=10
    process second pid=200
    callback b timer period=10
    11 start a release=10 missed=1
    12 end a
    13 start b release=10
    14 end b)")
                      .result.verdicts;
  Suppressions::parse("suppressions:\n" + entry("R2", "callback a", "never"), "a")
      .apply(verdicts, kToday);
  EXPECT_EQ(missed_releases(verdicts).subjects[0].subject, "callback a (pid 100)");
  EXPECT_EQ(verdicts.verdict, Verdict::pass);
}

TEST(Suppressions, AStarIsAnyTextAndNothingElseIsSpecial) {
  const auto counts = [](const std::string& pattern) {
    return suppressed(entry("R2", pattern, "never")).suppressions->uses[0].matched;
  };
  EXPECT_EQ(counts("callback /*ar@?"), 0U);
  EXPECT_EQ(counts("callback /*ar@*"), 2U);
  EXPECT_EQ(counts("*dar@a"), 1U);
  EXPECT_EQ(counts("*r*r*"), 1U) << "only radar has two";
  EXPECT_EQ(counts("callback /lidar@"), 0U) << "the whole subject is named, not a part";
  EXPECT_EQ(counts("callback /lidar@a*"), 1U) << "a star may stand for nothing";
}

TEST(Suppressions, AnEmptyFileSuppressesNothing) {
  EXPECT_EQ(suppressed("").verdict, Verdict::fail);
  auto verdicts = Verified(kSuppressed).result.verdicts;
  Suppressions::parse("suppressions: []", "a").apply(verdicts, kToday);
  EXPECT_TRUE(verdicts.suppressions->uses.empty());
}

TEST(Suppressions, AnErrorNamesFileLineEntryAndRemedy) {
  const auto broken = [](const std::string& fields) {
    return error_of("suppressions:\n  - {rule: R2, subject: a, reason: b, expires: never}\n  - " +
                    fields);
  };
  EXPECT_EQ(
      broken("{rule: R2, subject: \"*\", expires: never}"),
      "accepted.yaml:3: entry \"R2 *\": \"reason\" is missing; say why the verdict is accepted");
  EXPECT_EQ(
      broken("{rule: R2, subject: \"*\", reason: \" \", expires: never}"),
      "accepted.yaml:3: entry \"R2 *\": \"reason\" is empty; say why the verdict is accepted");
  EXPECT_EQ(broken("{rule: R2, subject: \"*\", reason: x}"),
            "accepted.yaml:3: entry \"R2 *\": \"expires\" is missing; write its last day as in "
            "2026-12-31, or never");
  for (const auto* date : {"2026-02-30", "2026-2-3", "31.12.2026", "2026-13-01", "soon", "20261231",
                           "2026-12-31T00:00:00Z", "-026-12-31"}) {
    EXPECT_THAT(
        broken("{rule: R2, subject: \"*\", reason: x, expires: " + std::string(date) + "}"),
        AllOf(HasSubstr("accepted.yaml:3: entry \"R2 *\": \"expires\" is \"" + std::string(date)),
              HasSubstr("or never")));
  }
  EXPECT_NO_THROW(Suppressions::parse(
      "suppressions:\n  - {rule: r2, subject: a, reason: x, expires: never}", "accepted.yaml"))
      << "as --only r2";
  EXPECT_EQ(
      broken("{rule: R9, subject: \"*\", reason: x, expires: never}"),
      "accepted.yaml:3: entry \"R9 *\": there is no rule \"R9\"; cie verify --list-rules names "
      "them all");
  EXPECT_THAT(broken("{rule: T1, subject: trace, reason: x, expires: never}"),
              HasSubstr("T1 cannot be suppressed"));
  EXPECT_THAT(broken("{rule: R2, subject: a, reason: x, expires: never, until: 1}"),
              HasSubstr("accepted.yaml:3: unknown key \"until\""));
  EXPECT_THAT(broken("{subject: a, reason: x, expires: never}"), HasSubstr("\"rule\" is missing"));
  EXPECT_THAT(error_of("suppresions: []"), HasSubstr("unknown key \"suppresions\""));
  EXPECT_THAT(error_of("suppressions: {a: b}"), HasSubstr("write a list"));
  EXPECT_THAT(error_of(""), HasSubstr("accepted.yaml:1: empty; write at least one section, as in "
                                      "suppressions: []"));
  EXPECT_EQ(error_of("suppressions: []"), "no error");
  EXPECT_THROW(Suppressions::load("/no/such/file.yaml"), SpecError);
}

}  // namespace
}  // namespace cie::test
