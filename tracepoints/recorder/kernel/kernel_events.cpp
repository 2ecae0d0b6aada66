#include "kernel/kernel_events.hpp"

#include "kernel/kernel_record.h"
#include "system/error.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

extern "C" {
#include <traceevent/event-parse.h>
#include <traceevent/kbuffer.h>
}

namespace cie::record {
namespace {

using enum KernelFieldType;

constexpr std::size_t kNameSize = CIE_COMM_SIZE;

template <typename Integer>
void put(std::string& out, Integer value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <typename Integer>
Integer get(std::span<const std::byte> data, std::size_t offset) {
  Integer value{};
  std::memcpy(&value, data.data() + offset, sizeof value);
  return value;
}

std::int64_t signed_integer(std::span<const std::byte> data, std::size_t offset, std::size_t size) {
  switch (size) {
    case 1:
      return get<std::int8_t>(data, offset);
    case 2:
      return get<std::int16_t>(data, offset);
    case 4:
      return get<std::int32_t>(data, offset);
    default:
      return get<std::int64_t>(data, offset);
  }
}

bool is_integer_size(std::size_t size) { return size == 1 || size == 2 || size == 4 || size == 8; }

void put_name(std::string& out, std::span<const std::byte> text) {
  std::array<char, kNameSize> name{};
  const std::size_t size = std::min(text.size(), kNameSize - 1);
  std::memcpy(name.data(), text.data(), size);
  const std::size_t length = strnlen(name.data(), size);
  out.append(name.data(), length);
  out.append(kNameSize - length, '\0');
}

}  // namespace

const std::vector<KernelEventClass>& kernel_event_classes() {
  static const std::vector<KernelField> woken{{"comm", "comm", comm},
                                              {"tid", "pid", int32},
                                              {"prio", "prio", priority},
                                              {"target_cpu", "target_cpu", int32}};
  static const std::vector<KernelEventClass> classes{
      {"sched_switch",
       {{"prev_comm", "prev_comm", comm},
        {"prev_tid", "prev_pid", int32},
        {"prev_prio", "prev_prio", priority},
        {"prev_state", "prev_state", int64},
        {"next_comm", "next_comm", comm},
        {"next_tid", "next_pid", int32},
        {"next_prio", "next_prio", priority}}},
      {"sched_waking", woken},
      {"sched_wakeup", woken},
      {"sched_wakeup_new", woken},
      {"sched_process_fork",
       {{"parent_comm", "parent_comm", comm},
        {"parent_tid", "parent_pid", int32},
        {"child_comm", "child_comm", comm},
        {"child_tid", "child_pid", int32}}},
      {"sched_process_exit",
       {{"comm", "comm", comm}, {"tid", "pid", int32}, {"prio", "prio", priority}}},
      {"sched_migrate_task",
       {{"comm", "comm", comm},
        {"tid", "pid", int32},
        {"prio", "prio", priority},
        {"orig_cpu", "orig_cpu", int32},
        {"dest_cpu", "dest_cpu", int32}}},
      {"sched_pi_setprio",
       {{"comm", "comm", comm},
        {"tid", "pid", int32},
        {"oldprio", "oldprio", priority},
        {"newprio", "newprio", priority}}},
      // Without the program's path, which has any length.
      {"sched_process_exec", {{"tid", "pid", int32}, {"old_tid", "old_pid", int32}}}};
  return classes;
}

std::size_t recorded_size(const KernelEventClass& event_class) {
  std::size_t size = sizeof(cie_event_header);
  for (const KernelField& field : event_class.fields) {
    size += field.type == comm    ? kNameSize
            : field.type == int64 ? sizeof(std::int64_t)
                                  : sizeof(std::int32_t);
  }
  return size;
}

void RingBufferPage::Free::operator()(kbuffer* buffer) const noexcept { kbuffer_free(buffer); }

// libtraceevent has names of this machine's own size and order since 1.6.
RingBufferPage::RingBufferPage()
    : buffer_(kbuffer_alloc(
          sizeof(long) == 8 ? KBUFFER_LSIZE_8 : KBUFFER_LSIZE_4,
          std::endian::native == std::endian::big ? KBUFFER_ENDIAN_BIG : KBUFFER_ENDIAN_LITTLE)) {
  if (!buffer_) throw std::bad_alloc();
}

void RingBufferPage::load(std::span<std::byte> bytes) {
  kbuffer_load_subbuffer(buffer_.get(), bytes.data());
  missed_ = kbuffer_missed_events(buffer_.get());
  is_first_ = true;
}

std::optional<std::uint64_t> RingBufferPage::missed_count() const noexcept {
  if (missed_ < 0) return std::nullopt;
  return static_cast<std::uint64_t>(missed_);
}

std::optional<RingBufferPage::Record> RingBufferPage::next() {
  unsigned long long time = 0;  // NOLINT(google-runtime-int): kbuffer's type
  const void* data = is_first_ ? kbuffer_read_event(buffer_.get(), &time)
                               : kbuffer_next_event(buffer_.get(), &time);
  is_first_ = false;
  if (data == nullptr) return std::nullopt;
  return Record{.time = time,
                .data = {static_cast<const std::byte*>(data),
                         static_cast<std::size_t>(kbuffer_event_size(buffer_.get()))}};
}

void KernelEventEncoder::Free::operator()(tep_handle* handle) const noexcept { tep_free(handle); }

KernelEventEncoder::KernelEventEncoder() : formats_(tep_alloc()) {
  if (!formats_) throw std::bad_alloc();
  tep_set_loglevel(TEP_LOG_NONE);  // it would write to standard error
}

void KernelEventEncoder::learn(const KernelEventClass& event_class, const std::string& format) {
  const std::string event_name(event_class.name);
  tep_parse_event(formats_.get(), format.data(), format.size(), "sched");
  tep_event* event = tep_find_event_by_name(formats_.get(), "sched", event_name.c_str());
  if (event == nullptr) {
    throw RecordError("the kernel's description of " + event_name + " cannot be read");
  }
  const auto& classes = kernel_event_classes();
  Known known;
  known.event_class = static_cast<std::size_t>(
      std::ranges::find(classes, event_class.name, &KernelEventClass::name) - classes.begin());
  for (const KernelField& field : event_class.fields) {
    const tep_format_field* found = tep_find_field(event, std::string(field.source).c_str());
    if (found == nullptr) {
      throw RecordError("the kernel's " + event_name + " has no field " +
                        std::string(field.source));
    }
    Source source{.type = field.type,
                  .offset = static_cast<std::size_t>(found->offset),
                  .size = static_cast<std::size_t>(found->size),
                  .is_located = (found->flags & TEP_FIELD_IS_DYNAMIC) != 0};
    if (source.is_located ? source.type != comm || source.size != 4
                          : source.type != comm && !is_integer_size(source.size)) {
      throw RecordError("the kernel's " + event_name + " has a field " + std::string(field.source) +
                        " of another type");
    }
    known.end = std::max(known.end, source.offset + source.size);
    known.sources.push_back(source);
  }
  known_[static_cast<std::uint16_t>(event->id)] = std::move(known);
}

bool KernelEventEncoder::encode(const RingBufferPage::Record& record, std::string& out) const {
  const auto data = record.data;
  if (data.size() < sizeof(std::uint16_t)) return false;
  const auto found = known_.find(get<std::uint16_t>(data, 0));
  if (found == known_.end() || data.size() < found->second.end) return false;
  const Known& known = found->second;
  put(out, static_cast<std::uint16_t>(known.event_class));
  put(out, record.time);
  for (const Source& source : known.sources) {
    if (source.type == comm) {
      std::size_t offset = source.offset;
      std::size_t size = source.size;
      if (source.is_located) {
        const auto location = get<std::uint32_t>(data, offset);
        offset = std::min<std::size_t>(location & 0xffffU, data.size());
        size = std::min<std::size_t>(location >> 16U, data.size() - offset);
      }
      put_name(out, data.subspan(offset, size));
      continue;
    }
    const std::int64_t value = signed_integer(data, source.offset, source.size);
    if (source.type == int64) {
      put(out, value);
    } else if (source.type == priority) {
      put(out, static_cast<std::int32_t>(value - CIE_PRIORITY_SHIFT));
    } else {
      put(out, static_cast<std::int32_t>(value));
    }
  }
  return true;
}

}  // namespace cie::record
