#include "knowledge/claims.hpp"

#include <cstdint>
#include <optional>
#include <string>

#include <gtest/gtest.h>

namespace cie::analysis {
namespace {

// What lies from 10 to 20 may be hidden.
class OfClaims : public testing::Test {
 protected:
  OfClaims() {
    Gap gap;
    gap.kinds = kRunKinds;
    gap.window = {Timestamp{10}, Timestamp{20}};
    gap.reason = {.cause = GapCause::loss, .at = Timestamp{10}, .about = 0};
    knowledge_.add(gap);
  }
  static Hidden start(std::int64_t at) {
    Hidden hidden;
    hidden.kinds = EventKind::run_start;
    hidden.window = {Timestamp{at}, Timestamp{at}};
    return hidden;
  }

  Hidden possible_ = start(15);
  Hidden impossible_ = start(25);
  Knowledge knowledge_;
  Claims<std::string> claims_{knowledge_};
};

TEST_F(OfClaims, NothingJudgedIsNotApplicable) {
  EXPECT_EQ(claims_.verdict(), Verdict::not_applicable);
}

TEST_F(OfClaims, PassesWhatWasJudged) {
  claims_.checked();
  claims_.needs({impossible_});
  claims_.needs({possible_, impossible_});
  EXPECT_EQ(claims_.verdict(), Verdict::pass);
}

TEST_F(OfClaims, FailsByAViolationOfWhichNoExcuseIsPossible) {
  claims_.violation("first", {{possible_}});
  claims_.violation("second", {{impossible_}, {possible_, impossible_}});
  claims_.needs({possible_});
  EXPECT_EQ(claims_.verdict(), Verdict::fail);
  EXPECT_EQ(claims_.witnesses(), std::vector<std::string>{"second"});
  EXPECT_TRUE(claims_.reasons().empty());
}

TEST_F(OfClaims, DecidesNothingByAViolationThatMayHaveAnExcuse) {
  claims_.checked();
  claims_.violation("moved", {{impossible_}, {possible_}});
  EXPECT_EQ(claims_.verdict(), Verdict::inconclusive);
  EXPECT_EQ(claims_.witnesses(), std::vector<std::string>{"moved"});
  EXPECT_EQ(claims_.reasons().at(0).cause, GapCause::loss);
}

TEST_F(OfClaims, DecidesNothingWhereWhatItNeedsMayBeHidden) {
  claims_.checked();
  claims_.needs({possible_});
  EXPECT_EQ(claims_.verdict(), Verdict::inconclusive);
  EXPECT_TRUE(claims_.witnesses().empty());
  EXPECT_EQ(claims_.reasons().at(0).at, Timestamp{10});
}

// The picture of viewer_export/docs/verdicts.md: between A, which ends at 20, and B, which starts at 40 on the
// same tid, there is a gap from 25 to 35.
class OfThePicture : public testing::Test {
 protected:
  static Hidden of_thread(EventKind kind, std::int64_t from, std::int64_t to) {
    return hidden(kind, {.thread = ThreadIndex{0}}, Timestamp{from}, Timestamp{to});
  }
  Verdict verdict(std::optional<std::uint64_t> lost, bool is_each_thread_counted) {
    Knowledge knowledge;
    knowledge.add({.scope = {},
                   .kinds = kStateKinds | kRunKinds,
                   .window = {Timestamp{25}, Timestamp{35}},
                   .at_most = lost});
    if (is_each_thread_counted) knowledge.discharge(EventKind::announcement, {}, {});
    Claims<std::string> claims{knowledge};
    claims.checked(2);
    claims.violation("A and B", {{of_thread(EventKind::thread_exit, 20, 40),
                                  of_thread(EventKind::announcement, 20, 40)}});
    return claims.verdict();
  }
};

TEST_F(OfThePicture, AnotherThreadMayHaveTheTid) {
  EXPECT_EQ(verdict({}, false), Verdict::inconclusive);
  EXPECT_EQ(verdict(2, false), Verdict::inconclusive);
}

TEST_F(OfThePicture, OneLostEventIsNoExitAndNoAnnouncementBoth) {
  EXPECT_EQ(verdict(1, false), Verdict::fail);
}

TEST_F(OfThePicture, NoThreadBeginsWhereAllAreCounted) {
  EXPECT_EQ(verdict({}, true), Verdict::fail);
}

TEST(OfBoth, TheSecondKindOfEvidenceTakesNothingFromTheFirst) {
  EXPECT_EQ(of_both(Verdict::pass, Verdict::inconclusive), Verdict::pass);
  EXPECT_EQ(of_both(Verdict::pass, Verdict::fail), Verdict::fail);
  EXPECT_EQ(of_both(Verdict::inconclusive, Verdict::pass), Verdict::inconclusive);
  EXPECT_EQ(of_both(Verdict::not_applicable, Verdict::pass), Verdict::pass);
  EXPECT_EQ(of_both(Verdict::fail, Verdict::pass), Verdict::fail);
}

}  // namespace
}  // namespace cie::analysis
