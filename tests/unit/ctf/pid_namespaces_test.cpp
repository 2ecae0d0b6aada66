// Containers give the same pids: the context pid_ns tells their processes apart.
#include "vocabulary/pid_namespaces.hpp"

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/recorded_events.hpp>

#include "ctf_trace.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

using namespace analysis;

std::int64_t told(PidNamespaces& namespaces, std::uint64_t inode, std::int64_t pid) {
  EventHead head{.time = {}, .stream = {}, .cpu = {}, .pid = pid, .tid = {}};
  namespaces.tell_apart(inode, head);
  return *head.pid;
}

TEST(PidNamespaces, APidOfOneIsWhatItIs) {
  PidNamespaces namespaces;
  EXPECT_EQ(told(namespaces, 10, 7), 7);
  EXPECT_EQ(told(namespaces, 11, 8), 8) << "nobody else has it";
  EXPECT_EQ(told(namespaces, 0, 7), 7) << "a namespace that the tracer could not tell";
}

TEST(PidNamespaces, APidOfSeveralIsToldApart) {
  PidNamespaces namespaces;
  std::map<std::int64_t, std::uint64_t> namespace_of;
  constexpr std::uint64_t kMany = kMostNamespaces + 1;
  for (int round = 0; round < 2; ++round) {
    for (std::uint64_t inode = 1; inode <= kMany; ++inode) {
      const auto pid = told(namespaces, inode, 4'194'303);
      EXPECT_EQ(plain_pid(pid), 4'194'303);
      EXPECT_EQ(namespace_of.emplace(pid, inode).first->second, inode);
    }
  }
  EXPECT_EQ(namespace_of.size(), kMany);
  EXPECT_EQ(told(namespaces, kMany + 1, 4'194'303), 4'194'303) << "one too many";
}

std::string little(std::uint64_t value, unsigned bytes) {
  std::string text;
  for (unsigned i = 0; i < bytes; ++i)
    text += static_cast<char>(value >> 8 * i & 0xff);
  return text;
}

// Two containers: their processes have one pid, one tid and one layout. Each has a timer that runs three
// times, for 2 ms, while the other one's does.
class Containers {
 public:
  explicit Containers(bool tells_namespace) : tells_namespace_(tells_namespace) {}

  void write_to(const TraceFolder& folder) {
    for (const std::uint64_t which : {0U, 1U}) {
      const auto name = which == 0 ? "a" : "b";
      add(which, 0, 0, little(0x10, 8) + "8.2.3" + '\0');
      add(which, 1, 1, little(0x20, 8) + name + '\0' + "/" + '\0');
      add(which, 2, 2, little(0x30, 8) + little(10'000'000, 8));
      add(which, 3, 3, little(0x30, 8) + little(0x40, 8));
      add(which, 4, 4, little(0x30, 8) + little(0x20, 8));
      for (std::uint64_t run = 1; run <= 3; ++run) {
        add(which, run * 10'000'000, 5, little(0x40, 8));
        add(which, run * 10'000'000 + 2'000'000, 6, little(0x40, 8));
      }
    }
    folder.write("metadata", metadata());
    for (const std::uint64_t which : {0U, 1U}) {
      const auto& events = events_[which];
      const auto size = (4 + 4 + 4 * 8 + 4 + events.size()) * 8;
      folder.write("stream_" + std::to_string(which),
                   little(0xC1FC1FC1, 4) + little(0, 4) + little(0, 8) + little(50'000'000, 8) +
                       little(size, 8) + little(size, 8) + little(which, 4) + events);
    }
  }

 private:
  // The second one's are 1 ms later, and on another CPU.
  void add(std::uint64_t which, std::uint64_t time, std::uint64_t id, const std::string& fields) {
    auto& events = events_[which];
    events +=
        little(id, 1) + little(1000 + time + which * 1'000'000, 8) + little(7, 4) + little(8, 4);
    if (tells_namespace_) events += little(4'026'531'836 + which, 4);
    std::string name = which == 0 ? "talker_app" : "camera_app";
    name.resize(17);
    events += name + fields;
  }

  std::string metadata() const {
    return "typealias integer { size = 8; } := u8; typealias integer { size = 32; } := u32;\n"
           "typealias integer { size = 64; } := u64;\n"
           "typealias integer { size = 32; signed = true; } := i32;\n"
           "trace { major = 1; minor = 8; byte_order = le;\n"
           " packet.header := struct { u32 magic; u32 stream_id; }; };\n"
           "env { hostname = robot; domain = ust; tracer_name = \"lttng-ust\"; };\n"
           "clock { name = c; freq = 1000000000; offset = 1700000000000000000; };\n"
           "typealias integer { size = 64; map = clock.c.value; } := time_t;\n"
           "stream { id = 0; packet.context := struct { time_t timestamp_begin; time_t "
           "timestamp_end;\n"
           " u64 content_size; u64 packet_size; u32 cpu_id; };\n"
           " event.header := struct { u8 id; time_t timestamp; };\n"
           " event.context := struct { i32 vpid; i32 vtid; " +
           std::string(tells_namespace_ ? "u32 pid_ns; " : "") +
           "integer { size = 8; encoding = UTF8; } procname[17]; }; };\n" +
           event(0, "rcl_init", "u64 context_handle; string version;") +
           event(1, "rcl_node_init", "u64 node_handle; string node_name; string namespace;") +
           event(2, "rcl_timer_init", "u64 timer_handle; u64 period;") +
           event(3, "rclcpp_timer_callback_added", "u64 timer_handle; u64 callback;") +
           event(4, "rclcpp_timer_link_node", "u64 timer_handle; u64 node_handle;") +
           event(5, "callback_start", "u64 callback;") + event(6, "callback_end", "u64 callback;");
  }
  static std::string event(int id, const std::string& name, const std::string& fields) {
    return "event { name = \"ros2:" + name + "\"; id = " + std::to_string(id) +
           "; stream_id = 0; fields := struct { " + fields + " }; };\n";
  }

  bool tells_namespace_;
  std::map<std::uint64_t, std::string> events_;
};

TEST(PidNamespaces, TellContainersApart) {
  const TraceFolder folder;
  Containers(true).write_to(folder);
  const std::vector<std::filesystem::path> traces{folder.path()};
  const auto report = analyze(traces, {}).report;
  ASSERT_EQ(report.callbacks.size(), 2U);
  for (const auto& callback : report.callbacks) {
    EXPECT_EQ(callback.instances, 3U) << callback.logical_id;
    ASSERT_TRUE(callback.duration) << callback.logical_id;
    EXPECT_EQ(callback.duration->min, 2'000'000);
    EXPECT_EQ(callback.duration->max, 2'000'000);
  }
  ASSERT_EQ(report.processes.size(), 2U);
  for (const auto& process : report.processes)
    EXPECT_EQ(process.pid, 7);
  for (const auto& defect : report.defects)
    EXPECT_NE(defect.kind, DefectKind::shared_pid);
  read_recorded_events(traces, {.wants = [](std::string_view) { return true; }},
                       [](const RecordedEvent& event) { EXPECT_EQ(event.pid, 7); });
}

TEST(PidNamespaces, WithoutThemNoDurationsAreMadeUp) {
  const TraceFolder folder;
  Containers(false).write_to(folder);
  const std::vector<std::filesystem::path> traces{folder.path()};
  const auto report = analyze(traces, {}).report;
  for (const auto& callback : report.callbacks) {
    EXPECT_FALSE(callback.duration) << callback.logical_id;
    EXPECT_FALSE(callback.isolation) << callback.logical_id;
  }
  const auto shared = std::ranges::find(report.defects, DefectKind::shared_pid, &TraceDefect::kind);
  ASSERT_NE(shared, report.defects.end());
  EXPECT_THAT(shared->advice, testing::HasSubstr("pid_ns"));
}

}  // namespace
}  // namespace cie::test
