/* SPDX-License-Identifier: Apache-2.0 OR GPL-2.0-only

   BPF programs at the scheduler's tracepoints. Each writes its event, as it stands in the
   recording, into the buffer of the CPU it happened on. Offsets of fields come from the running
   kernel's BTF. */
#include "kernel_record.h"

#include <linux/bpf.h>
#include <stdbool.h>
/* These need the types of linux/bpf.h. */
/* clang-format off */
#include <bpf/bpf_helpers.h>
#include <bpf/bpf_core_read.h>
#include <bpf/bpf_tracing.h>
/* clang-format on */

/* The part of the kernel's own types that is read here. */
#pragma clang attribute push(__attribute__((preserve_access_index)), apply_to = record)
struct thread_info {
  unsigned int cpu;
};
struct task_struct {
  struct thread_info thread_info;
  int pid;
  int prio;
  int normal_prio;
  int exit_state;
  char comm[CIE_COMM_SIZE];
};
/* Before a task's CPU stood in its thread_info. */
struct task_struct___with_cpu {
  unsigned int cpu;
};
#pragma clang attribute pop

/* include/linux/sched.h. User space knows them as prev_state of sched_switch. */
#define TASK_UNINTERRUPTIBLE 0x2
#define TASK_REPORT 0x7f
#define TASK_REPORT_IDLE 0x80
#define TASK_REPORT_MAX 0x100
#define TASK_IDLE 0x402
#define TASK_RTLOCK_WAIT 0x1000
#define TASK_FROZEN 0x8000

struct {
  __uint(type, BPF_MAP_TYPE_PERF_EVENT_ARRAY);
  __uint(key_size, sizeof(__u32));
  __uint(value_size, sizeof(__u32));
} buffers SEC(".maps");

/* Events for which a CPU's buffer had no room. */
struct {
  __uint(type, BPF_MAP_TYPE_PERCPU_ARRAY);
  __uint(max_entries, 1);
  __type(key, __u32);
  __type(value, __u64);
} lost SEC(".maps");

/* All programs begin and end at once, though they are attached one after the other. */
volatile bool is_recording = false;

static __always_inline void emit(void* ctx, struct cie_event_header* event,
                                 enum cie_kernel_event id, __u64 size) {
  event->id = id;
  event->time = bpf_ktime_get_ns();
  if (bpf_perf_event_output(ctx, &buffers, BPF_F_CURRENT_CPU, event, size) == 0) return;
  const __u32 first = 0;
  __u64* count = bpf_map_lookup_elem(&lost, &first);
  if (count) ++*count;
}

static __always_inline void name(struct cie_name_and_tid* out, struct task_struct* task) {
  bpf_probe_read_kernel_str(out->comm, sizeof out->comm, task->comm);
  out->tid = task->pid;
}

static __always_inline void describe(struct cie_task* out, struct task_struct* task) {
  name(&out->thread, task);
  out->prio = task->prio - CIE_PRIORITY_SHIFT;
}

static __always_inline __s32 cpu_of(struct task_struct* task) {
  struct task_struct___with_cpu* other = (void*)task;
  if (bpf_core_field_exists(other->cpu)) return BPF_CORE_READ(other, cpu);
  return task->thread_info.cpu;
}

/* As the kernel's trace event tells it: the highest bit of the state, or that it was preempted. */
static __always_inline __s64 reported_state(bool is_preempted, __u32 state, __u32 exit_state) {
  if (is_preempted) return TASK_REPORT_MAX;
  __u32 reported = (state | exit_state) & TASK_REPORT;
  if ((state & TASK_IDLE) == TASK_IDLE) reported = TASK_REPORT_IDLE;
  if (state & (TASK_RTLOCK_WAIT | TASK_FROZEN)) reported = TASK_UNINTERRUPTIBLE;
#pragma unroll
  for (__u32 bit = TASK_REPORT_IDLE; bit != 0; bit >>= 1) {
    if (reported & bit) return bit;
  }
  return 0;
}

SEC("tp_btf/sched_switch")
int BPF_PROG(sched_switch, bool is_preempted, struct task_struct* prev, struct task_struct* next,
             unsigned int prev_state) {
  if (!is_recording) return 0;
  struct cie_sched_switch event = {};
  describe(&event.prev, prev);
  event.prev_state = reported_state(is_preempted, prev_state, prev->exit_state);
  describe(&event.next, next);
  emit(ctx, &event.header, CIE_SCHED_SWITCH, sizeof event);
  return 0;
}

static __always_inline int wake(void* ctx, struct task_struct* task, enum cie_kernel_event id) {
  if (!is_recording) return 0;
  struct cie_sched_wake event = {};
  describe(&event.task, task);
  event.target_cpu = cpu_of(task);
  emit(ctx, &event.header, id, sizeof event);
  return 0;
}

SEC("tp_btf/sched_waking")
int BPF_PROG(sched_waking, struct task_struct* task) { return wake(ctx, task, CIE_SCHED_WAKING); }

SEC("tp_btf/sched_wakeup")
int BPF_PROG(sched_wakeup, struct task_struct* task) { return wake(ctx, task, CIE_SCHED_WAKEUP); }

SEC("tp_btf/sched_wakeup_new")
int BPF_PROG(sched_wakeup_new, struct task_struct* task) {
  return wake(ctx, task, CIE_SCHED_WAKEUP_NEW);
}

SEC("tp_btf/sched_process_fork")
int BPF_PROG(sched_process_fork, struct task_struct* parent, struct task_struct* child) {
  if (!is_recording) return 0;
  struct cie_sched_process_fork event = {};
  name(&event.parent, parent);
  name(&event.child, child);
  emit(ctx, &event.header, CIE_SCHED_PROCESS_FORK, sizeof event);
  return 0;
}

SEC("tp_btf/sched_process_exit")
int BPF_PROG(sched_process_exit, struct task_struct* task) {
  if (!is_recording) return 0;
  struct cie_sched_process_exit event = {};
  describe(&event.task, task);
  emit(ctx, &event.header, CIE_SCHED_PROCESS_EXIT, sizeof event);
  return 0;
}

SEC("tp_btf/sched_migrate_task")
int BPF_PROG(sched_migrate_task, struct task_struct* task, int dest_cpu) {
  if (!is_recording) return 0;
  struct cie_sched_migrate_task event = {};
  describe(&event.task, task);
  event.orig_cpu = cpu_of(task);
  event.dest_cpu = dest_cpu;
  emit(ctx, &event.header, CIE_SCHED_MIGRATE_TASK, sizeof event);
  return 0;
}

SEC("tp_btf/sched_pi_setprio")
int BPF_PROG(sched_pi_setprio, struct task_struct* task, struct task_struct* donor) {
  if (!is_recording) return 0;
  struct cie_sched_pi_setprio event = {};
  name(&event.thread, task);
  event.oldprio = task->prio - CIE_PRIORITY_SHIFT;
  int newprio = task->normal_prio;
  if (donor && donor->prio < newprio) newprio = donor->prio;
  event.newprio = newprio - CIE_PRIORITY_SHIFT;
  emit(ctx, &event.header, CIE_SCHED_PI_SETPRIO, sizeof event);
  return 0;
}

SEC("tp_btf/sched_process_exec")
int BPF_PROG(sched_process_exec, struct task_struct* task, int old_tid) {
  if (!is_recording) return 0;
  struct cie_sched_process_exec event = {};
  event.tid = task->pid;
  event.old_tid = old_tid;
  emit(ctx, &event.header, CIE_SCHED_PROCESS_EXEC, sizeof event);
  return 0;
}

/* The helpers used ask for a license that the kernel calls compatible. */
char LICENSE[] SEC("license") = "GPL";
