#include "progress_bar.hpp"

#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace cie::cli {
namespace {

using std::chrono::milliseconds;
using Seconds = std::chrono::duration<double>;

std::string line(std::uint64_t done, std::uint64_t total, double seconds, std::size_t columns = 79,
                 ProgressUnit unit = ProgressUnit::bytes) {
  return progress_line("reading", unit, done, total, Seconds(seconds), columns);
}

TEST(ProgressLine, SaysShareRateAndTimeLeft) {
  // 500 MB in 4 s are 125 MB/s; the other 1500 MB take 12 s.
  EXPECT_EQ(line(500'000'000, 2'000'000'000, 4),
            "reading  25 % [#####...............] 500 MB, 125 MB/s, 12 s left");
}

TEST(ProgressLine, CountsInstances) {
  // 1.5 M in 10 s are 150 k/s; 150 M need 990 s more, which is 16.5 minutes.
  EXPECT_EQ(line(1'500'000, 150'000'000, 10, 79, ProgressUnit::instances),
            "reading   1 % [....................] 1.50 M instances, 150 k/s, 16:30 min left");
  EXPECT_EQ(line(1, 2, 1, 79, ProgressUnit::instances),
            "reading  50 % [##########..........] 1 instances, 1 /s, 1 s left");
}

TEST(ProgressLine, PromisesNothingAtFirst) {
  EXPECT_EQ(line(1000, 2000, 0.1), "reading  50 % [##########..........] 1.00 kB");
}

TEST(ProgressLine, EndsAtAHundredPercent) {
  EXPECT_EQ(line(30, 20, 1), "reading 100 % [####################] 30 B, 30 B/s");
}

TEST(ProgressLine, WithoutATotalSaysHowLongItTook) {
  EXPECT_EQ(line(0, 0, 12.3), "reading for 12 s");
  EXPECT_EQ(line(2'000'000, 0, 2), "reading 2.00 MB, 1.00 MB/s");
}

TEST(ProgressLine, FitsAnyTerminal) {
  for (std::size_t columns = 0; columns < 200; ++columns) {
    EXPECT_LE(line(123'456'789, 2'000'000'000, 4'000, columns).size(), columns);
    EXPECT_LE(line(0, 0, 12, columns).size(), columns);
  }
}

// Standard error is a terminal of `columns` while this lives.
class Terminal {
 public:
  explicit Terminal(unsigned short columns) : ours_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    if (ours_ < 0 || ::grantpt(ours_) != 0 || ::unlockpt(ours_) != 0)
      throw std::runtime_error("no pseudo terminal");
    const int theirs = ::open(::ptsname(ours_), O_RDWR | O_NOCTTY);
    winsize size{};
    size.ws_col = columns;
    ::ioctl(theirs, TIOCSWINSZ, &size);
    before_ = ::dup(STDERR_FILENO);
    ::dup2(theirs, STDERR_FILENO);
    ::close(theirs);
  }
  ~Terminal() {
    ::dup2(before_, STDERR_FILENO);
    ::close(before_);
    ::close(ours_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  // What was written since the last call.
  std::string text() const {
    std::string result;
    pollfd wait{.fd = ours_, .events = POLLIN, .revents = 0};
    char part[4096];
    while (::poll(&wait, 1, 0) == 1) {
      const auto size = ::read(ours_, part, sizeof part);
      if (size <= 0) break;
      result.append(part, static_cast<std::size_t>(size));
    }
    return result;
  }

 private:
  int ours_;
  int before_ = -1;
};

// What stands on the line after the terminal has done what `text` says.
std::string left_over(const std::string& text) {
  const auto at = text.rfind('\r');
  return at == std::string::npos ? text : text.substr(at + 1);
}

TEST(ProgressBar, DrawsOnATerminalAndLeavesNothing) {
  const Terminal terminal(60);
  ProgressBar bar(true);
  auto* progress = bar.begin("reading", ProgressUnit::bytes);
  ASSERT_NE(progress, nullptr);
  progress->total = 1000;
  progress->add(250);
  std::string shown;
  for (int i = 0; i < 100 && shown.empty(); ++i) {
    std::this_thread::sleep_for(milliseconds(50));
    shown = terminal.text();
  }
  EXPECT_EQ(shown.find("\rreading  25 % [###"), 0U) << shown;
  EXPECT_LT(left_over(shown).size(), 60 + std::string("\x1b[K").size());
  bar.end();
  EXPECT_EQ(left_over(terminal.text()), "\x1b[K");
}

TEST(ProgressBar, SaysNothingOfWhatIsShort) {
  const Terminal terminal(80);
  {
    ProgressBar bar(true);
    bar.begin("reading", ProgressUnit::bytes);
    bar.begin("writing", ProgressUnit::instances);
  }
  EXPECT_EQ(terminal.text(), "");
}

TEST(ProgressBar, IsSilentWhenNotWanted) {
  const Terminal terminal(80);
  ProgressBar bar(false);
  EXPECT_EQ(bar.begin("reading", ProgressUnit::bytes), nullptr);
}

TEST(ProgressBar, IsSilentWithoutATerminal) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const int before = ::dup(STDERR_FILENO);
  ::dup2(ends[1], STDERR_FILENO);
  ProgressBar bar(true);
  auto* progress = bar.begin("reading", ProgressUnit::bytes);
  ::dup2(before, STDERR_FILENO);
  EXPECT_EQ(progress, nullptr);
  for (const int descriptor : {ends[0], ends[1], before})
    ::close(descriptor);
}

}  // namespace
}  // namespace cie::cli
