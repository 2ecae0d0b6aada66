// Writes an MCAP file (https://mcap.dev/spec) as messages come: chunks with their indexes, and a
// summary that lets readers seek. Nothing is compressed.
#pragma once

#include <cstdint>
#include <map>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

// Memory: one chunk, its index, and some bytes for each chunk and channel. Not thread-safe.
class McapWriter {
 public:
  // Begins the file on `out` (borrowed). Chunks end when they reach `chunk_bytes`.
  McapWriter(std::ostream& out, std::string_view library, std::size_t chunk_bytes = 1U << 20U);

  // Before the first message of its channels. Ids count from 1.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);
  // Ids count from 0. There are at most kMostChannels.
  std::uint16_t add_channel(std::uint16_t schema, std::string_view topic,
                            std::string_view message_encoding);
  static constexpr std::size_t kMostChannels = 65535;
  std::size_t channels() const noexcept { return channels_.size(); }
  // Times are nanoseconds of one clock.
  void add_message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time,
                   std::uint64_t publish_time, std::string_view data);
  // Ends the file. Once, and nothing after it.
  void finish();

 private:
  struct IndexEntry {
    std::uint64_t time = 0;
    std::uint64_t offset = 0;  // in the chunk's records
  };
  struct ChunkIndex {
    std::uint64_t first_time = 0;
    std::uint64_t last_time = 0;
    std::uint64_t offset = 0;  // of its record in the file
    std::uint64_t length = 0;
    std::map<std::uint16_t, std::uint64_t> message_indexes;  // of each channel: offset in the file
    std::uint64_t message_indexes_length = 0;
    std::uint64_t size = 0;
  };

  void write(std::string_view bytes);
  void write_data(std::string_view bytes);  // what data_crc_ covers
  void end_chunk();
  std::string chunk_index_records() const;
  std::string statistics_record() const;

  std::ostream& out_;
  std::size_t chunk_bytes_;
  std::uint64_t position_ = 0;
  std::uint32_t data_crc_ = 0;
  std::vector<std::string> schemas_;           // records
  std::vector<std::string> channels_;          // likewise
  std::vector<std::uint64_t> message_counts_;  // by channel
  std::string chunk_;                          // records
  std::uint64_t first_time_ = 0;               // of the chunk, if it has messages
  std::uint64_t last_time_ = 0;
  std::map<std::uint16_t, std::vector<IndexEntry>> entries_;  // of the chunk
  std::vector<ChunkIndex> chunks_;
};

}  // namespace cie::viewer_export
