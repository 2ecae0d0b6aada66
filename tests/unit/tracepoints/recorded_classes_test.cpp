// What the recorder writes of the kernel's events, its reader uses: each class, each field that it asks for.
#include <cie/analysis/event.hpp>

#include "kernel/ctf_stream.hpp"
#include "kernel/kernel_events.hpp"
#include "support/temporary_directory.hpp"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include <ctf/native_reader.hpp>
#include <gtest/gtest.h>
#include <vocabulary/vocabulary.hpp>

namespace cie::record {
namespace {

namespace fs = std::filesystem;

template <typename Integer>
void put(std::string& out, Integer value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

// An event of the class, of zeros.
std::string event_of(std::size_t id, std::uint64_t time) {
  std::string event;
  put(event, static_cast<std::uint16_t>(id));
  put(event, time);
  event.resize(recorded_size(kernel_event_classes()[id]), '\0');
  return event;
}

TEST(RecordedKernelEvents, AreOfAClassThatTheReaderKnows) {
  const auto& classes = kernel_event_classes();
  const test::TemporaryDirectory directory;
  const fs::path root = directory.path();
  const auto uuid = random_uuid();
  std::ofstream(root / "metadata") << kernel_metadata(
      uuid, {.uuid = "5a17c0de-0b07-4b1d-9abc-0123456789ab", .offset_ns = 0}, "bpf");
  const Directory opened = Directory::open(root);
  CtfStream stream(opened, uuid, 0, 0);
  for (std::size_t id = 0; id < classes.size(); ++id)
    stream.add(id + 1, event_of(id, id + 1));
  stream.finish(classes.size() + 1, 0);

  std::vector<std::uint64_t> understood;
  const std::vector<fs::path> traces{root};
  analysis::ctf::read_traces(traces, [&understood](const analysis::Event& event) {
    std::visit(
        [&]<typename Body>(const Body&) {
          constexpr bool is_of_kernel = Body::kCategory == analysis::EventCategory::system &&
                                        !std::is_same_v<Body, analysis::OtherEvent>;
          if constexpr (is_of_kernel)
            understood.push_back(static_cast<std::uint64_t>(event.head.time.ns));
        },
        event.body);
  });
  for (std::size_t id = 0; id < classes.size(); ++id)
    EXPECT_EQ(std::ranges::count(understood, id + 1), 1) << classes[id].name;
}

TEST(RecordedKernelEvents, HaveEachFieldThatTheReaderAsksFor) {
  for (const auto& recorded : kernel_event_classes()) {
    const auto* translation = analysis::find_translation(recorded.name);
    ASSERT_NE(translation, nullptr) << recorded.name;
    for (const auto& request : translation->fields) {
      const bool is_written =
          std::ranges::any_of(recorded.fields, [&request](const KernelField& field) {
            return request.alternative(field.name).has_value();
          });
      EXPECT_TRUE(is_written) << recorded.name << " without " << request.names;
    }
  }
}

}  // namespace
}  // namespace cie::record
