// What a recorder says at its end, from what came of the recording alone.
#include "keeping/outcome.hpp"

#include "keeping/manifest.hpp"

#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::record {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

Outcome outcome() {
  Outcome outcome;
  outcome.options.directory = "/rec";
  outcome.options.command = {"./app", "--fast"};
  outcome.manifest.exit = RecordedExit{.code = 0, .signal = std::nullopt};
  return outcome;
}

TEST(Summary, OfADirectoryNamesItTheKernelsRouteAndWhatReadsIt) {
  Outcome kept = outcome();
  note_kernel({.route = "bpf", .events = 12}, kept.manifest);
  EXPECT_EQ(summary(kept),
            "./app exited with status 0\n"
            "recorded /rec (user-space events; kernel events: 12 by bpf)\n"
            "next: cie report /rec\n"
            "      cie verify /rec\n");
}

TEST(Summary, SaysWhyThereIsNoKernel) {
  Outcome kept = outcome();
  EXPECT_THAT(summary(kept), HasSubstr("kernel events: no)"));
  kept.manifest.kernel_reason = "it is for root";
  EXPECT_THAT(summary(kept), HasSubstr("kernel events: no, it is for root)"));
}

TEST(Summary, OfWhatWasAttachedToNamesNoCommand) {
  Outcome kept = outcome();
  kept.options.command.clear();
  kept.manifest.exit.reset();
  EXPECT_THAT(summary(kept), StartsWith("recorded /rec "));
}

TEST(Summary, QuotesForAShell) {
  Outcome kept = outcome();
  kept.options.directory = "/it's here";
  EXPECT_THAT(summary(kept), HasSubstr(R"(next: cie report '/it'\''s here')"));
}

TEST(Summary, LetsNoNameMoveTheTerminalsCursor) {
  Outcome kept = outcome();
  kept.options.directory = "/a\x1b[2Jb\nc";
  EXPECT_THAT(summary(kept), HasSubstr(R"(next: cie report $'/a\033[2Jb\012c')"));
  EXPECT_THAT(summary(kept), Not(HasSubstr("\x1b")));
}

TEST(Summary, CountsLossesAndDoesNotFailForThem) {
  Outcome kept = outcome();
  kept.manifest.channels = {{.name = "state"},
                            {.name = "events", .discarded_events = 7, .lost_packets = 1}};
  note_kernel({.route = "bpf", .events = 0, .lost_events = 3, .untold_switches = 2}, kept.manifest);
  const std::string text = summary(kept);
  EXPECT_TRUE(kept.is_success());
  EXPECT_THAT(text, Not(HasSubstr("channel \"state\"")));
  EXPECT_THAT(text, HasSubstr("LOST: channel \"events\" discarded 7 events and lost 1 packet;"));
  EXPECT_THAT(text, HasSubstr("LOST: the kernel's buffers lost 3 events"));
  EXPECT_THAT(text, HasSubstr("LOST: besides, this kernel did not report 2 switches of threads, "
                              "where no buffer was full:"));
  EXPECT_THAT(text, Not(HasSubstr("though no buffer was full"))) << "one was";
  kept.manifest.kernel.lost_events = 0;
  EXPECT_THAT(summary(kept), HasSubstr("LOST: this kernel did not report 2 switches of threads, "
                                       "though no buffer was full:"));
  EXPECT_THAT(text, HasSubstr("recorded /rec"));
}

TEST(Summary, OfChunksCountsThoseThatAreSealedAndGone) {
  Outcome kept = outcome();
  kept.kept = KeptInChunks{.sealed = 5, .removed = 0};
  EXPECT_THAT(summary(kept),
              HasSubstr("recorded 5 chunks in /rec; each is a recording, too (user-space "
                        "events; kernel events: no)\n"));
  kept.kept = KeptInChunks{.sealed = 5, .removed = 2};
  EXPECT_THAT(summary(kept),
              HasSubstr("5 chunks in /rec, of which the oldest 2 were removed; each"));
}

TEST(Summary, OfSnapshotsNamesTheFirstIfThereIsOne) {
  Outcome kept = outcome();
  kept.kept = KeptInSnapshots{.saved = 0, .left_out = 4, .has_kernel_events = false};
  EXPECT_EQ(summary(kept),
            "./app exited with status 0\n"
            "saved 0 snapshots in /rec; 4 times more there was a reason to, but --max-snapshots or "
            "--min-interval forbade it\n");
  kept.kept = KeptInSnapshots{.saved = 2, .left_out = 0, .has_kernel_events = false};
  EXPECT_THAT(summary(kept),
              HasSubstr("saved 2 snapshots in /rec (user-space events; kernel events: no)\n"
                        "next: cie report /rec/snapshot-001\n"));
  kept.kept = KeptInSnapshots{.saved = 2, .left_out = 0, .has_kernel_events = true};
  EXPECT_THAT(summary(kept),
              HasSubstr("saved 2 snapshots in /rec (user-space and kernel events)\n"));
}

TEST(Summary, SaysOneOfOne) {
  Outcome kept = outcome();
  kept.manifest.channels = {{.name = "events", .discarded_events = 1, .lost_packets = 0}};
  note_kernel({.route = "bpf", .events = 0, .lost_events = 1, .untold_switches = 1}, kept.manifest);
  kept.kept = KeptInChunks{.sealed = 1, .removed = 1};
  EXPECT_THAT(summary(kept), HasSubstr("discarded 1 event and lost 0 packets;"));
  EXPECT_THAT(summary(kept), HasSubstr("the kernel's buffers lost 1 event;"));
  EXPECT_THAT(summary(kept), HasSubstr("did not report 1 switch of threads"));
  EXPECT_THAT(summary(kept),
              HasSubstr("recorded 1 chunk in /rec, of which the oldest 1 was removed;"));
  kept.kept = KeptInSnapshots{.saved = 1, .left_out = 1, .has_kernel_events = false};
  EXPECT_THAT(summary(kept), HasSubstr("saved 1 snapshot in /rec; 1 time more there was"));
}

TEST(Summary, OfWhatWasStreamedNamesItsSessionsThere) {
  Outcome kept = outcome();
  kept.kept = KeptElsewhere{};
  kept.options.relay = NetworkAddress{.host = "desk", .port = 5342};
  kept.manifest.relay = {
      .address = "desk:5342",
      .sessions = {{.path = "robot/cie-record-1-*", .begin = {}, .lost = {}, .end = {}}}};
  EXPECT_THAT(summary(kept), HasSubstr("streamed to the relay daemon at desk:5342, as "
                                       "robot/cie-record-1-* (user-space events; kernel events: "
                                       "no)\nnext, where it collects"));
}

TEST(Summary, OfAFailureSaysWhatIsWrongInsteadOfWhatIsNext) {
  Outcome kept = outcome();
  kept.manifest.exit = RecordedExit{.code = std::nullopt, .signal = SIGKILL};
  kept.manifest.problems = {"the disk was full", "a daemon died"};
  EXPECT_FALSE(kept.is_success());
  EXPECT_EQ(summary(kept),
            "./app was killed by signal 9 (Killed)\n"
            "THE RECORDING FAILED; what there is stands in /rec:\n"
            "  the disk was full\n"
            "  a daemon died\n");
  kept.options.relay = NetworkAddress{.host = "desk", .port = 1};
  EXPECT_THAT(summary(kept), HasSubstr("what there is stands at desk:1:\n"));
}

TEST(Summary, OfAFailureTellsWhatIsWrongOnceAndTheKernelsPartToo) {
  Outcome kept = outcome();
  kept.manifest.problems = {"a daemon died", "a daemon died"};
  kept.manifest.kernel.problems = {"a buffer cannot be read"};
  EXPECT_THAT(summary(kept), HasSubstr("stands in /rec:\n"
                                       "  a daemon died\n"
                                       "  a buffer cannot be read\n"));
  kept.manifest.problems.clear();
  EXPECT_EQ(exit_status(kept), 4);
}

TEST(Summary, OfADirectoryThatIsGoneSaysNotThatSomethingStandsThere) {
  Outcome kept = outcome();
  kept.manifest.problems = {"\"/rec\" was removed or renamed"};
  kept.is_directory_there = false;
  EXPECT_THAT(summary(kept), HasSubstr("THE RECORDING FAILED:\n  \"/rec\" was removed"));
}

TEST(ExitStatusOfTheRecorder, IsTheCommandsOnlyWhereThatWasAskedForAndTheRecordingSucceeded) {
  Outcome kept = outcome();
  kept.manifest.exit = RecordedExit{.code = 3, .signal = std::nullopt};
  EXPECT_EQ(exit_status(kept), 0);
  kept.options.preserves_status = true;
  EXPECT_EQ(exit_status(kept), 3);
  kept.manifest.exit = RecordedExit{.code = std::nullopt, .signal = SIGKILL};
  EXPECT_EQ(exit_status(kept), 128 + 9);
  kept.manifest.problems = {"LTTng did not end the session"};
  EXPECT_EQ(exit_status(kept), 4);
}

}  // namespace
}  // namespace cie::record
