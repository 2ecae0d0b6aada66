// Small CTF traces written byte by byte, and what the reader makes of them as lines of text.
#pragma once

#include <cie/analysis/time.hpp>

#include "support/temporary_directory.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace cie::test {

// An event "tick" of one byte.
struct Tick {
  std::uint64_t time = 0;
  std::uint8_t value = 0;
};

struct PacketText {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
  std::vector<Tick> ticks{};
  std::uint64_t sequence = 0;
  std::uint32_t discarded = 0;
  std::uint32_t cpu = 0;
  std::uint64_t instance = 0;
  std::uint8_t uuid = 1;  // its sixteen bytes are this one
  std::size_t padding = 0;
  std::string tail{};  // content after the events
};

// Little endian: magic, uuid, stream_id; begin, end, content and packet size, sequence, discarded,
// cpu; events of a header with u8 id and u32 time and a payload of u8.
std::string bytes_of(const PacketText& packet);
std::string bytes_of(const std::vector<PacketText>& packets);
// `uuid`: as in PacketText.
std::string metadata(std::uint8_t uuid = 1, const std::string& clock = "");

// A directory of its own, removed at the end.
class TraceFolder {
 public:
  const std::filesystem::path& path() const { return directory_.path(); }
  void write(const std::string& file, const std::string& bytes) const;
  // A hole up to that size.
  void grow(const std::string& file, std::uint64_t size) const;
  void append(const std::string& file, const std::string& bytes) const;

 private:
  TemporaryDirectory directory_;
};

// One line per event, without the begins and ends of streams and packets: "100 tick 1" by its CPU,
// "200 lost 3 events until 300", "damaged: reason" and so on.
std::vector<std::string> read(const std::vector<std::filesystem::path>& traces);
std::vector<std::string> read(const TraceFolder& folder);
// Of packets outside the window nothing but that they are there is read.
std::vector<std::string> read(const TraceFolder& folder, const analysis::TimeWindow& window);
// Events of no vocabulary are only counted.
std::vector<std::string> read_counting(const TraceFolder& folder);
// Everything, structure included, with the number of the stream first.
std::vector<std::string> read_all(const TraceFolder& folder);
// The same by a reader on another thread.
std::vector<std::string> read_all_ahead(const TraceFolder& folder);

}  // namespace cie::test
