#include "partition_files.hpp"

#include <cie/tracepoints/sha256.hpp>

#include "output/held_signals.hpp"
#include "output/result_directory.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace cie::viewer_export {

namespace fs = std::filesystem;

PartitionFiles::PartitionFiles(fs::path directory, const RecordingIdentity& recording,
                               const OpenFile& open)
    : directory_(std::move(directory)),
      recording_(recording),
      open_(open),
      day_(day_text(recording)) {}

void PartitionFiles::begin(const FleetTable& table) {
  table_ = &table;
  // Instances come process after process, and are many; all else is small and comes mixed.
  is_streamed_ = table.name == "instances";
  has_rows_ = false;
}

void PartitionFiles::row(const RowPlace& place, std::span<const Cell> cells) {
  auto* part = find(place);
  cells_.assign(
      {Cell(std::string_view(recording_.software)), Cell(std::string_view(recording_.id))});
  cells_.insert(cells_.end(), cells.begin(), cells.end());
  part->table->row(cells_);
}

void PartitionFiles::end() {
  // Every table has a file, or readers would not know its columns.
  if (!has_rows_) find({});
  close_all();
}

void PartitionFiles::commit(std::vector<OutputFile> views) {
  std::ranges::move(views, std::back_inserter(written_));
  const HeldSignals held;
  for (auto& file : written_)
    file.commit();
  written_.clear();
}

void PartitionFiles::close_all() {
  for (auto& [place, part] : parts_)
    close(place, part);
  parts_.clear();
  last_ = nullptr;
}

PartitionFiles::Part* PartitionFiles::find(const RowPlace& place) {
  has_rows_ = true;
  if (last_ != nullptr && *last_ == place) return &parts_.at(place);
  if (is_streamed_) close_all();
  const auto [at, is_new] = parts_.try_emplace(place);
  if (is_new) {
    auto& part = at->second;
    if (is_streamed_) part.file.emplace(open_file(place));
    part.table =
        make_parquet_table(is_streamed_ ? part.file->stream() : part.kept, table_->columns);
  }
  last_ = &at->first;
  return &at->second;
}

void PartitionFiles::close(const RowPlace& place, Part& part) {
  part.table->finish();
  part.table.reset();
  if (!part.file) {
    part.file.emplace(open_file(place));
    part.file->stream() << part.kept.view();
  }
  part.file->stream().flush();
  written_.push_back(std::move(*part.file));
  part.file.reset();
}

OutputFile PartitionFiles::open_file(const RowPlace& place) const {
  const fs::path folder = directory_ / table_->name / ("day=" + day_) /
                          ("host=" + partition_value(place.host)) /
                          ("process=" + partition_value(place.process));
  make_result_directory(folder);
  std::string name = recording_.id;
  if (place.pid) name += fmt::format("-{}", *place.pid);
  if (place.former > 0) name += fmt::format("-{}", place.former + 1);
  return open_(folder / (name + ".parquet"));
}

std::string partition_value(std::string_view text) {
  if (text.empty()) return "__HIVE_DEFAULT_PARTITION__";
  // A name in a directory has 255 bytes at most, and "process=" stands before it.
  constexpr std::size_t kLongest = 230;
  constexpr std::size_t kDigest = 16;
  const bool is_path = text == "." || text == "..";
  std::string value;
  for (const char c : text) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                          (c >= '0' && c <= '9') || c == '-' || c == '_' || (c == '.' && !is_path);
    if (is_plain) {
      value += c;
    } else {
      value += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  if (value.size() <= kLongest) return value;
  value.resize(kLongest - kDigest - 1);
  if (const auto percent = value.find('%', value.size() - 2); percent != std::string::npos)
    value.resize(percent);  // no half of an escape
  return value + "~" + sha256_hex(text).substr(0, kDigest);
}

}  // namespace cie::viewer_export
