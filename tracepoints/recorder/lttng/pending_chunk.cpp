#include "lttng/pending_chunk.hpp"

#include "system/error.hpp"

#include <lttng/lttng.h>

namespace cie::record {

void PendingChunk::Destroy::operator()(lttng_rotation_handle* handle) const noexcept {
  lttng_rotation_handle_destroy(handle);
}

std::optional<std::filesystem::path> PendingChunk::poll() const {
  lttng_rotation_state state = LTTNG_ROTATION_STATE_ERROR;
  if (lttng_rotation_handle_get_state(handle_.get(), &state) != LTTNG_ROTATION_STATUS_OK) {
    throw RecordError("the session daemon does not say what became of a chunk");
  }
  if (state == LTTNG_ROTATION_STATE_ONGOING) {
    return std::nullopt;
  }
  const lttng_trace_archive_location* location = nullptr;
  const char* path = nullptr;
  const bool is_complete = state == LTTNG_ROTATION_STATE_COMPLETED &&
                           lttng_rotation_handle_get_archive_location(handle_.get(), &location) ==
                               LTTNG_ROTATION_STATUS_OK &&
                           lttng_trace_archive_location_local_get_absolute_path(location, &path) ==
                               LTTNG_TRACE_ARCHIVE_LOCATION_STATUS_OK;
  if (!is_complete) {
    throw RecordError("LTTng could not write a chunk to its end (is the disk full?)");
  }
  return path;
}

}  // namespace cie::record
