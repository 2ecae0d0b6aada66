// Preloaded: the consumer daemon of LTTng looks for full buffers only twice a second, as if it
// hardly came to run.
#define _GNU_SOURCE
#include <errno.h>
#include <poll.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

int poll(struct pollfd* descriptors, nfds_t count, int timeout) {
  // Commands come on two descriptors; whoever waits for more waits for buffers.
  if (count > 2 && strstr(program_invocation_name, "lttng-consumerd") != NULL) {
    const struct timespec half_a_second = {.tv_nsec = 500000000};
    nanosleep(&half_a_second, NULL);
  }
  return (int)syscall(SYS_poll, descriptors, count, timeout);
}
