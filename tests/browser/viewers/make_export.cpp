// Writes the hand-made application in a viewer's format: see the tests beside.
#include <cie/viewer_export/output_file.hpp>
#include <cie/viewer_export/viewer_exports.hpp>

#include "unit/viewer_export/sample_instances.hpp"

#include <iostream>
#include <string>

int main(int argc, char** argv) {
  using namespace cie;
  const auto viewer =
      argc >= 3 ? viewer_export::make_viewer_export(argv[1], {.records_in_memory = 2}) : nullptr;
  if (viewer == nullptr) {
    std::cerr << "usage: make_export FORMAT FILE [TIMES]\n";
    return 2;
  }
  for (int times = argc > 3 ? std::stoi(argv[3]) : 1; times > 0; --times)
    test::feed_application(*viewer);
  viewer_export::OutputFile file(argv[2]);
  auto result = test::application_result();
  result.report.trace.clock_offset_ns = 1'700'000'000'000'000'000;
  const auto counts = viewer->write(file.stream(), result);
  file.commit();
  std::cout << "{\"instances\": " << counts.instances
            << ", \"publications\": " << counts.publications << ", \"flows\": " << counts.flows
            << ", \"backward_flows\": " << counts.backward_flows
            << ", \"unfinished\": " << counts.unfinished << ", \"skipped\": " << counts.skipped
            << "}\n";
}
