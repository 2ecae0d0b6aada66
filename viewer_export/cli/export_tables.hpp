// `cie export --to sqlite|csv|jsonl|parquet`: what the analysis found, as tables.
#pragma once

#include <cie/analysis/analyzer.hpp>

#include "export_formats.hpp"
#include "progress_bar.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace cie::cli {

// Throws UsageError for a table that there is not.
void check_table(const std::string& table);

struct TableChoice {
  ExportFormat format;
  std::string
      table;  // one of viewer_export::table_names(); with a database all of them are written
};

// Throws UnreadableTrace, WriteError, UsageError.
int export_tables(const std::vector<std::filesystem::path>& traces,
                  const analysis::AnalysisOptions& options, ProgressBar& bar,
                  const TableChoice& choice, const std::string& target);

}  // namespace cie::cli
