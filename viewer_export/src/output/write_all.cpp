#include "write_all.hpp"

#include <cie/viewer_export/output_file.hpp>

#include <cerrno>
#include <cstddef>
#include <system_error>

#include <unistd.h>

namespace cie::viewer_export {

void throw_write_error(const std::string& what, int error) {
  const auto message = what + ": " + std::generic_category().message(error);
  if (error == EPIPE) throw ClosedPipe(message);
  throw WriteError(message);
}

void write_all(int descriptor, std::string_view bytes, const std::string& object) {
  while (!bytes.empty()) {
    const auto written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0) {
      if (errno == EINTR) {
        continue;
      }
      throw_write_error("cannot write " + object, errno);
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace cie::viewer_export
