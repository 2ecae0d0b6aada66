#include "export_fleet.hpp"

#include <cie/viewer_export/fleet_export.hpp>
#include <cie/viewer_export/instance_writer.hpp>

#include "base/directory.hpp"
#include "base/messages.hpp"
#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"

#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <sys/resource.h>

namespace cie::cli {
namespace {

namespace fs = std::filesystem;

std::vector<viewer_export::Label> labels_of(const std::vector<std::string>& texts) {
  std::vector<viewer_export::Label> labels;
  for (const std::string& text : texts) {
    try {
      labels.push_back(viewer_export::label_of(text));
    } catch (const std::invalid_argument& reason) {
      throw UsageError(std::string("--label: ") + reason.what());
    }
  }
  return labels;
}

// Those of a set stay open until all are written: one for each process and table.
void allow_many_files() {
  rlimit files{};
  if (::getrlimit(RLIMIT_NOFILE, &files) != 0) return;
  files.rlim_cur = files.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &files);
}

void require_directory(const std::string& name) {
  if (name == "-") throw UsageError("the result is a directory: name it with -o DIRECTORY");
  std::error_code error;
  const auto status = fs::status(name, error);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) {
    throw UsageError(fmt::format("\"{}\" is there and no directory: name one with -o", name));
  }
  try {
    const auto why = Directory::open(name).distrust();
    if (why.empty()) return;
    throw UsageError(fmt::format("\"{}\" {}: name a directory of your own with -o", name, why));
  } catch (const UntrustedLink& link) {
    throw UsageError(link.what());
  }
}

}  // namespace

int export_fleet(const std::vector<fs::path>& traces, analysis::AnalysisOptions options,
                 ProgressBar& bar, const std::vector<std::string>& labels,
                 const std::string& directory) {
  auto known_labels = labels_of(labels);
  require_directory(directory);
  options.keep_buckets = true;
  // Nothing appears in the directory before the recording was read.
  viewer_export::InstanceWriter instances(spill_directory(directory),
                                          viewer_export::InstanceWriter::kRowsInMemory,
                                          viewer_export::InstanceOrder::by_process);
  const auto& result = analyze_until_exit(traces, options, bar, &instances);
  tell_of_damage(result.report);
  const auto recording = viewer_export::identify(result.report, std::move(known_labels));
  instances.show_progress(bar.begin("writing", ProgressUnit::instances));
  allow_many_files();
  viewer_export::write_partitions(directory, recording, result, instances,
                                  [](const fs::path& path) { return open_output(path); });
  bar.end();
  if (!recording.day) {
    tell(
        "the recording does not say when it was made: its day is 1970-01-01 unless --label "
        "day=YYYY-MM-DD tells it");
  }
  return ok;
}

}  // namespace cie::cli
