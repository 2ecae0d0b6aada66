#include "kernel_pages.hpp"

#include <cstring>

namespace cie::test {
namespace {

constexpr std::size_t kPageSize = 4096;
constexpr std::uint32_t kPadding = 29;
constexpr std::uint32_t kTimeExtend = 30;
constexpr std::uint32_t kTimeStamp = 31;
constexpr std::uint64_t kMissed = std::uint64_t{1} << 31U;
constexpr std::uint64_t kMissedStored = std::uint64_t{1} << 30U;

template <typename Integer>
void append(std::string& out, Integer value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::string padded(std::string text, std::size_t size) {
  text.resize(size);
  return text;
}

std::string common_fields(std::uint16_t number) {
  std::string bytes;
  append(bytes, number);
  append(bytes, std::uint16_t{0});
  append(bytes, std::int32_t{7});
  return bytes;
}

constexpr const char* kCommonFormat =
    "format:\n"
    "\tfield:unsigned short common_type;\toffset:0;\tsize:2;\tsigned:0;\n"
    "\tfield:unsigned char common_flags;\toffset:2;\tsize:1;\tsigned:0;\n"
    "\tfield:unsigned char common_preempt_count;\toffset:3;\tsize:1;\tsigned:0;\n"
    "\tfield:int common_pid;\toffset:4;\tsize:4;\tsigned:1;\n\n";

}  // namespace

std::string switch_format() {
  return "name: sched_switch\nID: " + std::to_string(kSwitchNumber) + '\n' + kCommonFormat +
         "\tfield:char prev_comm[16];\toffset:8;\tsize:16;\tsigned:0;\n"
         "\tfield:pid_t prev_pid;\toffset:24;\tsize:4;\tsigned:1;\n"
         "\tfield:int prev_prio;\toffset:28;\tsize:4;\tsigned:1;\n"
         "\tfield:long prev_state;\toffset:32;\tsize:8;\tsigned:1;\n"
         "\tfield:char next_comm[16];\toffset:40;\tsize:16;\tsigned:0;\n"
         "\tfield:pid_t next_pid;\toffset:56;\tsize:4;\tsigned:1;\n"
         "\tfield:int next_prio;\toffset:60;\tsize:4;\tsigned:1;\n\n"
         "print fmt: \"prev_pid=%d next_pid=%d\", REC->prev_pid, REC->next_pid\n";
}

std::string fork_format() {
  return "name: sched_process_fork\nID: " + std::to_string(kForkNumber) + '\n' + kCommonFormat +
         "\tfield:__data_loc char[] parent_comm;\toffset:8;\tsize:4;\tsigned:0;\n"
         "\tfield:pid_t parent_pid;\toffset:12;\tsize:4;\tsigned:1;\n"
         "\tfield:__data_loc char[] child_comm;\toffset:16;\tsize:4;\tsigned:0;\n"
         "\tfield:pid_t child_pid;\toffset:20;\tsize:4;\tsigned:1;\n\n"
         "print fmt: \"pid=%d child_pid=%d\", REC->parent_pid, REC->child_pid\n";
}

std::string exec_format() {
  return "name: sched_process_exec\nID: " + std::to_string(kExecNumber) + '\n' + kCommonFormat +
         "\tfield:__data_loc char[] filename;\toffset:8;\tsize:4;\tsigned:0;\n"
         "\tfield:pid_t pid;\toffset:12;\tsize:4;\tsigned:1;\n"
         "\tfield:pid_t old_pid;\toffset:16;\tsize:4;\tsigned:1;\n\n"
         "print fmt: \"pid=%d old_pid=%d\", REC->pid, REC->old_pid\n";
}

std::string bytes_of(const SwitchRecord& record) {
  std::string bytes = common_fields(kSwitchNumber);
  bytes += padded(record.prev_comm, 16);
  append(bytes, record.prev_pid);
  append(bytes, record.prev_prio);
  append(bytes, record.prev_state);
  bytes += padded(record.next_comm, 16);
  append(bytes, record.next_pid);
  append(bytes, record.next_prio);
  return bytes;
}

PageText& PageText::put(std::uint32_t type, std::uint32_t delta) {
  append(data_, type | delta << 5U);
  return *this;
}

PageText& PageText::record(std::uint32_t delta, const std::string& data) {
  put(static_cast<std::uint32_t>((data.size() + 3) / 4), delta);
  data_ += padded(data, (data.size() + 3) / 4 * 4);
  return *this;
}

PageText& PageText::long_record(std::uint32_t delta, const std::string& data) {
  put(0, delta);
  append(data_, static_cast<std::uint32_t>(data.size() + 4));
  data_ += padded(data, (data.size() + 3) / 4 * 4);
  return *this;
}

PageText& PageText::discarded(std::uint32_t delta, std::size_t size) {
  put(kPadding, delta);
  append(data_, static_cast<std::uint32_t>(size + 4));
  data_ += std::string(size, '\x7f');
  return *this;
}

PageText& PageText::time_extend(std::uint64_t delta) {
  put(kTimeExtend, static_cast<std::uint32_t>(delta & 0x7ffffffU));
  append(data_, static_cast<std::uint32_t>(delta >> 27U));
  return *this;
}

PageText& PageText::time_stamp(std::uint64_t time) {
  put(kTimeStamp, static_cast<std::uint32_t>(time & 0x7ffffffU));
  append(data_, static_cast<std::uint32_t>(time >> 27U));
  return *this;
}

PageText& PageText::padding() { return put(kPadding, 0); }

PageText& PageText::missed() {
  flags_ = kMissed;
  return *this;
}

PageText& PageText::missed(std::uint64_t count) {
  flags_ = kMissed | kMissedStored;
  missed_ = count;
  return *this;
}

std::vector<std::byte> PageText::bytes() const {
  std::string page;
  append(page, time_);
  append(page, data_.size() | flags_);
  page += data_;
  if ((flags_ & kMissedStored) != 0) append(page, missed_);
  page.resize(kPageSize);
  std::vector<std::byte> bytes(page.size());
  std::memcpy(bytes.data(), page.data(), page.size());
  return bytes;
}

}  // namespace cie::test
