// Sentences of what evidence shows.
#include "words/note_words.hpp"

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

using analysis::Duration;
using analysis::free_text;
using analysis::NamedCallback;
using analysis::Note;
using analysis::note;
using analysis::Timestamp;

const CallbackNames& names() {
  static const CallbackNames all({"/a/plan@Timer(20000000)"}, TextStyle{});
  return all;
}

TEST(Sentence, HasItsArguments) {
  EXPECT_EQ(sentence(note("numbers-jump",
                          {{"field", "seq"}, {"expected", 3}, {"seen", 5}, {"missing", 2}})),
            "seq jumps: 3 was next and 5 came; 2 missing in all");
}

TEST(Sentence, CountsInSingularAndInPlural) {
  const auto missing = [](std::uint64_t count) {
    return sentence(note("numbers-missing", {{"field", "seq"}, {"missing", count}}));
  };
  EXPECT_EQ(missing(1), "1 number of seq is missing");
  EXPECT_EQ(missing(2), "2 numbers of seq are missing");
}

TEST(Sentence, HasThatOfANoteInIt) {
  EXPECT_EQ(sentence(note("others-missing-too", {{"what", note("run-begin-unseen")}})),
            "no run_begin was seen: other announcements may be missing, too");
  EXPECT_EQ(sentence(note("others-missing-too", {{"what", Note{}}})),
            ": other announcements may be missing, too");
}

TEST(Sentence, OfNoNoteIsEmpty) {
  EXPECT_EQ(sentence(Note{}), "");
  EXPECT_EQ(sentence(note("no such code")), "");
}

TEST(Sentence, HasNanosecondsAndIdsInDocuments) {
  const auto total = note("callback-total", {{"callback", NamedCallback{"/a/plan@Timer(20000000)"}},
                                             {"total", "started"},
                                             {"counted", 3},
                                             {"seen", 2}});
  EXPECT_EQ(sentence(total), "/a/plan@Timer(20000000) started: 3 counted, 2 seen");
  EXPECT_EQ(sentence(total, names()), "plan timer 20 ms started: 3 counted, 2 seen");
}

// A text of a trace is no sentence of ours: what looks like an id or a place for an argument stays.
TEST(Sentence, LeavesTextsAsTheyAreAndEscapesThemForScreens) {
  const auto text = free_text("{text} /a/plan@Timer(20000000) 7 ns \x1b[31m");
  EXPECT_EQ(sentence(text), "{text} /a/plan@Timer(20000000) 7 ns \x1b[31m");
  EXPECT_EQ(sentence(text, names()), "{text} /a/plan@Timer(20000000) 7 ns \\x1b[31m");
}

TEST(Sentence, OnScreensHasUnitsThatFit) {
  const auto late =
      note("kernel-events-lost",
           {{"events", 3U}, {"when", note("lost-within", {{"span", Duration{16257687}}})}});
  EXPECT_EQ(sentence(late), "3 kernel events lost within 16257687 ns");
  EXPECT_EQ(sentence(late, names()), "3 kernel events lost within 16.26 ms");
  EXPECT_EQ(sentence_with_units(late), "3 kernel events lost within 16.26 ms");
}

// Else two that read the same would be taken for one.
TEST(Sentence, SaysByHowMuchTwoThatReadTheSameDiffer) {
  const auto lost = [](std::int64_t ns) {
    return note("kernel-events-lost",
                {{"events", 3U}, {"when", note("lost-within", {{"span", Duration{ns}}})}});
  };
  const auto one = lost(1'000'000);
  const auto other = lost(999'999);
  const std::vector<const Note*> both{&one, &one, &other};
  EXPECT_EQ(sentence(both, names()),
            "3 kernel events lost within 1.000 ms; 3 kernel events lost within 1.000 ms; "
            "3 kernel events lost within 1.000 ms (1 ns less)");
}

TEST(CodesOf, AreThoseOfTheNotesInIt) {
  EXPECT_EQ(codes_of(note("others-missing-too", {{"what", note("run-begin-unseen")}})),
            "others-missing-too run-begin-unseen");
}

TEST(IsWorded, WhereEachPlaceHasAnArgument) {
  EXPECT_TRUE(is_worded(note("others-missing-too", {{"what", note("run-begin-unseen")}})));
  EXPECT_TRUE(is_worded(Note{}));
  EXPECT_FALSE(is_worded(note("others-missing-too")));
  EXPECT_FALSE(is_worded(note("others-missing-too", {{"what", note("no such code")}})));
}

}  // namespace
}  // namespace cie::viewer_export
