// What is wrong with metadata.
#pragma once

#include <string>

#include <ctf/metadata/metadata_parser.hpp>
#include <ctf/program/trace_plan.hpp>

namespace cie::test {

// Of a class of events alone, too. "none" if all can be read.
inline std::string error_of(const std::string& text) {
  try {
    const analysis::ctf::TracePlan plan(analysis::ctf::parse_metadata(text));
    if (!plan.malformed.empty()) return plan.malformed;
  } catch (const analysis::ctf::MetadataError& error) {
    return error.what();
  }
  return "none";
}

}  // namespace cie::test
