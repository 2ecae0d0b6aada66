// The scheduler's events: what the kernel writes of them into its ring buffer, and what becomes of
// it in the recording's CTF trace.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

struct kbuffer;
struct tep_handle;

namespace cie::record {

enum class KernelFieldType {
  comm,  // 16 characters, zero-padded
  int32,
  int64,
  priority,  // int32, the kernel's less 100, as LTTng-modules writes it
};

struct KernelField {
  std::string_view name;    // in the recording
  std::string_view source;  // in the kernel's event
  KernelFieldType type = KernelFieldType::int32;
};

// Named as LTTng-modules names them. An event's id in the recording is its place in the list.
struct KernelEventClass {
  std::string_view name;
  std::vector<KernelField> fields;
};
const std::vector<KernelEventClass>& kernel_event_classes();
// Bytes of an event in the recording, its header (kernel_record.h) included.
std::size_t recorded_size(const KernelEventClass& event_class);

// One page of a per-CPU ring buffer as trace_pipe_raw gives it. Views end with the next load().
class RingBufferPage {
 public:
  struct Record {
    std::uint64_t time = 0;
    std::span<const std::byte> data;
  };

  RingBufferPage();
  // `bytes` must be a whole page, of which the first part was read.
  void load(std::span<std::byte> bytes);
  // Events that were overwritten before the first record of this page.
  bool has_missed() const noexcept { return missed_ != 0; }
  std::optional<std::uint64_t> missed_count() const noexcept;
  // The next record, paddings and time stamps left out; empty at the end.
  std::optional<Record> next();

 private:
  struct Free {
    void operator()(kbuffer* buffer) const noexcept;
  };
  std::unique_ptr<kbuffer, Free> buffer_;
  bool is_first_ = true;
  std::int64_t missed_ = 0;  // kbuffer's word: -1 when the number is not known
};

// Translates records into events of the recording: their header (u16 id, u64 time) and payload.
class KernelEventEncoder {
 public:
  KernelEventEncoder();
  // Learns an event class from its `format` file. Throws RecordError if a field is missing.
  void learn(const KernelEventClass& event_class, const std::string& format);
  // Appends to `out`. False, with nothing appended, for a record of another class or one that is
  // too short.
  bool encode(const RingBufferPage::Record& record, std::string& out) const;

 private:
  struct Source {
    KernelFieldType type{};
    std::size_t offset = 0;
    std::size_t size = 0;
    bool is_located = false;  // the four bytes there say where it is (__data_loc)
  };
  struct Known {
    std::size_t event_class = 0;
    std::size_t end = 0;  // bytes a record has at least
    std::vector<Source> sources;
  };
  struct Free {
    void operator()(tep_handle* handle) const noexcept;
  };
  std::unique_ptr<tep_handle, Free> formats_;
  std::unordered_map<std::uint16_t, Known> known_;  // by the kernel's number
};

}  // namespace cie::record
