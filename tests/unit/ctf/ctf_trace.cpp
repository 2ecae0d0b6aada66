#include "ctf_trace.hpp"

#include <cie/analysis/event.hpp>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <utility>

#include <ctf/native_reader.hpp>
#include <ctf/read_ahead.hpp>

namespace cie::test {
namespace {

namespace fs = std::filesystem;
using namespace analysis;

std::string integer(std::uint64_t value, unsigned bytes) {
  std::string text;
  for (unsigned i = 0; i < bytes; ++i)
    text += static_cast<char>(value >> 8 * i & 0xff);
  return text;
}

std::string line_of(const Event& event) {
  const auto at = std::to_string(event.head.time.ns) + " ";
  return std::visit(
      Overloaded{
          [](const StreamBegin& e) {
            return "stream of channel " + std::to_string(e.channel) +
                   (e.has_events == false ? ", idle" : "") + (e.is_left_out ? ", left out" : "");
          },
          [](const StreamEnd&) { return std::string("stream ends"); },
          [&](const PacketBegin&) { return at + "packet"; },
          [&](const PacketEnd&) { return at + "packet ends"; },
          [&](const Discarded& e) {
            return at + "lost " + (e.count ? std::to_string(*e.count) : "some") +
                   (e.packets ? " packets" : " events") + " until " + std::to_string(e.end.ns) +
                   (e.last_with_room ? ", after " + std::to_string(e.last_with_room->ns) : "");
          },
          [](const DamagedPacket& e) {
            // Without the machine's path: "… at byte 5: reason".
            const auto at_byte = e.reason.rfind(" at byte ");
            return (e.has_foreign_metadata ? "foreign" : "damaged") +
                   std::string(e.reason.substr(std::min(at_byte, e.reason.size())));
          },
          [&](const TimeRegression& e) { return at + "after " + std::to_string(e.previous.ns); },
          [&](const OtherEvent& e) {
            return at + (e.count > 1 ? std::to_string(e.count) + " others" : std::string(e.name)) +
                   " on " + (event.head.cpu ? std::to_string(*event.head.cpu) : "?");
          },
          [&](const auto&) { return at + "other"; }},
      event.body);
}

bool is_structure(const Event& event) {
  return std::holds_alternative<StreamBegin>(event.body) ||
         std::holds_alternative<StreamEnd>(event.body) ||
         std::holds_alternative<PacketBegin>(event.body) ||
         std::holds_alternative<PacketEnd>(event.body);
}

template <typename Read>
std::vector<std::string> all_lines(const TraceFolder& folder, Read read) {
  std::vector<std::string> lines;
  ctf::TraceReader reader(std::vector<fs::path>{folder.path()});
  read(reader, [&lines](const EventBatch& batch) {
    batch.each([&lines](const Event& event) {
      lines.push_back(std::to_string(static_cast<std::uint32_t>(event.head.stream)) + ": " +
                      line_of(event));
    });
  });
  return lines;
}

}  // namespace

std::string bytes_of(const PacketText& packet) {
  std::string events;
  for (const auto& tick : packet.ticks)
    events += integer(1, 1) + integer(tick.time, 4) + integer(tick.value, 1);
  events += packet.tail;
  constexpr std::size_t kHeader = 4 + 16 + 4 + 8 + 5 * 8 + 2 * 4;
  const auto content = kHeader + events.size();
  return integer(0xC1FC1FC1, 4) + std::string(16, static_cast<char>(packet.uuid)) + integer(0, 4) +
         integer(packet.instance, 8) + integer(packet.begin, 8) + integer(packet.end, 8) +
         integer(content * 8, 8) + integer((content + packet.padding) * 8, 8) +
         integer(packet.sequence, 8) + integer(packet.discarded, 4) + integer(packet.cpu, 4) +
         events + std::string(packet.padding, '\0');
}

std::string bytes_of(const std::vector<PacketText>& packets) {
  std::string bytes;
  for (const auto& packet : packets)
    bytes += bytes_of(packet);
  return bytes;
}

std::string metadata(std::uint8_t uuid, const std::string& clock) {
  const std::string pair = "0" + std::to_string(uuid);
  const auto pairs = [&pair](int count) {
    std::string text;
    for (int i = 0; i < count; ++i)
      text += pair;
    return text;
  };
  return "typealias integer { size = 8; } := u8;\n"
         "typealias integer { size = 32; } := u32;\n"
         "typealias integer { size = 64; } := u64;\n"
         "trace { major = 1; minor = 8; byte_order = le; uuid = \"" +
         pairs(4) + "-" + pairs(2) + "-" + pairs(2) + "-" + pairs(2) + "-" + pairs(6) +
         "\";\n packet.header := struct { u32 magic; u8 uuid[16]; u32 stream_id;"
         " u64 stream_instance_id; }; };\n"
         "clock { name = c; freq = 1000000000; " +
         clock +
         " };\n"
         "stream { id = 0;\n"
         " packet.context := struct { integer { size = 64; map = clock.c.value; } "
         "timestamp_begin;\n"
         "  integer { size = 64; map = clock.c.value; } timestamp_end;\n"
         "  u64 content_size; u64 packet_size; u64 packet_seq_num; u32 events_discarded;\n"
         "  u32 cpu_id; };\n"
         " event.header := struct { u8 id;\n"
         "  integer { size = 32; map = clock.c.value; } timestamp; }; };\n"
         "event { id = 1; stream_id = 0; name = \"tick\"; fields := struct { u8 value; }; };\n"
         "event { id = 2; stream_id = 0; name = \"text\"; fields := struct { string s; }; };\n";
}

void TraceFolder::grow(const std::string& file, std::uint64_t size) const {
  fs::resize_file(path() / file, size);
}

void TraceFolder::append(const std::string& file, const std::string& bytes) const {
  std::ofstream(path() / file, std::ios::binary | std::ios::app) << bytes;
}

void TraceFolder::write(const std::string& file, const std::string& bytes) const {
  fs::create_directories((path() / file).parent_path());
  std::ofstream(path() / file, std::ios::binary | std::ios::trunc) << bytes;
}

std::vector<std::string> read(const std::vector<fs::path>& traces,
                              const ctf::ReadOptions& options) {
  std::vector<std::string> lines;
  ctf::read_traces(
      traces,
      [&lines](const Event& event) {
        if (!is_structure(event)) lines.push_back(line_of(event));
      },
      options);
  return lines;
}

std::vector<std::string> read(const std::vector<fs::path>& traces) {
  return read(traces, ctf::ReadOptions{});
}

std::vector<std::string> read(const TraceFolder& folder) {
  return read(std::vector<fs::path>{folder.path()});
}

std::vector<std::string> read(const TraceFolder& folder, const TimeWindow& window) {
  return read({folder.path()}, ctf::ReadOptions{.window = window});
}

std::vector<std::string> read_counting(const TraceFolder& folder) {
  return read({folder.path()}, ctf::ReadOptions{.counts_others = true});
}

std::vector<std::string> read_all(const TraceFolder& folder) {
  return all_lines(folder,
                   [](ctf::TraceReader& reader, const ctf::BatchSink& sink) { reader.read(sink); });
}

std::vector<std::string> read_all_ahead(const TraceFolder& folder) {
  return all_lines(folder, ctf::read_ahead);
}

}  // namespace cie::test
