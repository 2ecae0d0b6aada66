// What the recorder writes into manifest.json, read back.
#include "keeping/manifest.hpp"

#include <cie/tracepoints/sha256.hpp>

#include "base/machine.hpp"
#include "lttng/session_channels.hpp"
#include "support/temporary_directory.hpp"
#include "system/directory_claim.hpp"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

void write_file(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

TEST(Manifest, SaysWhatWasAskedForAndHashesEveryFile) {
  const test::TemporaryDirectory directory;
  write_file(directory.path() / "ust" / "events_0", "abc");
  write_file(directory.path() / kRecordingClaimName, "");
  Options options;
  options.command = {"./app", "--fast"};
  options.relay = NetworkAddress{.host = "desk", .port = 5342};
  options.kernel_buffer_size = 4096;
  options.subbuf_size = 8192;
  options.num_subbuf = 2;
  options.flush_interval = std::chrono::milliseconds(250);
  write_manifest(Directory::open(directory.path()), manifest_of(options));

  const auto read = load_recording_manifest(directory.path());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->mode, "command");
  EXPECT_EQ(read->command, options.command);
  EXPECT_EQ(read->host, host_name());
  EXPECT_EQ(read->relay, (RecordedRelay{.address = "desk:5342", .sessions = {}}));
  EXPECT_FALSE(read->removed_chunks);
  EXPECT_FALSE(read->has_kernel_events);
  EXPECT_EQ(read->kernel_reason, "--kernel=no");
  EXPECT_EQ(read->session, (RecordedSession{.name = "",
                                            .events = event_patterns(options),
                                            .subbuf_size = 8192,
                                            .num_subbuf = 2,
                                            .flush_interval_ms = 250}));
  EXPECT_EQ(read->files, (std::vector<RecordedFile>{
                             {.path = "ust/events_0", .size = 3, .sha256 = sha256_hex("abc")}}));
}

TEST(Manifest, OfChunksHashesTheirManifestsOnly) {
  const test::TemporaryDirectory directory;
  write_file(directory.path() / "chunk-000002" / "ust" / "events_0", "abc");
  write_file(directory.path() / "chunk-000002" / kManifestName, "{}");
  Options options;
  options.rotate.emplace();
  RecordingManifest manifest = manifest_of(options);
  manifest.removed_chunks = 1;
  write_manifest(Directory::open(directory.path()), manifest);

  const auto read = load_recording_manifest(directory.path());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->mode, "attach");
  EXPECT_EQ(read->removed_chunks, 1);
  ASSERT_EQ(read->files.size(), 1);
  EXPECT_EQ(read->files[0].path, "chunk-000002/manifest.json");
}

TEST(Manifest, OfTheKernelSaysWhatWasMeasuredAndHowLargeTheBuffersAre) {
  Options options;
  options.kernel_buffer_size = 4096;
  RecordingManifest manifest = manifest_of(options);
  const RecordedKernel measured{.route = "bpf",
                                .buffer_size = 0,
                                .streams = 2,
                                .events = 30,
                                .lost_events = 4,
                                .untold_switches = 5};
  note_kernel(measured, manifest);
  EXPECT_TRUE(manifest.has_kernel_events);
  RecordedKernel expected = measured;
  expected.buffer_size = 4096;
  EXPECT_EQ(manifest.kernel, expected);
}

// A chunk that could not be begun may be where its events would be.
TEST(NothingRecorded, IsNotSaidOfAnApplicationWhoseEventsCouldNotBeWritten) {
  Options options;
  options.command = {"./app"};
  const auto problems = [&options](std::vector<std::string> before, bool is_anybody) {
    RecordingManifest manifest;
    manifest.problems = std::move(before);
    note_nothing_recorded(options, is_anybody, manifest);
    return manifest.problems;
  };
  ASSERT_EQ(problems({}, true).size(), 1U);
  EXPECT_NE(problems({}, true)[0].find("emitted no event of cie:*"), std::string::npos);
  EXPECT_EQ(problems({"cannot begin a chunk"}, true).size(), 1U);
  EXPECT_EQ(problems({"the disk was full"}, false).size(), 2U) << "nobody registered all the same";
}

TEST(Manifest, KeepsWhatIsWrongWithTheKernelsPartApart) {
  RecordingManifest manifest;
  manifest.kernel.problems = {"its clock is not known"};
  note_kernel({.route = "bpf", .events = 1}, manifest);
  const auto read = parse_recording_manifest(to_json(manifest));
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->problems.empty());
  EXPECT_EQ(read->kernel.problems, manifest.kernel.problems);
  EXPECT_EQ(all_problems(*read), manifest.kernel.problems);
}

TEST(DirectoryClaim, IsInPlaceUntilTheDirectoryIsRenamedOrRemoved) {
  const test::TemporaryDirectory around;
  const auto directory = around.path() / "run1";
  DirectoryClaim claim(directory);
  EXPECT_TRUE(claim.is_in_place());
  fs::rename(directory, around.path() / "run2");
  EXPECT_FALSE(claim.is_in_place());
  fs::create_directory(directory);
  EXPECT_FALSE(claim.is_in_place()) << "another one of its name";
  write_file(directory / kRecordingClaimName, "");
  claim.release();
  EXPECT_TRUE(fs::exists(directory / kRecordingClaimName)) << "another recorder's";
}

}  // namespace
}  // namespace cie::record
