#pragma once

#include <cie/tracepoints/scheduling_spec.hpp>

#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace cie {

// What parsing `text` as "spec.yaml" complains of; empty if it is accepted.
inline std::string error_of(std::string_view text) {
  try {
    SchedulingSpec::parse(text, "spec.yaml");
  } catch (const SpecError& error) {
    return error.what();
  }
  return {};
}

// The same for one entry of callback_groups; `fields` are its lines after the id.
inline std::string error_of_entry(std::string_view fields) {
  return error_of("callback_groups:\n  - id: /a@Timer(1)\n" + std::string(fields));
}

}  // namespace cie
