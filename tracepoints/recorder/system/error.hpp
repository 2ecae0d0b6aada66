// Why there is no recording, or why it failed: one sentence that names the operation, its object
// and the cause.
#pragma once

#include "base/program.hpp"

#include <stdexcept>
#include <string>

namespace cie::record {

class RecordError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Why the kernel's scheduler cannot be recorded here, and what would help.
class KernelUnavailable : public RecordError {
 public:
  using RecordError::RecordError;
};

// "what: <text of errno value>".
RecordError system_error(const std::string& what, int error);

}  // namespace cie::record
