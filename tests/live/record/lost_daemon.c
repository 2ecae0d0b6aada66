// Preloaded: the session daemon goes away while it ends a session, as that of LTTng 2.13.4 does when two
// of its sessions end at once.
#include <lttng/lttng.h>

enum lttng_destruction_handle_status lttng_destruction_handle_wait_for_completion(
    struct lttng_destruction_handle* handle, int timeout_ms) {
  (void)handle;
  (void)timeout_ms;
  return LTTNG_DESTRUCTION_HANDLE_STATUS_ERROR;
}
