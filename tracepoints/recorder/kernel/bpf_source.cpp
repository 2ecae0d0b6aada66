#include <cie/tracepoints/machine_files.hpp>

#include "kernel/kernel_events.hpp"
#include "kernel/kernel_record.h"
#include "kernel/kernel_source.hpp"
#include "system/error.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <exception>
#include <string>
#include <utility>

#include <bpf/bpf.h>
#include <bpf/btf.h>
#include <bpf/libbpf.h>
#include <fmt/format.h>
#include <linux/perf_event.h>
#include <sys/mman.h>
#include <unistd.h>

// The compiled programs, as they stand in their object file. NOLINTBEGIN(readability-identifier-naming)
extern "C" const char cie_sched_bpf_begin[];
extern "C" const char cie_sched_bpf_end[];
// NOLINTEND(readability-identifier-naming)

namespace cie::record {
namespace {

// The closure of sched_switch, and what it is told: preempted, prev, next, prev_state.
constexpr int kArgumentsOfSwitch = 5;

template <auto Function>
struct Call {
  template <typename T>
  void operator()(T* object) const noexcept {
    static_cast<void>(Function(object));
  }
};
using Object = std::unique_ptr<bpf_object, Call<bpf_object__close>>;
using Link = std::unique_ptr<bpf_link, Call<bpf_link__destroy>>;
using Buffers = std::unique_ptr<perf_buffer, Call<perf_buffer__free>>;
using Btf = std::unique_ptr<btf, Call<btf__free>>;

int say_nothing(libbpf_print_level /*level*/, const char* /*format*/, va_list /*arguments*/) {
  return 0;
}

[[noreturn]] void refuse(const std::string& what, int error) {
  if (error == EPERM || error == EACCES) {
    throw KernelUnavailable(
        "BPF is for root only (or with CAP_BPF and CAP_PERFMON): record as root");
  }
  throw KernelUnavailable(system_error(what, error).what());
}

// How many arguments the kernel's tracepoint passes, its closure included; -1 if there is none.
int arguments_of(const btf* kernel, const std::string& tracepoint) {
  const int type_id =
      btf__find_by_name_kind(kernel, ("btf_trace_" + tracepoint).c_str(), BTF_KIND_TYPEDEF);
  if (type_id < 0) return -1;
  const btf_type* pointer =
      btf__type_by_id(kernel, btf__type_by_id(kernel, static_cast<__u32>(type_id))->type);
  if (pointer == nullptr || !btf_is_ptr(pointer)) return -1;
  const btf_type* prototype = btf__type_by_id(kernel, pointer->type);
  return prototype != nullptr && btf_is_func_proto(prototype) ? btf_vlen(prototype) : -1;
}

// The programs' variables, in memory that they share with this process.
class Variables {
 public:
  Variables() = default;
  ~Variables() {
    if (memory_ != MAP_FAILED) munmap(memory_, kSize);
  }
  Variables(const Variables&) = delete;
  Variables& operator=(const Variables&) = delete;

  void map(int descriptor) {
    memory_ = mmap(nullptr, kSize, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
    if (memory_ == MAP_FAILED) refuse("cannot map the variables of BPF programs", errno);
  }
  volatile bool& is_recording() noexcept { return *static_cast<volatile bool*>(memory_); }

 private:
  static constexpr std::size_t kSize = sizeof(bool);  // the kernel maps whole pages
  void* memory_ = MAP_FAILED;
};

class BpfSource final : public KernelSource {
 public:
  explicit BpfSource(std::uint64_t buffer_size)
      : cpus_(MachineFiles().online_cpus()), states_(cpus_.size()) {
    libbpf_set_print(say_nothing);  // it would write to standard error
    load();
    open_buffers(buffer_size);
    bpf_program* program = nullptr;
    bpf_object__for_each_program(program, object_.get()) {
      if (!bpf_program__autoload(program)) continue;
      Link link(bpf_program__attach(program));
      if (!link) {
        refuse(std::string("cannot attach a BPF program to ") + bpf_program__name(program), errno);
      }
      links_.push_back(std::move(link));
    }
  }

  ~BpfSource() override { stop(); }
  BpfSource(const BpfSource&) = delete;
  BpfSource& operator=(const BpfSource&) = delete;

  std::string_view name() const override { return "bpf"; }
  const std::vector<std::uint32_t>& cpus() const override { return cpus_; }
  int descriptor(std::size_t cpu) const override {
    return perf_buffer__buffer_fd(buffers_.get(), cpu);
  }
  void start() override { variables_.is_recording() = true; }
  void stop() override { variables_.is_recording() = false; }

  void drain(std::size_t cpu, KernelEventSink& sink) override {
    draining_ = &states_[cpu];
    sink_ = &sink;
    const int result = perf_buffer__consume_buffer(buffers_.get(), cpu);
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    if (result < 0) throw system_error("cannot read the buffer of BPF programs", -result);
  }

  std::uint64_t lost(std::size_t cpu) const override {
    const std::uint32_t first = 0;
    std::vector<std::uint64_t> counts(
        static_cast<std::size_t>(std::max(libbpf_num_possible_cpus(), 1)));
    const int map = bpf_object__find_map_fd_by_name(object_.get(), "lost");
    if (bpf_map_lookup_elem(map, &first, counts.data()) != 0) {
      throw system_error("cannot read what the BPF programs lost", errno);
    }
    return counts[cpus_[cpu]];
  }

 private:
  struct State {
    std::uint64_t last_time = 0;
    std::uint64_t told_lost = 0;
    std::uint64_t untold_lost = 0;
  };

  void load() {
    const Btf kernel(btf__load_vmlinux_btf());
    if (!kernel)
      throw KernelUnavailable("this kernel describes no types: it needs CONFIG_DEBUG_INFO_BTF");
    object_.reset(bpf_object__open_mem(
        cie_sched_bpf_begin, static_cast<std::size_t>(cie_sched_bpf_end - cie_sched_bpf_begin),
        nullptr));
    if (!object_) refuse("cannot open the BPF programs", errno);
    bpf_program* program = nullptr;
    bpf_object__for_each_program(program, object_.get()) {
      const std::string tracepoint = bpf_program__name(program);
      const int arguments = arguments_of(kernel.get(), tracepoint);
      if (tracepoint == "sched_switch" && arguments != kArgumentsOfSwitch) {
        throw KernelUnavailable(
            "this kernel's tracepoint sched_switch does not tell the state of the thread that "
            "leaves: it "
            "needs Linux 5.18 or later");
      }
      if (arguments < 0) bpf_program__set_autoload(program, false);  // e.g. no priority inheritance
    }
    if (const int error = bpf_object__load(object_.get()); error != 0) {
      refuse("cannot load the BPF programs", -error);
    }
    bpf_map* map = nullptr;
    bpf_object__for_each_map(map, object_.get()) {
      if (std::string_view(bpf_map__name(map)).ends_with(".bss")) variables_.map(bpf_map__fd(map));
    }
  }

  void open_buffers(std::uint64_t buffer_size) {
    const auto page_size = static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    const std::uint64_t size = std::bit_floor(std::max(buffer_size, page_size));
    perf_event_attr attributes{};
    attributes.size = sizeof attributes;
    attributes.type = PERF_TYPE_SOFTWARE;
    attributes.config = PERF_COUNT_SW_BPF_OUTPUT;
    attributes.sample_type = PERF_SAMPLE_RAW;
    attributes.sample_period = 1;
    attributes.watermark = 1;
    attributes.wakeup_watermark = static_cast<std::uint32_t>(size / 4);
    std::vector<int> cpus(cpus_.begin(), cpus_.end());
    std::vector<int> keys = cpus;
    perf_buffer_raw_opts options{};
    options.sz = sizeof options;
    options.cpu_cnt = static_cast<int>(cpus.size());
    options.cpus = cpus.data();
    options.map_keys = keys.data();
    buffers_.reset(perf_buffer__new_raw(bpf_object__find_map_fd_by_name(object_.get(), "buffers"),
                                        size / page_size, &attributes, on_record, this, &options));
    if (!buffers_) refuse("cannot create the buffers of BPF programs", errno);
  }

  static bpf_perf_event_ret on_record(void* self, int /*cpu*/, perf_event_header* header) noexcept {
    auto& source = *static_cast<BpfSource*>(self);
    try {
      source.take(*header);
      return LIBBPF_PERF_EVENT_CONT;
    } catch (...) {
      source.failure_ = std::current_exception();
      return LIBBPF_PERF_EVENT_DONE;
    }
  }

  void take(const perf_event_header& header) {
    const std::string_view record(reinterpret_cast<const char*>(&header), header.size);
    if (header.type == PERF_RECORD_LOST) {
      std::uint64_t count = 0;  // after the header and an id
      std::memcpy(&count, record.substr(sizeof header + 8, sizeof count).data(), sizeof count);
      draining_->untold_lost += count;
    }
    if (header.type != PERF_RECORD_SAMPLE) return;
    const std::string_view data = record.substr(sizeof header + sizeof(std::uint32_t));
    cie_event_header event{};
    if (data.size() < sizeof event) return;
    std::memcpy(&event, data.data(), sizeof event);
    if (event.id >= kernel_event_classes().size()) return;
    const std::size_t size =
        recorded_size(kernel_event_classes()[event.id]);  // the kernel rounds up
    if (data.size() < size) return;
    event_.assign(data, 0, size);
    // An interrupt may put an event between another's look at the clock and its place in the
    // buffer.
    event.time = std::max<std::uint64_t>(event.time, draining_->last_time);
    std::memcpy(event_.data(), &event, sizeof event);
    draining_->last_time = event.time;
    if (draining_->untold_lost > 0) {
      draining_->told_lost += std::exchange(draining_->untold_lost, 0);
      sink_->on_loss(event.time, draining_->told_lost);
    }
    sink_->on_event(event.time, event_);
  }

  std::vector<std::uint32_t> cpus_;
  std::vector<State> states_;
  Object object_;
  Variables variables_;
  Buffers buffers_;
  std::vector<Link> links_;
  State* draining_ = nullptr;
  KernelEventSink* sink_ = nullptr;
  std::exception_ptr failure_;
  std::string event_;
};

}  // namespace

std::unique_ptr<KernelSource> open_bpf_source(std::uint64_t buffer_size) {
  return std::make_unique<BpfSource>(buffer_size);
}

}  // namespace cie::record
