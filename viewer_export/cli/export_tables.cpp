#include "export_tables.hpp"

#include <cie/viewer_export/instance_writer.hpp>
#include <cie/viewer_export/tables.hpp>

#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "table_option.hpp"

namespace cie::cli {

void check_table(const std::string& table) {
  check_choice("--table", table, viewer_export::table_names());
}

int export_tables(const std::vector<std::filesystem::path>& traces,
                  const analysis::AnalysisOptions& options, ProgressBar& bar,
                  const TableChoice& choice, const std::string& target) {
  const auto& format = choice.format;
  const std::string name(format.name);
  const auto& table = choice.table;
  const bool is_database = format.kind == ExportKind::database;
  const bool has_instances = is_database || table == "instances";
  auto output = open_output(target);
  if (format.is_binary && output.is_terminal()) {
    throw UsageError("the result is binary and not for a terminal: name a file with -o FILE");
  }
  viewer_export::InstanceWriter instances(spill_directory(target));
  const auto& result =
      analyze_until_exit(traces, options, bar, has_instances ? &instances : nullptr);
  tell_of_damage(result.report);
  instances.show_progress(begin_writing(bar, output));
  const auto write = [&](std::ostream& out) {
    if (is_database) {
      viewer_export::write_sqlite(out, result, instances, spill_directory(target));
    } else if (has_instances) {
      instances.write(out, table_format_of("--to", name), result.report,
                      viewer_export::InstanceColumns::all);
    } else {
      viewer_export::write_table(out, table, table_format_of("--to", name), result);
    }
  };
  write_data(output, write, name == "csv");
  return ok;
}

}  // namespace cie::cli
