// What all rooms of tracepoints/ stand on.
#include "base/clock.hpp"
#include "base/cpu_list.hpp"
#include "base/file_descriptor.hpp"
#include "base/machine.hpp"
#include "base/network_address.hpp"
#include "base/text.hpp"
#include "base/uuid.hpp"

#include <array>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>

namespace cie {
namespace {

FileDescriptor null_device() { return FileDescriptor(open("/dev/null", O_WRONLY | O_CLOEXEC)); }

bool is_open(int descriptor) { return fcntl(descriptor, F_GETFD) >= 0; }

TEST(FileDescriptor, ClosesWithItsOwner) {
  int number = -1;
  {
    const FileDescriptor file = null_device();
    number = file.get();
    ASSERT_TRUE(is_open(number));
  }
  EXPECT_FALSE(is_open(number));
}

TEST(FileDescriptor, GivesUpWhatIsMovedAway) {
  FileDescriptor first = null_device();
  FileDescriptor second = null_device();
  const int moved = first.get();
  const int replaced = second.get();
  second = std::move(first);
  EXPECT_EQ(second.get(), moved);
  EXPECT_TRUE(is_open(moved));
  EXPECT_FALSE(is_open(replaced));
}

TEST(FileDescriptor, SaysWhetherClosingFailed) {
  FileDescriptor file = null_device();
  EXPECT_TRUE(file.close());
  EXPECT_FALSE(file.is_open());
  EXPECT_TRUE(file.close()) << "nothing is left to close";
  EXPECT_FALSE(FileDescriptor(1 << 20).close()) << "no such descriptor";
}

TEST(Clocks, ArePairedBetweenLooksAtEach) {
  const std::int64_t before = now_ns(CLOCK_MONOTONIC);
  const ClockPair pair = read_clocks();
  EXPECT_GE(pair.monotonic_ns, before);
  EXPECT_LE(pair.monotonic_ns, now_ns(CLOCK_MONOTONIC));
}

// Of addresses with a port that may be left out, and of those that have one.
std::string read_address(std::string_view text) {
  const auto address = parse_address(text, 5342);
  return address ? address->host + ' ' + std::to_string(address->port) : "none";
}
std::string read_listen_address(std::string_view text) {
  const auto address = parse_listen_address(text, std::nullopt);
  return address ? address->host + ' ' + std::to_string(address->port) : "none";
}

TEST(Addresses, HaveAPortOrTheDefaultOne) {
  EXPECT_EQ(read_address("desk"), "desk 5342");
  EXPECT_EQ(read_address("desk:7"), "desk 7");
  EXPECT_EQ(read_address("::1"), "::1 5342");
  EXPECT_EQ(read_address("[::1]"), "::1 5342");
  EXPECT_EQ(read_address("[::1]:7"), "::1 7");
  for (const char* text : {"", ":7", "desk:", "desk:x", "desk:65536", "desk:-1", "[::1", "[]:7",
                           "[::1]7", "[::1]:", "a b", "a/b", "me@desk"}) {
    EXPECT_EQ(read_address(text), "none") << text;
  }
}

TEST(Addresses, ToListenAtMayBeAPortOfThisMachine) {
  EXPECT_EQ(read_listen_address("9464"), "127.0.0.1 9464");
  EXPECT_EQ(read_listen_address("0"), "127.0.0.1 0");
  EXPECT_EQ(read_listen_address("0.0.0.0:9464"), "0.0.0.0 9464");
  EXPECT_EQ(read_listen_address("[::]:9464"), ":: 9464");
  EXPECT_EQ(read_listen_address("::1:9464"), "::1 9464") << "there has to be a port";
  for (const char* text : {"", "65536", ":9464", "127.0.0.1:", "localhost", "[::1]"}) {
    EXPECT_EQ(read_listen_address(text), "none") << text;
  }
}

TEST(Addresses, AreWrittenAsTheyAreRead) {
  EXPECT_EQ((NetworkAddress{.host = "desk", .port = 7}).text(), "desk:7");
  EXPECT_EQ((NetworkAddress{.host = "::1", .port = 7}).text(), "[::1]:7");
  EXPECT_EQ((NetworkAddress{.host = "::1", .port = 7}).url(), "tcp6://[::1]:7");
}

TEST(Joined, HasSeparatorsBetweenTextsOnly) {
  EXPECT_EQ(joined(std::vector<std::string>{}), "");
  EXPECT_EQ(joined(std::vector<std::string>{"a"}), "a");
  EXPECT_EQ(joined(std::array<std::string_view, 3>{"a", "b", "c"}), "a, b, c");
  EXPECT_EQ(joined(std::vector<std::string>{"a", "b"}, " "), "a b");
}

TEST(Counted, IsSingularForOne) {
  EXPECT_EQ(counted(1, "instance"), "1 instance");
  EXPECT_EQ(counted(0, "instance"), "0 instances");
  EXPECT_EQ(counted(2, "process"), "2 processes");
  EXPECT_EQ(counted(2, "switch"), "2 switches");
  EXPECT_EQ(counted(1, "was", "were"), "1 was");
  EXPECT_EQ(counted(2, "was", "were"), "2 were");
}

TEST(ShellQuoted, IsOneArgumentThatIsPastedAsItIsPrinted) {
  EXPECT_EQ(shell_quoted("run-1/a.b"), "run-1/a.b");
  EXPECT_EQ(shell_quoted(""), "''");
  EXPECT_EQ(shell_quoted("my run"), "'my run'");
  EXPECT_EQ(shell_quoted("it's"), "'it'\\''s'");
  EXPECT_EQ(shell_quoted("Läufe 1"), "'Läufe 1'");
  EXPECT_EQ(shell_quoted("new\nline\x1b it's \\"), "$'new\\012line\\033 it\\047s \\134'");
  EXPECT_EQ(shell_quoted("\x1b[2J"), "$'\\033[2J'");
  EXPECT_EQ(shell_quoted("\xff"), "$'\\377'") << "no UTF-8";
}

TEST(Numbers, AreWholeTexts) {
  EXPECT_EQ(parse_number<int>("-17"), -17);
  EXPECT_EQ(parse_number<std::uint64_t>("ff", 16), 255U);
  EXPECT_EQ(parse_number<std::uint16_t>("65535"), 65535);
  EXPECT_EQ(parse_number<double>("1.5"), 1.5);
  for (const char* text : {"", " 1", "1 ", "+1", "-1", "0x1", "one", "65536"})
    EXPECT_EQ(parse_number<std::uint16_t>(text), std::nullopt) << text;
}

TEST(UuidText, HasTheDigitsOfAllBytes) {
  const auto uuid = uuid_text(std::array<std::uint8_t, 16>{
      0x3e, 0xc7, 0x51, 0xa9, 0xcc, 0x27, 0x40, 0x01, 0x80, 0x02, 0, 0xff, 0x0f, 0xf0, 0x10, 0x01});
  EXPECT_EQ(uuid, "3ec751a9-cc27-4001-8002-00ff0ff01001");
}

TEST(Machine, KnowsWhenThisProcessBegan) {
  const auto start = start_ns("self");
  ASSERT_TRUE(start);
  EXPECT_LE(*start, now_ns(CLOCK_MONOTONIC));
  EXPECT_EQ(stat_field("self", 4), static_cast<std::uint64_t>(getppid()));
}

TEST(Machine, KnowsNothingOfAProcessThatIsNotThere) {
  EXPECT_FALSE(start_ns("0"));
  EXPECT_FALSE(stat_field("0", 22));
}

// The number that it prints is its pid.
TEST(Machine, KnowsByWhatTheClockOfATimeNamespaceIsAhead) {
  EXPECT_FALSE(monotonic_offset_ns("0"));
  const std::unique_ptr<FILE, int (*)(FILE*)> process(
      popen("unshare --time --monotonic=1000 --fork sh -c 'echo $$; exec sleep 10' 2>/dev/null",
            "r"),
      pclose);
  int pid = 0;
  if (!process || std::fscanf(process.get(), "%d", &pid) != 1) {
    GTEST_SKIP()
        << "not possible here: a time namespace, as another user than root or of another kernel";
  }
  const auto ahead = monotonic_offset_ns(std::to_string(pid));
  kill(pid, SIGTERM);
  const std::int64_t own = monotonic_offset_ns("self").value_or(0);
  ASSERT_TRUE(ahead);
  EXPECT_EQ(*ahead - own, 1'000'000'000'000);
}

TEST(CpuList, HasCommasBetween) {
  EXPECT_EQ(cpu_list({0, 2, 3}), "0,2,3");
  EXPECT_EQ(cpu_list({}), "");
}

}  // namespace
}  // namespace cie
