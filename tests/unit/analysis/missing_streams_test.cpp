// Stream files that LTTng wrote and that are not there: its trace's directory shows it.
#include "recording/missing_streams.hpp"

#include <cie/analysis/recording.hpp>
#include <cie/tracepoints/recording_layout.hpp>

#include "support/temporary_directory.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr auto kUst = R"(env { domain = "ust"; tracer_name = "lttng-ust"; };)";

// As LTTng writes one without events.
std::string packet_of_cpu(std::uint32_t cpu, std::uint32_t stream = 0) {
  constexpr auto kBits = kEmptyPacketBytes * 8;
  const PacketHeader header{.magic = kPacketMagic,
                            .trace_uuid = {},
                            .stream_id = stream,
                            .stream_instance_id = cpu,
                            .begin = 10,
                            .end = 20,
                            .content_bits = kBits,
                            .packet_bits = kBits,
                            .number = 0,
                            .discarded_events = 0};
  std::string bytes(kEmptyPacketBytes, '\0');
  std::memcpy(bytes.data(), &header, sizeof header);
  std::memcpy(bytes.data() + sizeof header, &cpu, sizeof cpu);
  return bytes;
}

// A trace's directory with empty files, and one that holds a packet of CPU 0; `state_0` holds one, too.
class Trace {
 public:
  explicit Trace(const std::vector<std::string>& files, std::string_view metadata = kUst,
                 std::string_view of_cpu_0 = "z_0") {
    std::filesystem::create_directories(path() / "index");
    std::ofstream(path() / "metadata") << metadata;
    std::ofstream(path() / of_cpu_0) << packet_of_cpu(0);
    for (const auto& file : files) {
      std::ofstream(path() / file) << (file == "state_0" ? packet_of_cpu(0, 1) : "");
    }
  }
  std::filesystem::path path() const { return directory_.path() / "ust"; }
  std::vector<std::string> missing() const { return missing_streams(std::array{path()}).front(); }
  const TemporaryDirectory& around() const { return directory_; }

 private:
  TemporaryDirectory directory_;
};

TEST(MissingStreams, AreOfCpusBetweenOthers) {
  std::vector<std::string> all;
  for (int cpu = 1; cpu <= 11; ++cpu)
    all.push_back("ros2_" + std::to_string(cpu));
  const auto missing = [](const std::vector<std::string>& files) {
    return Trace(files, kUst, "ros2_0").missing();
  };
  EXPECT_THAT(missing(all), IsEmpty());
  all.erase(all.begin() + 4);
  EXPECT_THAT(missing(all), ElementsAre(HasSubstr("ros2_5 is missing, and ros2_11 is here")));
}

TEST(MissingStreams, AreOfCpusThatAnotherChannelHas) {
  EXPECT_THAT(Trace({"state_0", "state_1"}, kUst, "events_0").missing(),
              ElementsAre(HasSubstr("events_1 is missing, and state_1 is here")));
}

TEST(MissingStreams, AreThoseThatHaveAnIndex) {
  EXPECT_THAT(Trace({"index/z_0.idx", "index/z_1.idx"}).missing(),
              ElementsAre(HasSubstr("z_1 is missing, and its index is here")));
  EXPECT_THAT(Trace({"z_2", "index/z_1.idx"}).missing(),
              ElementsAre(HasSubstr("z_1 is missing, and z_2 is here")));
}

// As `lttng enable-channel --tracefile-size` has it.
TEST(MissingStreams, MayHaveHadSeveralFiles) {
  const auto missing = [](const std::vector<std::string>& files) {
    return Trace(files, kUst, "ros2_0_1").missing();
  };
  EXPECT_THAT(missing({"ros2_0_0", "ros2_0_2", "ros2_1_0"}), IsEmpty());
  EXPECT_THAT(missing({"ros2_0_0", "ros2_0_2", "ros2_2_0"}),
              ElementsAre(HasSubstr("ros2_1 is missing")));
  EXPECT_THAT(Trace({"front_2_1"}, kUst, "front_2_0").missing(), IsEmpty())
      << "the channel is front_2";
}

TEST(MissingStreams, AreKnownOfOneTracerAlone) {
  constexpr auto kKernel = R"(env { domain = "kernel"; tracer_name = "lttng-modules"; };)";
  EXPECT_THAT(Trace({"z_2"}, kKernel).missing(), IsEmpty()) << "a CPU that was offline has none";
  EXPECT_THAT(Trace({"z_2"}, "").missing(), IsEmpty());
}

TEST(MissingStreams, AreNotKnownBehindOtherNames) {
  EXPECT_THAT(Trace({"z_1", "index/z_3.idx"}, kUst, "z_9").missing(), IsEmpty());
  EXPECT_THAT(Trace({"z_1", "z_3"}, kUst, "first").missing(), IsEmpty());
  EXPECT_THAT(Trace({"z", "z_", "_4", "z_99999999999", "z_8192"}).missing(), IsEmpty());
  EXPECT_THAT(Trace({"z_1", "notes_2026"}).missing(), IsEmpty()) << "no packet is in it";
  const Trace copied({"z_1"});
  std::filesystem::copy_file(copied.path() / "z_0", copied.path() / "old_z_0");
  EXPECT_THAT(copied.missing(), IsEmpty()) << "a class of streams has one channel";
}

// As one part of a recording was copied here, and the other there.
TEST(MissingStreams, AreNotThoseInAnotherDirectory) {
  const Trace first({"index/state_0.idx"});
  const Trace other({"index/z_0.idx"}, kUst, "state_0");
  ASSERT_THAT(first.missing(), ElementsAre(HasSubstr("state_0 is missing")));
  EXPECT_THAT(missing_streams(std::array{first.path(), other.path()}),
              ElementsAre(IsEmpty(), IsEmpty()));
  const Trace chunk({"state_0"});
  EXPECT_THAT(missing_streams(std::array{first.path(), chunk.path()}),
              ElementsAre(ElementsAre(HasSubstr("state_0 is missing")), IsEmpty()))
      << "each chunk has all of its files";
}

TEST(MissingStreams, AreFoundWhereNoManifestNamesTheFiles) {
  const Trace trace({"z_2"});
  const auto found = [&trace] { return find_recordings(std::array{trace.around().path()}, false); };
  ASSERT_EQ(found().size(), 1U);
  EXPECT_EQ(found()[0].name, trace.path().string());
  EXPECT_FALSE(found()[0].manifest);
  ASSERT_EQ(found()[0].doubts.size(), 1U);
  EXPECT_EQ(found()[0].doubts[0].kind, FileDoubtKind::missing_file);
  EXPECT_TRUE(found()[0].doubts[0].costs_user_events);

  std::ofstream(trace.around().path() / kManifestName) << to_json(RecordingManifest{});
  ASSERT_EQ(found().size(), 1U);
  EXPECT_EQ(found()[0].name, trace.around().path().string());
}

}  // namespace
}  // namespace cie::test
