#include "system/error.hpp"

#include <system_error>

namespace cie::record {

RecordError system_error(const std::string& what, int error) {
  return RecordError(what + ": " + std::generic_category().message(error));
}

}  // namespace cie::record
