// The tables of one recording among many: those of every export, with what tells the recordings
// apart before each row, and tables about the recordings themselves.
#pragma once

#include <cie/analysis/analyzer.hpp>
#include <cie/viewer_export/fleet_export.hpp>
#include <cie/viewer_export/instance_writer.hpp>

#include "partition_files.hpp"

#include <vector>

namespace cie::viewer_export {

// The one called "contents" is the last: how many rows the others have.
const std::vector<FleetTable>& fleet_tables();

// `instances` has seen the analysis, in the order by_process; it is empty afterwards. The result
// has buckets (AnalysisOptions::keep_buckets). Throws WriteError.
void write_fleet_tables(PartitionFiles& files, const RecordingIdentity& recording,
                        const analysis::AnalysisResult& result, InstanceWriter& instances);

}  // namespace cie::viewer_export
