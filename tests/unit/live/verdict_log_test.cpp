#include "verdict_log.hpp"

#include <cstdint>
#include <optional>
#include <string>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

using analysis::SubjectKind;
using analysis::Verdict;

analysis::VerdictReport violated(const std::string& subject, std::optional<std::uint32_t> index) {
  analysis::SubjectVerdict verdict{.about = {.kind = SubjectKind::callback, .index = index},
                                   .subject = subject,
                                   .verdict = Verdict::fail,
                                   .checked = 1,
                                   .evidence = {}};
  return {.rules = {{.id = "R2", .name = "no-missed-release", .subjects = {verdict}}}};
}

TEST(VerdictLog, KnowsASubjectWhoseNameChangesAsAnotherProcessAppears) {
  VerdictLog log;
  EXPECT_EQ(log.note(violated("callback plan", 3), {10}).changes.size(), 1U);
  const auto later = log.note(violated("callback plan (pid 7)", 3), {20});
  EXPECT_TRUE(later.changes.empty());
  EXPECT_EQ(later.current.at(0).since_ns, 10);
  EXPECT_EQ(later.current.at(0).subject, "callback plan (pid 7)");
}

TEST(VerdictLog, TellsSubjectsOfOneNameApart) {
  VerdictLog log;
  log.note(violated("callback plan", 3), {10});
  EXPECT_EQ(log.note(violated("callback plan", 4), {20}).changes.size(), 1U);
}

TEST(VerdictLog, KnowsASubjectWithoutARowByItsName) {
  VerdictLog log;
  log.note(violated("callback plan", {}), {10});
  EXPECT_TRUE(log.note(violated("callback plan", {}), {20}).changes.empty());
  EXPECT_EQ(log.note(violated("callback show", {}), {30}).changes.size(), 1U);
}

}  // namespace
}  // namespace cie::live
