// Why a recording failed: one sentence that names the operation, its object and the cause.
#pragma once

#include <filesystem>
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

// `name` with quotation marks around it, for messages.
std::string in_quotes(const std::filesystem::path& name);

}  // namespace cie::record
