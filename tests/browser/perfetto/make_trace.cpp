// Writes a small Perfetto file whose every slice, arrow and name is known: see perfetto_test.py.
#include <cie/viewer_export/output_file.hpp>
#include <cie/viewer_export/perfetto_export.hpp>

#include "unit/viewer_export/sample_instances.hpp"

#include <iostream>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: make_trace FILE\n";
    return 2;
  }
  using namespace cie;
  viewer_export::PerfettoExport perfetto({.records_in_memory = 2});
  test::feed_application(perfetto);
  viewer_export::OutputFile file(argv[1]);
  auto analyzed = test::application_result();
  analyzed.report.trace.clock_offset_ns = 1'700'000'000'000'000'000;
  const auto counts = perfetto.write(file.stream(), analyzed);
  file.commit();
  std::cout << "{\"callback_slices\": " << counts.callback_slices << ", \"waits\": " << counts.waits
            << ", \"publications\": " << counts.publications << ", \"flows\": " << counts.flows
            << ", \"backward_flows\": " << counts.backward_flows
            << ", \"sched_slices\": " << counts.sched_slices << ", \"wakings\": " << counts.wakings
            << ", \"response_values\": " << counts.response_values
            << ", \"queue_changes\": " << counts.queue_changes
            << ", \"violations\": " << counts.violations << ", \"skipped\": " << counts.skipped
            << "}\n";
}
