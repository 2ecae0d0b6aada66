// `cie instances`: one row per instance of a callback, ordered by start, then thread.
#pragma once

#include <cie/analysis/instance.hpp>
#include <cie/analysis/progress.hpp>
#include <cie/viewer_export/table_format.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <ostream>

namespace cie::viewer_export {

// The order of rows: by start, then thread; or process after process, and within each likewise.
enum class InstanceOrder : std::uint8_t { by_start, by_process };

// The contract's, as `cie instances` prints them; or with "callback_index" behind them, by which rows
// are joined with those of "callbacks", as databases and exported tables have them.
enum class InstanceColumns : std::uint8_t { contract, all };

// Collects instances in any order and writes them sorted. Memory is bounded: beyond
// `rows_in_memory` rows, sorted runs go to nameless temporary files in `spill_directory` (empty:
// $TMPDIR or /tmp). Not thread-safe.
class InstanceWriter final : public analysis::Observer {
 public:
  static constexpr std::size_t kRowsInMemory = 65536;

  explicit InstanceWriter(std::filesystem::path spill_directory = {},
                          std::size_t rows_in_memory = kRowsInMemory,
                          InstanceOrder order = InstanceOrder::by_start);
  ~InstanceWriter() override;
  InstanceWriter(const InstanceWriter&) = delete;
  InstanceWriter& operator=(const InstanceWriter&) = delete;

  // Throws WriteError when the temporary files cannot be written.
  void on_instance(const analysis::Instance& instance) override;

  // Where to count the rows written; borrowed, null: nowhere.
  void show_progress(analysis::Progress* progress);
  // Writes all rows; `report` is that of the same analysis and has the processes. Call it once.
  // Throws what the stream throws, and WriteError.
  void write(std::ostream& out, TableFormat format, const analysis::Report& report,
             InstanceColumns columns = InstanceColumns::contract);

 private:
  friend class InstanceRows;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace cie::viewer_export
