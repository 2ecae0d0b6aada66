// cie-record's command line.
#include "lttng/session_channels.hpp"
#include "options/command_line.hpp"
#include "system/error.hpp"

#include <chrono>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace cie::record {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;

Options parse(const std::vector<std::string>& arguments, bool is_root = false) {
  return parse_command_line(arguments, is_root).options.value();
}

TEST(RecorderOptions, EverythingAfterTheSeparatorIsTheCommand) {
  const Options options = parse({"-o", "/tmp/a b", "--", "app", "--attach", "-o", "--"});
  EXPECT_EQ(options.directory, "/tmp/a b");
  EXPECT_EQ(options.command, (std::vector<std::string>{"app", "--attach", "-o", "--"}));
  EXPECT_FALSE(options.is_attach());
}

TEST(RecorderOptions, MakesTheDirectoryAbsolute) {
  EXPECT_TRUE(parse({"-o", "x/../y", "--", "a"}).directory.is_absolute());
  EXPECT_EQ(parse({"-o", "x/../y", "--", "a"}).directory.filename(), "y");
  EXPECT_TRUE(parse({"--", "a"}).directory.filename().string().starts_with("cie-recording-"));
}

TEST(RecorderOptions, GivesACommandADaemonOfItsOwn) {
  EXPECT_EQ(parse({"--", "a"}).daemon, DaemonChoice::own);
  EXPECT_EQ(parse({"--daemon=shared", "--", "a"}).daemon, DaemonChoice::shared);
  EXPECT_EQ(parse({"--", "a"}, true).daemon, DaemonChoice::own_if_possible);
  EXPECT_EQ(parse({"--attach"}).daemon, DaemonChoice::shared);
  EXPECT_EQ(parse({"--daemon=own", "--", "a"}, true).daemon, DaemonChoice::own);
  EXPECT_THROW(parse({"--daemon=own", "--attach"}), UsageError);
}

TEST(RecorderOptions, ReadsSizesAndTimes) {
  const Options options = parse({"--attach", "--duration", "1.5", "--subbuf-size", "4m",
                                 "--num-subbuf", "16", "--flush-interval", "250"});
  EXPECT_EQ(options.duration, milliseconds(1500));
  EXPECT_EQ(options.subbuf_size, 4U << 20);
  EXPECT_EQ(options.num_subbuf, 16U);
  EXPECT_EQ(options.flush_interval, milliseconds(250));
}

TEST(RecorderOptions, RecordsTheKernelIfPossible) {
  EXPECT_EQ(parse({"--", "a"}).kernel, KernelChoice::automatic);
  EXPECT_EQ(parse({"--kernel=yes", "--", "a"}).kernel, KernelChoice::yes);
  EXPECT_EQ(parse({"--kernel=yes", "--", "a"}).kernel_route, KernelRoute::best);
  EXPECT_EQ(parse({"--kernel=no", "--", "a"}).kernel, KernelChoice::no);
  EXPECT_EQ(parse({"--kernel=bpf", "--", "a"}).kernel, KernelChoice::yes);
  EXPECT_EQ(parse({"--kernel=bpf", "--", "a"}).kernel_route, KernelRoute::bpf);
  EXPECT_EQ(parse({"--kernel=tracefs", "--", "a"}).kernel_route, KernelRoute::tracefs);
  EXPECT_EQ(parse({"--kernel-buffer=16m", "--", "a"}).kernel_buffer_size, 16U << 20);
}

TEST(RecorderOptions, TakesTheKernelWithoutAValueForYes) {
  const std::vector<std::vector<std::string>> cases{{"--kernel", "--", "a"},
                                                    {"--kernel", "-o", "x", "--", "a"},
                                                    {"-o", "x", "--kernel", "--attach"}};
  for (const auto& arguments : cases) {
    const Options options = parse(arguments);
    EXPECT_EQ(options.kernel, KernelChoice::yes) << ::testing::PrintToString(arguments);
    EXPECT_EQ(options.kernel_route, KernelRoute::best);
  }
  EXPECT_EQ(parse({"--kernel", "-o", "/x", "--", "a"}).directory, "/x");
  EXPECT_EQ(parse({"--kernel", "no", "--", "a"}).kernel, KernelChoice::no);
  EXPECT_THROW(parse({"--kernel", "a", "--", "b"}), UsageError) << "no command stands there";
}

TEST(RecorderOptions, KeepsTheKernelsEventsInMemoryOnlyIfAskedTo) {
  EXPECT_EQ(parse({"--snapshot", "5", "--", "a"}).kernel, KernelChoice::no);
  EXPECT_EQ(parse({"--snapshot", "5", "--kernel=yes", "--", "a"}).kernel, KernelChoice::yes);
  EXPECT_EQ(parse({"--snapshot", "5", "--kernel=no", "--", "a"}).kernel, KernelChoice::no);
}

TEST(RecorderOptions, SayWhichOptionLeftOutTheKernelsEvents) {
  const auto reason = [](const std::vector<std::string>& arguments) {
    return parse(arguments).no_kernel_because;
  };
  EXPECT_EQ(reason({"--rotate", "60", "--", "a"}), "--rotate has them with --kernel=yes only");
  EXPECT_EQ(reason({"--snapshot", "5", "--", "a"}), "--snapshot has them with --kernel=yes only");
  EXPECT_EQ(reason({"--to", "desk", "--", "a"}), "--to streams what LTTng records");
  for (const char* choice : {"--kernel=no", "--kernel=yes", "--kernel=auto"})
    EXPECT_EQ(reason({choice, "--", "a"}), "");
  EXPECT_EQ(reason({"--rotate", "60", "--kernel=no", "--", "a"}), "");
}

TEST(RecorderOptions, AddsEventsToItsOwn) {
  EXPECT_EQ(parse({"--event", "ros2:*", "--", "a"}).events,
            (std::vector<std::string>{"cie:*", "ros2:*"}));
}

TEST(RecorderOptions, AddTheEventsOfRos2sTracersToThoseThatAreRecorded) {
  const auto recorded = [](const std::vector<std::string>& arguments) {
    return event_patterns(parse(arguments));
  };
  EXPECT_THAT(recorded({"--", "a"}), ElementsAre("cie:*"));
  EXPECT_THAT(recorded({"--ros2", "--event", "mine:*", "--", "a"}),
              ElementsAre("cie:*", "mine:*", "ros2:*", "ros2_caret:*", "agnocast:*"));
  EXPECT_THAT(recorded({"--profile", "ros2", "--", "a"}), ElementsAre("cie:*", "ros2:*"));
}

TEST(RecorderOptions, DividesARecordingIntoChunks) {
  EXPECT_FALSE(parse({"--", "a"}).rotate);
  const Options options = parse({"--rotate", "2.5", "--keep", "7", "--", "a"});
  EXPECT_EQ(options.rotate.value().interval, milliseconds(2500));
  EXPECT_EQ(options.rotate.value().most, 7U);
  EXPECT_EQ(options.kernel, KernelChoice::no);
  EXPECT_EQ(parse({"--rotate", "60", "--attach"}).rotate.value().most, 0U);
  EXPECT_EQ(parse({"--rotate", "60", "--kernel=yes", "--attach"}).kernel, KernelChoice::yes);
}

TEST(RecorderOptions, RefusesWhatMakesNoSense) {
  const std::vector<std::vector<std::string>> cases{
      {},
      {"app"},
      {"--"},
      {"--attach", "--", "a"},
      {"--attach", "--preserve-status"},
      {"--duration", "1", "--", "a"},
      {"--attach", "--duration", "0"},
      {"--attach", "--duration", "1e300"},
      {"--attach", "--duration", "nan"},
      {"--attach", "--duration", "1s"},
      {"--subbuf-size", "5000", "--", "a"},
      {"--subbuf-size", std::to_string(sysconf(_SC_PAGESIZE) / 2), "--", "a"},
      {"--num-subbuf", "1", "--", "a"},
      {"--num-subbuf", "-8", "--", "a"},
      {"--kernel=maybe", "--", "a"},
      {"--kernel-buffer", "1k", "--", "a"},
      {"--kernel-buffer", "2g", "--", "a"},
      {"--snapshot", "--", "a"},
      {"--rotate", "0.5", "--", "a"},
      {"--rotate", "--", "a"},
      {"--rotate", "60", "--keep", "0", "--", "a"},
      {"--rotate", "60", "--snapshot", "5", "--", "a"},
      {"--keep", "7", "--", "a"},
      {"--to", "host:", "--", "a"},
      {"--to", "host:65536", "--", "a"},
      {"--to", "host:0", "--", "a"},
      {"--to", "host:65535", "--", "a"},  // the port for data follows
      {"--to", ":5342", "--", "a"},
      {"--to", "[::1", "--", "a"},
      {"--to", "[::1]5342", "--", "a"},
      {"--to", "net://host/x", "--", "a"},
      {"--to", "host", "--snapshot", "10", "--", "a"},
      {"--to", "host", "--kernel=yes", "--", "a"},
      {"--to", "host", "--rotate", "60", "--", "a"},
      {"--unknown", "--", "a"},
  };
  for (const auto& arguments : cases) {
    EXPECT_THROW(parse(arguments), UsageError) << ::testing::PrintToString(arguments);
  }
}

// Whatever time is kept: what a snapshot is saved for is still in the last CPU's buffer when that is saved.
TEST(RecorderOptions, ASnapshotIsSavedBeforeItsReasonIsOverwritten) {
  EXPECT_THROW(parse({"--snapshot", "0.499", "--", "a"}), UsageError);
  for (auto length = kLeastSnapshot; length < std::chrono::seconds(10); length += milliseconds(7)) {
    const SnapshotPace pace = pace_of(length);
    const auto begun = pace.look + pace.aftermath + pace.description;
    EXPECT_LE(begun * 2, length) << length.count();
    EXPECT_LE(begun + kRaggedEnd, length) << length.count();
  }
  const SnapshotPace longest = pace_of(std::chrono::hours(1));
  EXPECT_EQ(longest.look + longest.aftermath + longest.description, milliseconds(550));
}

TEST(RecorderOptions, NamesTheShortestSnapshot) {
  try {
    parse({"--snapshot", "0.3", "--", "a"});
    FAIL() << "0.3 seconds were taken";
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(),
                 "--snapshot: takes 0.5 to 3600 seconds, and not \"0.3\": what less would be saved "
                 "for is overwritten before it is saved");
  }
}

TEST(RecorderOptions, NamesTheTimeThatIsNone) {
  try {
    parse({"--attach", "--duration", "0"});
    FAIL() << "0 seconds were taken";
  } catch (const UsageError& error) {
    EXPECT_STREQ(error.what(),
                 "--duration: takes seconds, above 0 and at most 1000000000, and not \"0\"");
  }
}

// What the library that parses says has neither units nor the words of the help.
TEST(RecorderOptions, SayWhatAnOptionTakes) {
  const auto said = [](std::vector<std::string> arguments) -> std::string {
    try {
      parse(std::move(arguments));
    } catch (const UsageError& error) {
      return error.what();
    }
    return "nothing";
  };
  EXPECT_EQ(said({"--attach", "--rotate", "0.5"}),
            "--rotate SECONDS takes 1 to 1000000, and not 0.5");
  EXPECT_EQ(said({"--attach", "--flush-interval", "9"}),
            "--flush-interval MS takes 10 to 3600000, and not 9");
  EXPECT_EQ(said({"--attach", "--subbuf-size", "4q"}),
            "--subbuf-size BYTES takes a size such as 4096, 512k or 4m");
  EXPECT_EQ(said({"--attach", "--output"}), "--output needs a value: --output DIR");
  EXPECT_EQ(said({"--attach", "-o", ""}), "--output needs a value: --output DIR");
  EXPECT_EQ(said({"--attach", "--rotate", "5", "--rotate", "6"}),
            "--rotate is given more than once");
  EXPECT_EQ(said({"--duration", "1", "--", "a"}), "--duration requires --attach");
  EXPECT_EQ(said({"app", "--duration", "1"}),
            "one argument too many: \"app\"; the command to record follows after --");
}

TEST(RecorderOptions, KnowsRelayDaemonsByNameAndPort) {
  const auto relay = [](const std::string& text) {
    return parse({"--to", text, "--", "a"}).relay.value();
  };
  EXPECT_EQ(relay("robot").text(), "robot:5342");
  EXPECT_EQ(relay("robot:7000").url(), "tcp://robot:7000");
  EXPECT_EQ(relay("net://10.0.0.1").text(), "10.0.0.1:5342");
  EXPECT_EQ(relay("tcp://10.0.0.1:99").text(), "10.0.0.1:99");
  EXPECT_EQ(relay("[fe80::1]:99").url(), "tcp6://[fe80::1]:99");
  EXPECT_EQ(relay("::1").url(), "tcp6://[::1]:5342");
  EXPECT_EQ(parse({"--live", "net://desk:7", "--", "a"}).relay.value().text(), "desk:7");
  EXPECT_EQ(parse({"--to", "desk", "--", "a"}).kernel, KernelChoice::no);
  EXPECT_FALSE(parse({"--", "a"}).relay);
}

TEST(RecorderOptions, ExplainsItself) {
  const ParsedCommandLine help = parse_command_line({"--help"}, false);
  EXPECT_FALSE(help.options);
  EXPECT_NE(help.text.find("cie record [OPTIONS] -- CMD"), std::string::npos);
  EXPECT_TRUE(parse_command_line({"--version"}, false).text.starts_with("cie-record "));
}

}  // namespace
}  // namespace cie::record
