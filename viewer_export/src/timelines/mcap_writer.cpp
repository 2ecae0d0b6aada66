#include "mcap_writer.hpp"

#include <algorithm>
#include <concepts>

#include <zlib.h>

namespace cie::viewer_export {
namespace {

using namespace std::string_view_literals;

constexpr auto kMcapMagic = "\x89MCAP0\r\n"sv;

enum class Op : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0b,
  summary_offset = 0x0e,
  data_end = 0x0f
};

// The format's basic types: little-endian integers, and strings behind their length.
class Fields {
 public:
  template <std::unsigned_integral T>
  Fields& number(T value) {
    for (std::size_t i = 0; i < sizeof(T); ++i)
      bytes_ += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xffU);
    return *this;
  }
  Fields& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    bytes_ += value;
    return *this;
  }
  Fields& bytes(std::string_view value) {
    bytes_ += value;
    return *this;
  }
  // A map or array: its fields behind their length in bytes.
  Fields& group(const Fields& fields) { return text(fields.bytes_); }

  std::string record(Op op) const {
    Fields record;
    record.number(static_cast<std::uint8_t>(op));
    record.number(static_cast<std::uint64_t>(bytes_.size()));
    return record.bytes_ + bytes_;
  }
  const std::string& data() const noexcept { return bytes_; }

 private:
  std::string bytes_;
};

std::uint32_t crc_of(std::uint32_t crc, std::string_view bytes) {
  return static_cast<std::uint32_t>(
      ::crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string joined(const std::vector<std::string>& records) {
  std::string all;
  for (const auto& record : records)
    all += record;
  return all;
}

}  // namespace

McapWriter::McapWriter(std::ostream& out, std::string_view library, std::size_t chunk_bytes)
    : out_(out), chunk_bytes_(chunk_bytes) {
  write_data(kMcapMagic);
  write_data(Fields{}.text("").text(library).record(Op::header));
}

void McapWriter::write(std::string_view bytes) {
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  position_ += bytes.size();
}

void McapWriter::write_data(std::string_view bytes) {
  write(bytes);
  data_crc_ = crc_of(data_crc_, bytes);
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view encoding,
                                     std::string_view data) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  schemas_.push_back(Fields{}.number(id).text(name).text(encoding).text(data).record(Op::schema));
  chunk_ += schemas_.back();
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema, std::string_view topic,
                                      std::string_view message_encoding) {
  const auto id = static_cast<std::uint16_t>(channels_.size());
  channels_.push_back(Fields{}
                          .number(id)
                          .number(schema)
                          .text(topic)
                          .text(message_encoding)
                          .group({})
                          .record(Op::channel));
  message_counts_.push_back(0);
  chunk_ += channels_.back();
  return id;
}

void McapWriter::add_message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t log_time,
                             std::uint64_t publish_time, std::string_view data) {
  first_time_ = entries_.empty() ? log_time : std::min(first_time_, log_time);
  last_time_ = entries_.empty() ? log_time : std::max(last_time_, log_time);
  entries_[channel].push_back({log_time, chunk_.size()});
  ++message_counts_.at(channel);
  chunk_ += Fields{}
                .number(channel)
                .number(sequence)
                .number(log_time)
                .number(publish_time)
                .bytes(data)
                .record(Op::message);
  if (chunk_.size() >= chunk_bytes_) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.empty()) return;
  ChunkIndex index{.first_time = entries_.empty() ? 0 : first_time_,
                   .last_time = entries_.empty() ? 0 : last_time_,
                   .offset = position_,
                   .length = 0,
                   .message_indexes = {},
                   .message_indexes_length = 0,
                   .size = chunk_.size()};
  write_data(Fields{}
                 .number(index.first_time)
                 .number(index.last_time)
                 .number(index.size)
                 .number(crc_of(0, chunk_))
                 .text("")
                 .number(index.size)
                 .bytes(chunk_)
                 .record(Op::chunk));
  index.length = position_ - index.offset;
  const auto indexes_begin = position_;
  for (auto& [channel, entries] : entries_) {
    index.message_indexes[channel] = position_;
    std::ranges::stable_sort(entries, {}, &IndexEntry::time);
    Fields times;
    for (const auto& entry : entries)
      times.number(entry.time).number(entry.offset);
    write_data(Fields{}.number(channel).group(times).record(Op::message_index));
  }
  index.message_indexes_length = position_ - indexes_begin;
  chunks_.push_back(std::move(index));
  chunk_.clear();
  entries_.clear();
}

std::string McapWriter::chunk_index_records() const {
  std::string records;
  for (const auto& chunk : chunks_) {
    Fields offsets;
    for (const auto& [channel, offset] : chunk.message_indexes)
      offsets.number(channel).number(offset);
    records += Fields{}
                   .number(chunk.first_time)
                   .number(chunk.last_time)
                   .number(chunk.offset)
                   .number(chunk.length)
                   .group(offsets)
                   .number(chunk.message_indexes_length)
                   .text("")
                   .number(chunk.size)
                   .number(chunk.size)
                   .record(Op::chunk_index);
  }
  return records;
}

std::string McapWriter::statistics_record() const {
  std::uint64_t messages = 0;
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  bool has_first = false;
  Fields counts;
  for (std::size_t channel = 0; channel < message_counts_.size(); ++channel) {
    messages += message_counts_[channel];
    counts.number(static_cast<std::uint16_t>(channel)).number(message_counts_[channel]);
  }
  for (const auto& chunk : chunks_) {
    if (chunk.message_indexes.empty()) continue;
    first = has_first ? std::min(first, chunk.first_time) : chunk.first_time;
    last = std::max(last, chunk.last_time);
    has_first = true;
  }
  return Fields{}
      .number(messages)
      .number(static_cast<std::uint16_t>(schemas_.size()))
      .number(static_cast<std::uint32_t>(channels_.size()))
      .number(std::uint32_t{0})
      .number(std::uint32_t{0})
      .number(static_cast<std::uint32_t>(chunks_.size()))
      .number(first)
      .number(last)
      .group(counts)
      .record(Op::statistics);
}

void McapWriter::finish() {
  end_chunk();
  write(Fields{}.number(data_crc_).record(Op::data_end));
  struct Group {
    Op op{};
    std::string records;
  };
  const std::vector<Group> groups{{Op::schema, joined(schemas_)},
                                  {Op::channel, joined(channels_)},
                                  {Op::statistics, statistics_record()},
                                  {Op::chunk_index, chunk_index_records()}};
  const auto summary_start = position_;
  std::string summary;
  std::string offsets;
  for (const auto& group : groups) {
    if (group.records.empty()) continue;
    offsets += Fields{}
                   .number(static_cast<std::uint8_t>(group.op))
                   .number(summary_start + summary.size())
                   .number(static_cast<std::uint64_t>(group.records.size()))
                   .record(Op::summary_offset);
    summary += group.records;
  }
  // The checksum covers the summary and the footer up to itself.
  const auto offsets_start = summary_start + summary.size();
  const auto footer = Fields{}
                          .number(summary_start)
                          .number(offsets_start)
                          .number(std::uint32_t{0})
                          .record(Op::footer);
  const auto unchecked = std::string_view(footer).substr(0, footer.size() - sizeof(std::uint32_t));
  write(summary);
  write(offsets);
  write(unchecked);
  const auto crc = crc_of(crc_of(crc_of(0, summary), offsets), unchecked);
  write(Fields{}.number(crc).data());
  write(kMcapMagic);
}

}  // namespace cie::viewer_export
