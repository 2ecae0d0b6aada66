#include <cie/analysis/analyzer.hpp>

#include "support/temporary_directory.hpp"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include <ctf/native_reader.hpp>
#include <vocabulary/ros2/event_translator.hpp>

namespace {

using namespace cie::analysis;
namespace fs = std::filesystem;

// No disk, where there is such a thing.
fs::path in_memory() {
  const fs::path memory = "/dev/shm";
  std::error_code ignored;
  return fs::is_directory(memory, ignored) ? memory : fs::temp_directory_path();
}

void write(const fs::path& file, std::string_view bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// What must hold of any trace: streams begin and end once, packets alternate, and time never runs
// backwards in a stream without a word.
class Checker {
 public:
  void consume(const Event& event) {
    if (event.head.is_derived && !event.head.stands_for_cause) return;
    const auto index = static_cast<std::uint32_t>(event.head.stream);
    if (std::holds_alternative<StreamBegin>(event.body)) {
      if (!streams_.try_emplace(index).second) std::abort();
      return;
    }
    auto& stream = streams_.at(index);
    if (stream.has_ended) std::abort();
    if (std::holds_alternative<StreamEnd>(event.body)) {
      if (stream.is_in_packet) std::abort();
      stream.has_ended = true;
    } else if (std::holds_alternative<TimeRegression>(event.body)) {
      if (!stream.last || event.head.time >= *stream.last) std::abort();
      stream.last.reset();
    } else if (std::holds_alternative<PacketBegin>(event.body)) {
      if (stream.is_in_packet) std::abort();
      stream.is_in_packet = true;
      note(stream, event.head.time);
    } else if (std::holds_alternative<PacketEnd>(event.body)) {
      if (!stream.is_in_packet) std::abort();
      stream.is_in_packet = false;
      // An end before the last event (some tracers write that) moves nothing.
      if (!stream.last || *stream.last < event.head.time) stream.last = event.head.time;
    } else if (!std::holds_alternative<Discarded>(event.body) &&
               !std::holds_alternative<DamagedPacket>(event.body)) {
      if (!stream.is_in_packet) std::abort();
      note(stream, event.head.time);
    }
  }
  void finish() const {
    for (const auto& [index, stream] : streams_) {
      if (!stream.has_ended) std::abort();
    }
  }

 private:
  struct Stream {
    bool has_ended = false;
    bool is_in_packet = false;
    std::optional<Timestamp> last;
  };
  static void note(Stream& stream, Timestamp time) {
    if (stream.last && time < *stream.last) std::abort();
    stream.last = time;
  }
  std::map<std::uint32_t, Stream> streams_;
};

}  // namespace

// Two bytes: length of the metadata; one byte: how many 256ths of the rest are the first stream's.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const cie::test::TemporaryDirectory folder(in_memory());
  constexpr std::size_t kHead = 3;
  if (size < kHead) return 0;
  std::string_view rest(reinterpret_cast<const char*>(data + kHead), size - kHead);
  const std::size_t wanted = data[0] + std::size_t{256} * data[1];
  const auto metadata = rest.substr(0, wanted);
  rest.remove_prefix(metadata.size());
  const auto first = rest.substr(0, rest.size() * (data[2] + std::size_t{1}) / 256);
  write(folder.path() / "metadata", metadata);
  write(folder.path() / "a", first);
  write(folder.path() / "b", rest.substr(first.size()));
  try {
    Checker checker;
    Analyzer analyzer{AnalysisOptions{}};
    const fs::path paths[]{folder.path()};
    EventTranslator translator;
    const auto consume = [&](const Event& event) {
      checker.consume(event);
      analyzer.consume(event);
    };
    ctf::read_traces(paths, consume, {.translator = &translator});
    checker.finish();
    analyzer.finish();
  } catch (const UnreadableTrace&) {  // the other answer
  }
  return 0;
}
