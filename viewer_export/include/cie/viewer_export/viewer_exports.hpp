// `cie export --to chrome|speedscope|otlp|mcap`: a recording in the formats of other people's
// viewers. Perfetto has its own: perfetto_export.hpp.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/analysis/instance.hpp>
#include <cie/analysis/progress.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <ostream>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

struct ViewerOptions {
  std::filesystem::path spill_directory{};  // empty: $TMPDIR or /tmp
  std::size_t records_in_memory = 65536;    // of each kind; the rest goes to temporary files
};

// What the file holds, for the message to the user and for tests.
struct ViewerCounts {
  std::uint64_t instances = 0;
  std::uint64_t publications = 0;    // 0 where the format has no place for them
  std::uint64_t flows = 0;           // publish to callback; likewise
  std::uint64_t backward_flows = 0;  // received before published: clocks disagree; left out
  std::uint64_t unfinished = 0;      // never ended and so left out, where the format demands an end
  std::uint64_t skipped = 0;         // times that make no sense
};

// Collects what the analysis tells its observers, then writes it. Memory is bounded but for one bit
// per instance and the names. Not thread-safe.
class ViewerExport : public analysis::Observer {
 public:
  // Where to count the instances written; borrowed, null: nowhere.
  virtual void show_progress(analysis::Progress* progress) = 0;
  // `result` gives processes and threads their names. Call it once, after the analysis has
  // finished. Throws what the stream throws, and WriteError.
  virtual ViewerCounts write(std::ostream& out, const analysis::AnalysisResult& result) = 0;
};

// "chrome", "speedscope", "otlp", "mcap".
std::vector<std::string_view> viewer_formats();
// Null if `format` is none of them.
std::unique_ptr<ViewerExport> make_viewer_export(std::string_view format,
                                                 const ViewerOptions& options);

}  // namespace cie::viewer_export
