// Parquet's file format: https://github.com/apache/parquet-format (parquet.thrift, Encodings.md).
// Row groups of bounded size; every column optional, in one data page per group, Snappy. Text is
// numbered by a dictionary for each group, all else plain.
#include <cie/tracepoints/utf8.hpp>
#include <cie/viewer_export/version.hpp>

#include "output/binary_numbers.hpp"
#include "table.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>
#include <string>
#include <unordered_map>

#include <snappy.h>

namespace cie::viewer_export {
namespace {

// --- Thrift's compact protocol: https://github.com/apache/thrift/blob/master/doc/specs -----------

class Thrift {
 public:
  enum class Type : std::uint8_t {
    boolean_true = 1,
    i32 = 5,
    i64 = 6,
    binary = 8,
    list = 9,
    structure = 12
  };

  void i32(int field, std::int32_t value) { number(field, Type::i32, value); }
  void i64(int field, std::int64_t value) { number(field, Type::i64, value); }
  void binary(int field, std::string_view value) {
    header(field, Type::binary);
    text(value);
  }
  void begin_list(int field, Type of, std::size_t count) {
    header(field, Type::list);
    if (count < 15) {
      byte(static_cast<unsigned>(count) << 4U | static_cast<unsigned>(of));
    } else {
      byte(0xF0U | static_cast<unsigned>(of));
      varint(count);
    }
  }
  void element_i32(std::int32_t value) { varint(zigzag(value)); }
  void element_binary(std::string_view value) { text(value); }
  void begin_structure(int field) {
    header(field, Type::structure);
    begin_element();
  }
  void begin_element() { last_fields_.push_back(0); }
  void end_structure() {
    byte(0);
    last_fields_.pop_back();
  }

  const std::string& bytes() const noexcept { return bytes_; }

 private:
  void byte(unsigned value) { bytes_ += static_cast<char>(value); }
  void varint(std::uint64_t value) { append_varint(bytes_, value); }
  void text(std::string_view value) {
    varint(value.size());
    bytes_ += value;
  }
  // Fields come in ascending order, less than sixteen apart.
  void header(int field, Type type) {
    const int step = field - last_fields_.back();
    last_fields_.back() = field;
    byte(static_cast<unsigned>(step) << 4U | static_cast<unsigned>(type));
  }
  void number(int field, Type type, std::int64_t value) {
    header(field, type);
    varint(zigzag(value));
  }

  std::string bytes_;
  std::vector<int> last_fields_{0};
};

// --- parquet.thrift's numbers --------------------------------------------------------------------

enum PhysicalType : std::int32_t { kBoolean = 0, kInt64 = 2, kDouble = 5, kByteArray = 6 };
constexpr std::int32_t kOptional = 1;
constexpr std::int32_t kUtf8 = 0;
constexpr std::int32_t kPlain = 0;
constexpr std::int32_t kRle = 3;
constexpr std::int32_t kRleDictionary = 8;
constexpr std::int32_t kSnappy = 1;
constexpr std::int32_t kDataPage = 0;
constexpr std::int32_t kDictionaryPage = 2;
constexpr std::size_t kRowsPerGroup = 100'000;
constexpr std::string_view kParquetMagic = "PAR1";

PhysicalType physical(ColumnType type) {
  switch (type) {
    case ColumnType::integer:
      return kInt64;
    case ColumnType::real:
      return kDouble;
    case ColumnType::boolean:
      return kBoolean;
    case ColumnType::text:
      break;
  }
  return kByteArray;
}

// Bits, eight to a byte, the first one lowest.
class Bits {
 public:
  void add(bool bit) {
    if (count_ % 8 == 0) bytes_ += '\0';
    if (bit) {
      bytes_.back() =
          static_cast<char>(static_cast<unsigned char>(bytes_.back()) | 1U << count_ % 8);
    }
    ++count_;
  }
  const std::string& bytes() const noexcept { return bytes_; }
  void clear() {
    bytes_.clear();
    count_ = 0;
  }

 private:
  std::string bytes_;
  std::size_t count_ = 0;
};

// Text as numbers of a dictionary.
class Dictionary {
 public:
  void add(std::string_view text) {
    // Rows that follow one another often have the same text.
    if (last_ == nullptr || *last_ != text) {
      const auto [at, is_new] =
          numbers_.try_emplace(std::string(text), static_cast<std::uint32_t>(numbers_.size()));
      if (is_new) {
        const std::string valid = valid_utf8(text);
        append_little_endian(values_, static_cast<std::uint32_t>(valid.size()));
        values_ += valid;
      }
      last_ = &at->first;
      last_number_ = at->second;
    }
    indices_.push_back(last_number_);
  }

  std::int32_t size() const noexcept { return static_cast<std::int32_t>(numbers_.size()); }
  // The page of values, plain.
  const std::string& values() const noexcept { return values_; }
  // The numbers: their width in bits, and one bit-packed run.
  std::string packed() const {
    const auto width = std::max(1U, static_cast<unsigned>(std::bit_width(numbers_.size() - 1)));
    std::string out(1, static_cast<char>(width));
    const auto groups = (indices_.size() + 7) / 8;
    append_varint(out, groups << 1U | 1U);
    const auto begin = out.size();
    out.resize(begin + groups * width);
    std::uint64_t bits = 0;  // that are not written yet, the first one lowest
    unsigned count = 0;
    std::size_t at = begin;
    for (const auto index : indices_) {
      bits |= std::uint64_t{index} << count;
      for (count += width; count >= 8; count -= 8, bits >>= 8U)
        out[at++] = static_cast<char>(bits & 0xffU);
    }
    if (count > 0) out[at] = static_cast<char>(bits & 0xffU);
    return out;
  }
  void clear() {
    numbers_.clear();
    values_.clear();
    indices_.clear();
    last_ = nullptr;
  }

 private:
  std::unordered_map<std::string, std::uint32_t> numbers_;
  std::string values_;
  std::vector<std::uint32_t> indices_;
  const std::string* last_ = nullptr;  // a key of numbers_
  std::uint32_t last_number_ = 0;
};

// The values of one column and one row group.
struct Chunk {
  Bits is_known;
  std::string values;
  Bits booleans;
  Dictionary texts;

  void add(const Cell& cell) {
    is_known.add(!std::holds_alternative<std::monostate>(cell));
    if (const auto* integer = std::get_if<std::int64_t>(&cell))
      append_little_endian(values, *integer);
    if (const auto* natural = std::get_if<std::uint64_t>(&cell))
      append_little_endian(values, *natural);
    if (const auto* real = std::get_if<double>(&cell)) append_little_endian(values, *real);
    if (const auto* boolean = std::get_if<bool>(&cell)) booleans.add(*boolean);
    if (const auto* text = std::get_if<std::string_view>(&cell)) texts.add(*text);
  }

  // Definition levels as one bit-packed run, then the values that are there.
  std::string page() const {
    std::string levels;
    append_varint(levels, static_cast<std::uint64_t>(is_known.bytes().size()) << 1U | 1U);
    levels += is_known.bytes();
    std::string page;
    append_little_endian(page, static_cast<std::uint32_t>(levels.size()));
    return page + levels + values + booleans.bytes() + (texts.size() > 0 ? texts.packed() : "");
  }

  void clear() {
    is_known.clear();
    values.clear();
    booleans.clear();
    texts.clear();
  }
};

struct WrittenChunk {
  std::int64_t offset = 0;  // of the data page
  std::optional<std::int64_t> dictionary{};
  std::int64_t plain_size = 0;  // with the page's header
  std::int64_t size = 0;
};
struct WrittenGroup {
  std::int64_t rows = 0;
  std::vector<WrittenChunk> chunks;
};

class ParquetTable final : public TableWriter {
 public:
  ParquetTable(std::ostream& out, std::span<const Column> columns)
      : out_(out), columns_(columns.begin(), columns.end()), chunks_(columns.size()) {
    write(kParquetMagic);
  }

  void row(std::span<const Cell> cells) override {
    for (std::size_t i = 0; i < cells.size(); ++i)
      chunks_[i].add(cells[i]);
    if (++rows_ == kRowsPerGroup) end_group();
  }

  void finish() override {
    if (rows_ > 0) end_group();
    const std::string metadata = file_metadata();
    write(metadata);
    std::string size;
    append_little_endian(size, static_cast<std::uint32_t>(metadata.size()));
    write(size);
    write(kParquetMagic);
  }

 private:
  void write(std::string_view bytes) {
    out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    offset_ += static_cast<std::int64_t>(bytes.size());
  }

  // `describe` writes what the page's kind has of its own. Returns the size before compression.
  template <typename Describe>
  std::int64_t write_page(std::int32_t kind, const std::string& page, Describe describe) {
    snappy::Compress(page.data(), page.size(), &compressed_);
    Thrift header;
    header.i32(1, kind);
    header.i32(2, static_cast<std::int32_t>(page.size()));
    header.i32(3, static_cast<std::int32_t>(compressed_.size()));
    describe(header);
    header.end_structure();
    write(header.bytes());
    write(compressed_);
    return static_cast<std::int64_t>(header.bytes().size() + page.size());
  }

  WrittenChunk write_chunk(const Chunk& chunk) {
    WrittenChunk written{.offset = offset_};
    const auto begin = offset_;
    const bool is_numbered = chunk.texts.size() > 0;
    if (is_numbered) {
      written.dictionary = offset_;
      written.plain_size += write_page(kDictionaryPage, chunk.texts.values(), [&](Thrift& header) {
        header.begin_structure(7);
        header.i32(1, chunk.texts.size());
        header.i32(2, kPlain);
        header.end_structure();
      });
      written.offset = offset_;
    }
    written.plain_size += write_page(kDataPage, chunk.page(), [&](Thrift& header) {
      header.begin_structure(5);
      header.i32(1, static_cast<std::int32_t>(rows_));
      header.i32(2, is_numbered ? kRleDictionary : kPlain);
      header.i32(3, kRle);  // definition levels
      header.i32(4, kRle);  // repetition levels: there are none
      header.end_structure();
    });
    written.size = offset_ - begin;
    return written;
  }

  void end_group() {
    WrittenGroup group{.rows = rows_, .chunks = {}};
    for (Chunk& chunk : chunks_) {
      group.chunks.push_back(write_chunk(chunk));
      chunk.clear();
    }
    groups_.push_back(std::move(group));
    all_rows_ += rows_;
    rows_ = 0;
  }

  void describe_columns(Thrift& thrift) const {
    thrift.begin_list(2, Thrift::Type::structure, columns_.size() + 1);
    thrift.begin_element();
    thrift.binary(4, "schema");
    thrift.i32(5, static_cast<std::int32_t>(columns_.size()));
    thrift.end_structure();
    for (const Column& column : columns_) {
      thrift.begin_element();
      thrift.i32(1, physical(column.type));
      thrift.i32(3, kOptional);
      thrift.binary(4, column.name);
      if (column.type == ColumnType::text) thrift.i32(6, kUtf8);
      thrift.end_structure();
    }
  }

  std::string file_metadata() const {
    Thrift thrift;
    thrift.i32(1, 1);  // version
    describe_columns(thrift);
    thrift.i64(3, all_rows_);
    thrift.begin_list(4, Thrift::Type::structure, groups_.size());
    for (const WrittenGroup& group : groups_) {
      thrift.begin_element();
      thrift.begin_list(1, Thrift::Type::structure, columns_.size());
      std::int64_t size = 0;
      for (std::size_t i = 0; i < columns_.size(); ++i) {
        const WrittenChunk& chunk = group.chunks[i];
        size += chunk.plain_size;
        thrift.begin_element();
        thrift.i64(2, chunk.offset);
        thrift.begin_structure(3);
        thrift.i32(1, physical(columns_[i].type));
        thrift.begin_list(2, Thrift::Type::i32, chunk.dictionary ? 3 : 2);
        thrift.element_i32(kPlain);
        thrift.element_i32(kRle);
        if (chunk.dictionary) thrift.element_i32(kRleDictionary);
        thrift.begin_list(3, Thrift::Type::binary, 1);
        thrift.element_binary(columns_[i].name);
        thrift.i32(4, kSnappy);
        thrift.i64(5, group.rows);
        thrift.i64(6, chunk.plain_size);
        thrift.i64(7, chunk.size);
        thrift.i64(9, chunk.offset);
        if (chunk.dictionary) thrift.i64(11, *chunk.dictionary);
        thrift.end_structure();
        thrift.end_structure();
      }
      thrift.i64(2, size);
      thrift.i64(3, group.rows);
      thrift.end_structure();
    }
    thrift.binary(6, std::string("cie ") + std::string(tool_version()));
    thrift.end_structure();
    return thrift.bytes();
  }

  std::ostream& out_;
  std::vector<Column> columns_;
  std::vector<Chunk> chunks_;
  std::string compressed_;
  std::int64_t offset_ = 0;
  std::int64_t rows_ = 0;  // of the group that is being collected
  std::int64_t all_rows_ = 0;
  std::vector<WrittenGroup> groups_;
};

}  // namespace

std::unique_ptr<TableWriter> make_parquet_table(std::ostream& out,
                                                std::span<const Column> columns) {
  return std::make_unique<ParquetTable>(out, columns);
}

}  // namespace cie::viewer_export
