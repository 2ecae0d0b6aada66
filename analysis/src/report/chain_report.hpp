// What the report says of chains.
#pragma once

#include <cie/analysis/report.hpp>

#include "model/facts.hpp"

#include <vector>

namespace cie::analysis {

// All of the model's, in its order.
std::vector<ChainReport> chain_reports(const Model& model);

}  // namespace cie::analysis
