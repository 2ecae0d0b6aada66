// What the kernel's traces tell of priorities. Their scale is learned from the idle task: what came before
// does not know it yet.
#include "ctf_trace.hpp"

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <ctf/native_reader.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

constexpr const char* kMetadata = R"(/* CTF 1.8 */
typealias integer { size = 8; align = 8; signed = false; } := uint8_t;
typealias integer { size = 32; align = 8; signed = false; } := uint32_t;
typealias integer { size = 32; align = 8; signed = true; } := int32_t;
typealias integer { size = 64; align = 8; signed = false; } := uint64_t;
typealias integer { size = 64; align = 8; signed = true; } := int64_t;
trace { major = 1; minor = 8; byte_order = le; packet.header := struct { uint32_t magic; }; };
env { domain = "kernel"; };
stream { event.header := struct { uint8_t id; uint64_t timestamp; };
  packet.context := struct { uint64_t timestamp_begin; uint64_t timestamp_end;
    uint64_t content_size; uint64_t packet_size; }; };
event { name = "sched_waking"; id = 0; fields := struct { int32_t tid; int32_t prio; }; };
event { name = "sched_switch"; id = 1; fields := struct { int32_t prev_tid; int32_t prev_prio;
    int64_t prev_state; int32_t next_tid; int32_t next_prio; }; };
)";

class Bytes {
 public:
  template <typename T>
  Bytes& add(T value) {
    text_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

TEST(KernelOrder, PrioritiesHaveTheScaleKnownAtTheirTime) {
  Bytes events;
  const auto waking = [&events](std::uint64_t time) {
    events.add(std::uint8_t{0}).add(time).add(std::int32_t{7}).add(std::int32_t{10});
  };
  waking(100);
  events.add(std::uint8_t{1}).add(std::uint64_t{101});  // idle runs no more: its priority is 20
  events.add(std::int32_t{0}).add(std::int32_t{20}).add(std::int64_t{0});
  events.add(std::int32_t{7}).add(std::int32_t{10});
  for (std::uint64_t time = 102; time < 110; ++time)
    waking(time);
  constexpr std::uint64_t kHeader = 4 + 4 * 8;
  const std::uint64_t bits = (kHeader + events.text().size()) * 8;
  Bytes packet;
  packet.add(std::uint32_t{0xC1FC1FC1}).add(std::uint64_t{100}).add(std::uint64_t{200});
  packet.add(bits).add(bits);
  TraceFolder folder;
  folder.write("metadata", kMetadata);
  folder.write("stream", packet.text() + events.text());

  std::vector<std::int32_t> priorities;
  const std::vector<std::filesystem::path> paths{folder.path()};
  analysis::ctf::read_traces(paths, [&priorities](const analysis::Event& event) {
    if (const auto* woken = std::get_if<analysis::SchedWaking>(&event.body)) {
      priorities.push_back(woken->prio);
    }
  });
  // The kernel's own scale has idle at 120.
  EXPECT_THAT(priorities, testing::ElementsAre(10, 110, 110, 110, 110, 110, 110, 110, 110));
}

// What is told of a trace with these classes and no event.
std::optional<bool> told_of(const std::string& metadata,
                            std::optional<bool> analysis::StreamBegin::*what) {
  Bytes packet;
  constexpr std::uint64_t kBits = (4 + 4 * 8) * 8;
  packet.add(std::uint32_t{0xC1FC1FC1}).add(std::uint64_t{100}).add(std::uint64_t{200});
  packet.add(kBits).add(kBits);
  TraceFolder folder;
  folder.write("metadata", metadata);
  folder.write("stream", packet.text());
  std::optional<bool> told;
  const std::vector<std::filesystem::path> paths{folder.path()};
  analysis::ctf::read_traces(paths, [&told, what](const analysis::Event& event) {
    const auto* stream = std::get_if<analysis::StreamBegin>(&event.body);
    if (stream != nullptr) told = stream->*what;
  });
  return told;
}

std::optional<bool> tells_inheritance(const std::string& metadata) {
  return told_of(metadata, &analysis::StreamBegin::has_inheritance);
}

TEST(KernelClasses, TellWhetherInheritanceIsRecorded) {
  const std::string switches = kMetadata;
  EXPECT_EQ(tells_inheritance(switches), false);
  for (const std::string name : {"sched_pi_setprio", "sched:sched_pi_setprio"}) {
    const auto declared = "event { name = \"" + name +
                          "\"; id = 2; fields := struct { int32_t tid; int32_t oldprio; int32_t "
                          "newprio; }; };\n";
    EXPECT_EQ(tells_inheritance(switches + declared), true) << name;
  }
  auto others = switches;
  others.replace(others.find("sched_switch"), std::string("sched_switch").size(), "sys_entry");
  EXPECT_EQ(tells_inheritance(others), std::nullopt) << "of no switch";
}

TEST(Ros2Classes, TellWhetherClientsAndServicesAreRecorded) {
  std::string users = kMetadata;
  users.replace(users.find("kernel"), std::string("kernel").size(), "ust");
  const auto told = [&](const std::string& provider, const auto&... names) {
    auto metadata = users;
    int id = 2;
    const auto declare = [&](const std::string& name) {
      metadata += "event { name = \"" + provider + name + "\"; id = " + std::to_string(id++) +
                  "; fields := struct { uint64_t node_handle; }; };\n";
    };
    (declare(names), ...);
    return told_of(metadata, &analysis::StreamBegin::has_client_events);
  };
  EXPECT_EQ(told("ros2:", "rcl_client_init", "rcl_service_init"), true);
  EXPECT_EQ(told("ros2_caret:", "rcl_client_init", "rcl_service_init"), true);
  EXPECT_EQ(told("ros2:", "rcl_service_init"), false);
  EXPECT_EQ(told("ros2:", "rcl_client_init"), false) << "an action server shows by its services";
  EXPECT_EQ(told_of(kMetadata, &analysis::StreamBegin::has_client_events), std::nullopt)
      << "of the kernel's";
}

// An absent field is unknown, never 0.
TEST(KernelClasses, LackingANumberCountAsAbsent) {
  const std::string inherited =
      "event { name = \"sched_pi_setprio\"; id = 2; fields := struct { int32_t tid; int32_t "
      "oldprio; int32_t newprio; }; };\n";
  const auto without = [](std::string metadata, const std::string& field) {
    const auto declared = metadata.find(' ' + field + ';');
    return metadata.replace(declared + 1, field.size(), "other");
  };
  const auto whole = kMetadata + inherited;
  EXPECT_EQ(tells_inheritance(whole), true);
  EXPECT_EQ(tells_inheritance(kMetadata + without(inherited, "newprio")), false);
  for (const std::string field : {"prev_tid", "prev_prio", "prev_state", "next_tid", "next_prio"}) {
    EXPECT_EQ(tells_inheritance(without(whole, field)), std::nullopt) << field;
  }
}

}  // namespace
}  // namespace cie::test
