// manifest.json, written and read.
#include <cie/tracepoints/recording_manifest.hpp>

#include "support/temporary_directory.hpp"

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string with(const std::string& members) {
  return R"({"schema": "cie.recording/1", )" + members + '}';
}

// What is wrong with it; empty: nothing.
std::string refusal(const std::string& text) {
  try {
    parse_recording_manifest(text);
  } catch (const ManifestError& error) {
    return error.what();
  }
  return {};
}

RecordingManifest full() {
  RecordingManifest manifest;
  manifest.tool_version = "1.2";
  manifest.mode = "command";
  manifest.command = {"app", "--fast"};
  manifest.exit = RecordedExit{.code = std::nullopt, .signal = 9};
  manifest.host = "robot";
  manifest.boot_id = "b";
  manifest.begin = {.monotonic_ns = 1, .realtime_ns = 9'007'199'254'740'993};  // beyond 2^53
  manifest.end = {.monotonic_ns = 2, .realtime_ns = -3};
  manifest.snapshot = {.reason = "late", .held_ns = 7};
  manifest.relay = {.address = "desk:5342",
                    .sessions = {{.path = "robot/s-*",
                                  .begin = {.monotonic_ns = 1, .realtime_ns = 1},
                                  .lost = std::nullopt,
                                  .end = RecordedInstant{.monotonic_ns = 2, .realtime_ns = 2}}}};
  manifest.chunk = 4;
  manifest.removed_chunks = 3;
  manifest.has_kernel_events = true;
  manifest.kernel = {.route = "bpf",
                     .buffer_size = 4096,
                     .streams = 2,
                     .events = 18'446'744'073'709'551'615U,
                     .lost_events = 1,
                     .untold_switches = 5};
  manifest.session = {.name = "s",
                      .events = {"cie:*"},
                      .subbuf_size = 1,
                      .num_subbuf = 2,
                      .flush_interval_ms = 1000};
  manifest.processes = {{.pid = 12, .name = "app", .start_ns = 77},
                        {.pid = 13, .name = "", .start_ns = std::nullopt},
                        {.pid = 14,
                         .name = "apart",
                         .start_ns = std::nullopt,
                         .monotonic_offset_ns = -1'000'000'000}};
  manifest.names_all_processes = false;
  manifest.channels = {{.name = "events", .discarded_events = 6, .lost_packets = 7}};
  manifest.problems = {"the disk was full"};
  manifest.files = {{.path = "ust/events_0", .size = 8192, .sha256 = "ab"}};
  return manifest;
}

TEST(RecordingManifestText, IsReadAsItWasWritten) {
  EXPECT_EQ(parse_recording_manifest(to_json(full())), full());
  EXPECT_EQ(parse_recording_manifest(to_json({})), RecordingManifest());
  RecordingManifest whole = full();
  whole.exit = RecordedExit{.code = 0, .signal = std::nullopt};
  whole.has_kernel_events = false;
  whole.kernel = {};
  whole.kernel_reason = "it is for root";
  EXPECT_EQ(parse_recording_manifest(to_json(whole)), whole);
}

TEST(RecordingManifestText, MayLackWhatOlderOnesLack) {
  const auto read = parse_recording_manifest(with(R"("processes": [{"pid": 5, "name": "a"}])"));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->processes[0].pid, 5);
  EXPECT_FALSE(read->processes[0].start_ns);
  EXPECT_FALSE(read->kernel.events);
  EXPECT_TRUE(read->names_all_processes);
}

TEST(RecordingManifestText, OfSomethingElseIsNone) {
  EXPECT_FALSE(parse_recording_manifest(R"({"name": "a web page"})"));
  EXPECT_FALSE(parse_recording_manifest(R"({"schema": "another/1", "files": 3})"));
  EXPECT_FALSE(parse_recording_manifest("[]"));
}

TEST(RecordingManifestText, IsRefusedWhereItIsWrong) {
  EXPECT_THAT(refusal(""), HasSubstr("no JSON"));
  EXPECT_THAT(refusal(R"({"schema": "cie.recording/1")"), HasSubstr("no JSON"));
  EXPECT_THAT(refusal(R"({"schema": "cie.recording/2"})"), HasSubstr("cie.recording/2"));
  EXPECT_THAT(refusal(with(R"("files": {})")), HasSubstr("files is not a list"));
  EXPECT_THAT(refusal(with(R"("files": [null])")), HasSubstr("files[0] is not"));
  EXPECT_THAT(refusal(with(R"("files": [{"path": "a", "size": -1}])")),
              HasSubstr("files[0].size is not an integer of its range"));
  EXPECT_THAT(refusal(with(R"("files": [{"path": "a", "size": 1.5}])")),
              HasSubstr("files[0].size"));
  EXPECT_THAT(refusal(with(R"("files": [{"path": "a"}])")), HasSubstr("files[0].size"));
  EXPECT_THAT(refusal(with(R"("processes": [{"name": "a"}])")), HasSubstr("processes[0].pid"));
  EXPECT_THAT(refusal(with(R"("kernel_events": 1)")), HasSubstr("kernel_events is not true or"));
  EXPECT_THAT(refusal(with(R"("exit": {})")), HasSubstr("exit is not a status or a signal"));
  EXPECT_THAT(refusal(with(R"("exit": {"status": 99999999999})")), HasSubstr("exit.status"));
  EXPECT_THAT(refusal(with(R"("tool": 3)")), HasSubstr("tool is not an object"));
}

TEST(RecordingManifestText, NamesNoFileOutsideItsRecording) {
  for (const char* path : {"/etc/passwd", "../secret", "a/../../b", "a/..", ".", "", "./a", "a/",
                           "a//../b", "a\\u0000b"}) {
    const auto file = std::string(R"("files": [{"path": ")") + path + R"(", "size": 1}])";
    EXPECT_THAT(refusal(with(file)), HasSubstr("files[0].path is not a path below")) << path;
  }
  EXPECT_EQ(refusal(with(R"("files": [{"path": "a/..b/c..", "size": 1}])")), "");
}

TEST(RecordingManifestText, IsBounded) {
  EXPECT_THAT(refusal(std::string(1'000'000, '[')), HasSubstr("nested deeper"));
  EXPECT_THAT(refusal(with("\"a\": \"" + std::string(17'000'000, 'x') + '"')), HasSubstr("larger"));
  std::string many = R"("a": {)";
  for (int i = 0; i < 300'000; ++i)
    many += '"' + std::to_string(i) + "\": 0,";
  EXPECT_EQ(refusal(with(many + R"("z": 0})")), "") << "in a moment";
}

TEST(RecordingManifestFile, IsAFileOfItsDirectory) {
  const TemporaryDirectory directory;
  EXPECT_FALSE(load_recording_manifest(directory.path()));
  std::ofstream(directory.path() / kManifestName) << to_json(full());
  EXPECT_EQ(load_recording_manifest(directory.path())->host, "robot");
  fs::remove(directory.path() / kManifestName);
  fs::create_directory(directory.path() / kManifestName);
  EXPECT_THROW(load_recording_manifest(directory.path()), ManifestError);
}

}  // namespace
}  // namespace cie::test
