#include "error.hpp"

#include <system_error>

namespace cie::record {

RecordError system_error(const std::string& what, int error) {
  return RecordError(what + ": " + std::generic_category().message(error));
}

std::string in_quotes(const std::filesystem::path& name) {
  std::string result(1, '"');
  result += name.string();
  result += '"';
  return result;
}

}  // namespace cie::record
