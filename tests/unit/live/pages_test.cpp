#include "pages.hpp"

#include "batch_text.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace cie::live {
namespace {

CallbackView callback(std::uint32_t index, const std::string& id, std::int64_t p99) {
  CallbackView view;
  view.index = index;
  view.logical_id = id;
  view.pid = 100 + index;
  view.instances = 5;
  view.deadline_ns = 10;
  view.late = view.total_late = 0;
  view.total_missed = 0;
  view.response = analysis::Summary{.count = 5, .max = p99, .p50 = p99, .p99 = p99};
  RecentInstance instance;
  instance.seq = 77 + index;
  instance.response_ns = 2000;
  view.recent = {instance};
  return view;
}

Snapshot first_snapshot() {
  Snapshot s;
  s.sequence = 1;
  s.state = SourceState::streaming;
  s.source = "net://x/host/y/z";
  s.watched = "cie run app.yaml";
  s.verdict = analysis::Verdict::fail;
  s.window_ns = 5'000'000'000;
  s.callbacks = {callback(0, "/slow@Timer(1)", 9'000'000), callback(1, "/fast@Timer(1)", 1'000'000),
                 callback(2, "/bad\x1b]0;owned\x07\x1b[2J\n@Timer(1)", 500)};
  ThreadView thread;
  thread.name = "\x1b[31mred";
  thread.callbacks = {"/a"};
  thread.cpu_percent = 3;
  s.threads = {thread};
  s.violations = {{.rule = "M2", .name = "one-callback-per-thread", .subjects = 1}};
  s.verdicts = {{.rule = "M2",
                 .name = "one-callback-per-thread",
                 .subject = "thread 5",
                 .verdict = analysis::Verdict::fail,
                 .note = "a long story \x1b[2J of evidence"}};
  s.changes = {{.rule = "M2",
                .name = "one-callback-per-thread",
                .subject = "thread \x1b[5m",
                .to = analysis::Verdict::fail,
                .note = {}}};
  return s;
}

class PagesTest : public testing::Test {
 protected:
  PagesTest() { history_.add(first_snapshot()); }
  std::string draw(Size size = {}) {
    std::string text;
    for (const auto& line : pages_.draw(size)) {
      for (const auto& span : line.spans)
        text += span.text;
      text += '\n';
    }
    return text;
  }
  bool type(std::string_view letters) {
    bool goes_on = true;
    for (const char letter : letters)
      goes_on = pages_.press(Key::character, letter);
    return goes_on;
  }
  // Places of the texts, which must be there.
  std::size_t place(const std::string& text) {
    const auto found = draw().find(text);
    EXPECT_NE(found, std::string::npos) << text << draw();
    return found;
  }
  History history_;
  Pages pages_{history_, SortKey::response, ""};
};

TEST_F(PagesTest, TellsOfAnInstanceThatHasNotEnded) {
  auto hanging = first_snapshot();
  auto& slow = hanging.callbacks[0];
  slow.open_ns = 4'900'000'000;
  slow.deadline_ns = 50'000'000;
  slow.is_open_long = slow.is_open_certain = true;
  history_.add(hanging);
  const auto screen = draw({.rows = 20, .columns = 120});
  EXPECT_NE(screen.find("slow timer 1 ns has not ended for 4.900 s (deadline 50.00 ms)"),
            std::string::npos)
      << screen;
  EXPECT_NE(screen.find(" >4.900 s"), std::string::npos) << screen;
  const viewer_export::TextStyle style{};
  const auto text = batch_text(hanging, SortKey::response, {}, style);
  EXPECT_NE(text.find("slow timer 1 ns has not ended for 4.900 s (deadline 50.00 ms)\n"),
            std::string::npos)
      << text;
  slow.is_open_certain = false;
  EXPECT_NE(batch_text(hanging, SortKey::response, {}, style)
                .find("slow timer 1 ns began 4.900 s ago, and its end was not seen"),
            std::string::npos);
}

TEST_F(PagesTest, FitEveryScreenAndHoldNoEscapeSequence) {
  for (const auto* keys : {"c", "t", "v", "h"}) {
    type(keys);
    for (const Size size : {Size{24, 80}, Size{1, 1}, Size{2, 200}, Size{5, 10}, Size{100, 40}}) {
      const auto frame = pages_.draw(size);
      EXPECT_LE(frame.size(), size.rows);
      for (const auto& line : frame) {
        std::size_t width = 0;
        for (const auto& span : line.spans) {
          width += viewer_export::display_width(span.text);
          for (const char c : span.text)
            EXPECT_GE(static_cast<unsigned char>(c), 0x20) << keys;
        }
        EXPECT_LE(width, size.columns) << keys;
      }
    }
  }
}

// The lines of the table: what stands above the titles, the titles, the first row.
std::vector<std::string> table_lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    lines.push_back(line);
  const auto titles = std::ranges::find_if(
      lines, [](const std::string& line) { return line.starts_with("callback"); });
  if (titles == lines.begin() || std::distance(titles, lines.end()) < 2) return {};
  return {*std::prev(titles), *titles, *std::next(titles)};
}

TEST_F(PagesTest, SayOfWhatAndOfWhenTheNumbersAre) {
  const auto lines = table_lines(draw());
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_EQ(lines[0].substr(0, 28), std::string(28, ' '));
  EXPECT_EQ(lines[0].substr(28), "               last 5 s: response time   since start");
  EXPECT_EQ(lines[1].substr(28), "  inst/s       p50      *p99       max   late missed");
  EXPECT_EQ(lines[2].substr(28), "     1.0  9.000 ms  9.000 ms  9.000 ms      0      0");
}

TEST_F(PagesTest, ANarrowTableHasFewerNumbersBelowTheirTitles) {
  const auto lines = table_lines(draw(Size{12, 50}));
  ASSERT_EQ(lines.size(), 3U);
  // 50 - 12 of the name: p99 and max, then late and missed have room; inst/s and p50 have not.
  EXPECT_EQ(lines[0].substr(16), "  response, last 5 s   since start");
  EXPECT_EQ(lines[1].substr(16), "      *p99       max   late missed");
  EXPECT_EQ(lines[2].substr(16), "  9.000 ms  9.000 ms      0      0");
}

TEST_F(PagesTest, AVerdictSaysWhyByWhatIsSaidOfIt) {
  auto told = first_snapshot();
  told.verdicts[0].says = "thread 5: 2 callbacks: plan, drive";
  history_.add(told);
  type("v");
  EXPECT_NE(draw().find("one-callback-per-thread, thread 5: 2 callbacks: plan, drive"),
            std::string::npos)
      << draw();
}

TEST_F(PagesTest, SortBySlowestAndByTheNextColumns) {
  EXPECT_LT(place("slow timer"), place("fast timer"));
  type("ssssss");  // p99, p50, max, rate, late, missed, name
  EXPECT_LT(place("fast timer"), place("slow timer"));
  EXPECT_NE(draw().find("*callback"), std::string::npos);
}

TEST_F(PagesTest, FilterAsItIsTyped) {
  type("/fasq");  // q is a letter here
  EXPECT_TRUE(pages_.press(Key::backspace));
  EXPECT_NE(draw().find("fast timer"), std::string::npos);
  EXPECT_EQ(draw().find("slow timer"), std::string::npos);
  pages_.press(Key::enter);
  EXPECT_NE(draw().find("filter: fas"), std::string::npos);
  pages_.press(Key::back);
  EXPECT_NE(draw().find("slow timer"), std::string::npos);
}

TEST_F(PagesTest, EnterShowsTheInstancesOfTheSelectedCallback) {
  draw();
  type("j");
  pages_.press(Key::enter);
  const auto text = draw();
  EXPECT_NE(text.find("/fast@Timer(1)"), std::string::npos);
  EXPECT_NE(text.find(" 78 "), std::string::npos) << text;
  EXPECT_EQ(text.find(" 77 "), std::string::npos) << "that is another one's";
  pages_.press(Key::back);
  EXPECT_NE(draw().find("slow timer"), std::string::npos);
}

TEST_F(PagesTest, APauseShowsOneMoment) {
  type("p");
  auto next = first_snapshot();
  next.callbacks[0].logical_id = "/renamed";
  history_.add(next);
  EXPECT_NE(draw().find("PAUSED"), std::string::npos);
  EXPECT_NE(draw().find("slow timer"), std::string::npos);
  type("p");
  EXPECT_NE(draw().find("/renamed"), std::string::npos);
}

TEST_F(PagesTest, TheEndOfTheSourceIsTold) {
  EXPECT_EQ(draw().find("the session ended"), std::string::npos);
  pages_.source_ended("");
  EXPECT_NE(draw().find("the session ended"), std::string::npos);
  pages_.source_ended("gone \x1b[2J");
  EXPECT_NE(draw().find("gone \\x1b"), std::string::npos) << draw();
}

TEST_F(PagesTest, TheSelectionStaysInTheTableAndInSight) {
  auto many = first_snapshot();
  for (std::uint32_t i = 3; i < 100; ++i)
    many.callbacks.push_back(callback(i, "/n" + std::to_string(i), 100 - i));
  history_.add(many);
  draw();
  pages_.press(Key::end);
  EXPECT_NE(draw().find("/n99"), std::string::npos);
  pages_.press(Key::down);
  EXPECT_NE(draw().find("/n99"), std::string::npos);
  pages_.press(Key::home);
  pages_.press(Key::up);
  EXPECT_NE(draw().find("slow timer"), std::string::npos);
  pages_.press(Key::end);
  draw();
  history_.add(first_snapshot());  // the selected one is gone
  EXPECT_NE(draw().find("slow timer"), std::string::npos);
}

TEST_F(PagesTest, TheSelectedNameIsShownWhole) {
  auto long_name = first_snapshot();
  const std::string name = "/a/very/long/name/of/a/callback@Subscription(/that/fits/no/column)";
  long_name.callbacks = {callback(0, name, 5)};
  history_.add(long_name);
  EXPECT_NE(draw(Size{24, 80}).find(name), std::string::npos);
}

TEST_F(PagesTest, NamesAreShortAndSayTheProcessWhereSeveralHaveThem) {
  auto two = first_snapshot();
  two.callbacks = {callback(0, "/a/plan@Timer(100000000)", 5),
                   callback(1, "/a/plan@Timer(100000000)", 4),
                   callback(2, "/a/drive@Subscription(/pose)", 3)};
  two.verdicts[0].subject = "callback /a/drive@Subscription(/pose)";
  history_.add(two);
  const auto text = draw(Size{24, 120});
  EXPECT_NE(text.find("plan timer 100 ms (pid 100)"), std::string::npos) << text;
  EXPECT_NE(text.find("plan timer 100 ms (pid 101)"), std::string::npos) << text;
  EXPECT_NE(text.find("drive <- /pose "), std::string::npos) << text;
  type("v");
  EXPECT_NE(draw().find("callback drive <- /pose: "), std::string::npos) << draw();
  Pages with_symbols{history_, SortKey::response, "", {.unicode = true}};
  std::string symbols;
  for (const auto& line : with_symbols.draw({})) {
    for (const auto& span : line.spans)
      symbols += span.text;
  }
  EXPECT_NE(symbols.find("drive ← /pose"), std::string::npos) << symbols;
}

// The process that reads writes names with symbols; not every output has these.
TEST_F(PagesTest, WhereThereAreNoSymbolsViolationsHaveNoneEither) {
  auto told = first_snapshot();
  told.callbacks = {callback(0, "/a/drive@Subscription(/pose)", 3)};
  told.callbacks[0].total_missed.reset();
  told.changes[0].says = "thread 5: 2 callbacks: drive ← /pose, drive ⇐ /set";
  told.verdicts[0].says = told.changes[0].says;
  const auto text = batch_text(told, SortKey::response, "", {});
  EXPECT_NE(text.find(": 2 callbacks: drive <- /pose, drive <= /set"), std::string::npos) << text;
  EXPECT_NE(text.find("  0       -\n"), std::string::npos)
      << "no timer misses no release: " << text;
  EXPECT_NE(batch_text(told, SortKey::response, "", {.unicode = true}).find("drive ⇐ /set"),
            std::string::npos);
  history_.add(told);
  type("v");
  EXPECT_NE(draw(Size{24, 120}).find("drive <- /pose, drive <= /set"), std::string::npos) << draw();
}

TEST_F(PagesTest, TheTopLineNamesTheGravestRuleAndTheCommand) {
  auto failing = first_snapshot();
  failing.violations.front().subjects = 201;  // more than are listed
  failing.violations.push_back({.rule = "R3", .name = "deadline", .subjects = 1});
  history_.add(failing);
  const auto text = draw();
  const auto top = text.substr(0, text.find('\n'));
  EXPECT_NE(top.find("FAIL M2 one-callback-per-thread (201)  cie"), std::string::npos) << top;
  EXPECT_NE(text.find("202 violations"), std::string::npos) << text;
  EXPECT_NE(draw(Size{24, 120}).find("(201)  cie run app.yaml\n"), std::string::npos);
  EXPECT_EQ(text.find("net://"), std::string::npos);
}

TEST_F(PagesTest, TheTopLineNamesARuleThatIsUndecided) {
  auto undecided = first_snapshot();
  undecided.verdict = analysis::Verdict::inconclusive;
  undecided.violations.clear();
  undecided.verdicts = {{.rule = "T4",
                         .name = "run-ended",
                         .subject = "process 7",
                         .verdict = analysis::Verdict::inconclusive,
                         .note = "no run_end"}};
  const auto top = headline(undecided).front();
  EXPECT_NE(top.find("  INCONCLUSIVE T4 run-ended"), std::string::npos) << top;
}

TEST_F(PagesTest, QuitsOnQAlone) {
  EXPECT_TRUE(type("abcdefghijklmnop"));
  EXPECT_FALSE(type("q"));
}

}  // namespace
}  // namespace cie::live
