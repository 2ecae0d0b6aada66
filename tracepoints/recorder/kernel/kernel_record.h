/* Events of the kernel's trace as they stand in the recording: a header, then the fields, without
   gaps. The BPF programs write them so, the recorder reads what it needs of them, and
   kernel_event_classes() describes them to readers. C, because the BPF programs are. */
#ifndef CIE_RECORDER_KERNEL_RECORD_H
#define CIE_RECORDER_KERNEL_RECORD_H

#include <stdint.h>

#define CIE_COMM_SIZE 16
/* What LTTng-modules takes off the kernel's priorities. */
#define CIE_PRIORITY_SHIFT 100

/* In the order of kernel_event_classes(). */
enum cie_kernel_event {
  CIE_SCHED_SWITCH,
  CIE_SCHED_WAKING,
  CIE_SCHED_WAKEUP,
  CIE_SCHED_WAKEUP_NEW,
  CIE_SCHED_PROCESS_FORK,
  CIE_SCHED_PROCESS_EXIT,
  CIE_SCHED_MIGRATE_TASK,
  CIE_SCHED_PI_SETPRIO,
  CIE_SCHED_PROCESS_EXEC
};

#pragma pack(push, 1)

struct cie_event_header {
  uint16_t id;   /* a cie_kernel_event */
  uint64_t time; /* ns, CLOCK_MONOTONIC */
};

struct cie_name_and_tid {
  char comm[CIE_COMM_SIZE]; /* filled up with zeros */
  int32_t tid;
};

struct cie_task {
  struct cie_name_and_tid thread;
  int32_t prio;
};

struct cie_sched_switch {
  struct cie_event_header header;
  struct cie_task prev;
  int64_t prev_state;
  struct cie_task next;
};

struct cie_sched_wake {
  struct cie_event_header header;
  struct cie_task task;
  int32_t target_cpu;
};

struct cie_sched_process_fork {
  struct cie_event_header header;
  struct cie_name_and_tid parent;
  struct cie_name_and_tid child;
};

struct cie_sched_process_exit {
  struct cie_event_header header;
  struct cie_task task;
};

struct cie_sched_migrate_task {
  struct cie_event_header header;
  struct cie_task task;
  int32_t orig_cpu;
  int32_t dest_cpu;
};

struct cie_sched_pi_setprio {
  struct cie_event_header header;
  struct cie_name_and_tid thread;
  int32_t oldprio;
  int32_t newprio;
};

struct cie_sched_process_exec {
  struct cie_event_header header;
  int32_t tid;
  int32_t old_tid; /* the same, but where another thread than the first executes */
};

#pragma pack(pop)

#endif
