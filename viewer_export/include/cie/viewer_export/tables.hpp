// Everything of an analysis as tables, one by one or as a database.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/viewer_export/instance_writer.hpp>
#include <cie/viewer_export/table_format.hpp>

#include <filesystem>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace cie::viewer_export {

// "instances" and the tables of the report: "callbacks", "callback_threads", "threads",
// "processes", "edges", "chains", "chain_hops", "verdicts", "losses". Columns:
// viewer_export/docs/formats.md.
const std::vector<std::string>& table_names();

// One table of the report; not "instances", which InstanceWriter writes. Times are nanoseconds.
// Throws std::invalid_argument for another name, and what the stream throws.
void write_table(std::ostream& out, std::string_view name, TableFormat format,
                 const analysis::AnalysisResult& result);

// All tables as an SQLite 3 database. `instances` has seen the analysis; it is empty afterwards.
// The database is made in `directory` (empty: $TMPDIR or /tmp), in a file without a name, and then
// copied. Throws WriteError, and what the stream throws.
void write_sqlite(std::ostream& out, const analysis::AnalysisResult& result,
                  InstanceWriter& instances, const std::filesystem::path& directory);

}  // namespace cie::viewer_export
