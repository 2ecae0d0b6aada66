#include "export_viewers.hpp"

#include <cie/viewer_export/perfetto_export.hpp>
#include <cie/viewer_export/viewer_exports.hpp>

#include "base/messages.hpp"
#include "command_line.hpp"
#include "exit_code.hpp"
#include "inputs.hpp"
#include "output.hpp"
#include "output/gzip_stream.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>

#include <fmt/format.h>
#include <unistd.h>

namespace cie::cli {
namespace {

void say_what_is_left_out(std::uint64_t backward, std::uint64_t unfinished, std::uint64_t skipped) {
  if (backward > 0) {
    tell_plainly(fmt::format("{} messages were taken before they were published: clocks disagree",
                             backward));
  }
  if (unfinished > 0)
    tell_plainly(fmt::format("{} instances never ended and are left out", unfinished));
  if (skipped > 0)
    tell_plainly(fmt::format("{} items could not be drawn: their times make no sense", skipped));
}

// As `cie verify` counts them; each is marked at all of its evidence.
std::uint64_t violated_subjects(const analysis::VerdictReport& verdicts) {
  std::uint64_t count = 0;
  for (const auto& rule : verdicts.rules) {
    count += static_cast<std::uint64_t>(std::ranges::count(rule.subjects, analysis::Verdict::fail,
                                                           &analysis::SubjectVerdict::verdict));
  }
  return count;
}

void export_perfetto(const std::vector<std::filesystem::path>& traces,
                     const analysis::AnalysisOptions& options, ProgressBar& bar,
                     const ViewerRequest& request, viewer_export::OutputFile& output) {
  viewer_export::PerfettoExport perfetto(
      {.gzip = request.is_compressed, .spill_directory = spill_directory(request.target)});
  const auto& result = analyze_until_exit(traces, options, bar, &perfetto);
  tell_of_damage(result.report);
  perfetto.show_progress(begin_writing(bar, output));
  const auto counts = perfetto.write(output.stream(), result);
  output.commit();
  bar.end();
  if (::isatty(STDERR_FILENO) == 0) return;
  tell_plainly(fmt::format(
      "{}: {} callback slices, {} waits, {} publications, {} arrows, {} kernel slices, {} ({})",
      request.target, counts.callback_slices, counts.waits, counts.publications, counts.flows,
      counts.sched_slices, counted(violated_subjects(result.verdicts), "violation"),
      counted(counts.violations, "mark")));
  say_what_is_left_out(counts.backward_flows, 0, counts.skipped);
}

void export_other(const std::vector<std::filesystem::path>& traces,
                  const analysis::AnalysisOptions& options, ProgressBar& bar,
                  const ViewerRequest& request, viewer_export::OutputFile& output) {
  const auto viewer = viewer_export::make_viewer_export(
      request.format.name, {.spill_directory = spill_directory(request.target)});
  const auto& result = analyze_until_exit(traces, options, bar, viewer.get());
  tell_of_damage(result.report);
  viewer->show_progress(begin_writing(bar, output));
  viewer_export::ViewerCounts counts;
  if (request.is_compressed) {
    viewer_export::GzipStream compressed(output.stream());
    counts = viewer->write(compressed.stream(), result);
    compressed.finish();
    output.commit();
  } else {
    write_data(output, [&](std::ostream& out) { counts = viewer->write(out, result); });
  }
  bar.end();
  if (::isatty(STDERR_FILENO) == 0) return;
  const auto messages = request.format.has_messages
                            ? fmt::format(", {} publications, {} messages from one to another",
                                          counts.publications, counts.flows)
                            : std::string();
  tell_plainly(fmt::format("{}: {} instances{}", request.target, counts.instances, messages));
  say_what_is_left_out(counts.backward_flows, counts.unfinished, counts.skipped);
}

}  // namespace

int export_to_viewer(const std::vector<std::filesystem::path>& traces,
                     const analysis::AnalysisOptions& options, ProgressBar& bar,
                     const ViewerRequest& request) {
  auto output = open_output(request.target);
  if ((request.format.is_binary || request.is_compressed) && output.is_terminal()) {
    throw UsageError("the result is binary and not for a terminal: name a file with -o FILE");
  }
  if (request.format.name == "perfetto") {
    export_perfetto(traces, options, bar, request, output);
  } else {
    export_other(traces, options, bar, request, output);
  }
  if (::isatty(STDERR_FILENO) == 1) fmt::print(stderr, "{}\n", request.format.advice);
  return ok;
}

}  // namespace cie::cli
