#include "kernel/ctf_stream.hpp"

#include <cie/tracepoints/recording_layout.hpp>

#include "base/text.hpp"
#include "base/uuid.hpp"
#include "kernel/kernel_events.hpp"
#include "system/error.hpp"

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <sys/utsname.h>
#include <unistd.h>

namespace cie::record {
namespace {

constexpr std::size_t kPacketSize = 64 << 10;
constexpr std::size_t kHeaderSize = kEmptyPacketBytes;

constexpr std::string_view kStream = R"(stream {
	id = 0;
	event.header := struct {
		integer { size = 16; align = 8; signed = false; } id;
		integer { size = 64; align = 8; signed = false; map = clock.monotonic.value; } timestamp;
	};
	packet.context := struct {
		integer { size = 64; align = 8; signed = false; map = clock.monotonic.value; } timestamp_begin;
		integer { size = 64; align = 8; signed = false; map = clock.monotonic.value; } timestamp_end;
		integer { size = 64; align = 8; signed = false; } content_size;
		integer { size = 64; align = 8; signed = false; } packet_size;
		integer { size = 64; align = 8; signed = false; } packet_seq_num;
		integer { size = 64; align = 8; signed = false; } events_discarded;
		integer { size = 32; align = 8; signed = false; } cpu_id;
	};
};
)";

std::string in_tsdl(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result + '"';
}

std::string declaration(const KernelField& field) {
  const std::string name = '_' + std::string(field.name);
  switch (field.type) {
    case KernelFieldType::comm:
      return "integer { size = 8; align = 8; signed = false; encoding = UTF8; } " + name + "[16];";
    case KernelFieldType::int64:
      return "integer { size = 64; align = 8; signed = true; } " + name + ';';
    case KernelFieldType::int32:
    case KernelFieldType::priority:
      return "integer { size = 32; align = 8; signed = true; } " + name + ';';
  }
  return {};
}

// The text in the packets that LTTng's consumer daemon writes.
std::string without_packets(std::string_view bytes) {
  struct Header {
    std::uint32_t magic;
    TraceUuid uuid;
    std::uint32_t checksum;
    std::uint32_t content_bits;
    std::uint32_t packet_bits;
  };
  constexpr std::uint32_t kMagic = 0x75D11D57;
  constexpr std::size_t kSize = 37;  // five more bytes: schemes and version
  std::string text;
  while (bytes.size() > kSize) {
    Header header{};
    std::memcpy(&header, bytes.data(), sizeof header);
    if (header.magic != kMagic) break;
    const std::size_t content = header.content_bits / 8;
    const std::size_t packet = header.packet_bits / 8;
    if (content < kSize || content > packet || packet > bytes.size()) break;
    text += bytes.substr(kSize, content - kSize);
    bytes.remove_prefix(packet);
  }
  return text.empty() ? std::string(bytes) : text;
}

// The value after "name =" in a block of TSDL.
std::string_view value_of(std::string_view block, std::string_view name) {
  for (std::size_t at = block.find(name); at != std::string_view::npos;
       at = block.find(name, at + 1)) {
    const bool is_word =
        at > 0 && std::string_view(" \t\n;{").find(block[at - 1]) != std::string_view::npos;
    const std::size_t sign = block.find_first_not_of(' ', at + name.size());
    if (!is_word || sign == std::string_view::npos || block[sign] != '=') continue;
    const std::size_t begin = block.find_first_not_of(" \"", sign + 1);
    const std::size_t end = block.find_first_of("\";", begin);
    if (begin == std::string_view::npos || end == std::string_view::npos) return {};
    return block.substr(begin, end - begin);
  }
  return {};
}

}  // namespace

TraceUuid random_uuid() {
  TraceUuid uuid{};
  if (getrandom(uuid.data(), uuid.size(), 0) != static_cast<ssize_t>(uuid.size())) {
    throw system_error("cannot make a uuid", errno);
  }
  uuid[6] = static_cast<std::uint8_t>((uuid[6] & 0x0fU) | 0x40U);  // version 4, RFC 4122
  uuid[8] = static_cast<std::uint8_t>((uuid[8] & 0x3fU) | 0x80U);
  return uuid;
}

std::string kernel_metadata(const TraceUuid& trace, const TraceClock& clock,
                            std::string_view route) {
  utsname system{};
  uname(&system);
  const char* byte_order = std::endian::native == std::endian::little ? "le" : "be";
  std::string text =
      "/* CTF 1.8 */\n\ntrace {\n\tmajor = 1;\n\tminor = 8;\n\tuuid = " +
      in_tsdl(uuid_text(trace)) + ";\n\tbyte_order = " + byte_order +
      ";\n\tpacket.header := struct {\n"
      "\t\tinteger { size = 32; align = 8; signed = false; base = x; } magic;\n"
      "\t\tinteger { size = 8; align = 8; signed = false; } uuid[16];\n"
      "\t\tinteger { size = 32; align = 8; signed = false; } stream_id;\n"
      "\t\tinteger { size = 64; align = 8; signed = false; } stream_instance_id;\n\t};\n};\n\n";
  // The tracer's name says how to read the events: named, and priorities scaled, as its are.
  text += "env {\n\thostname = " + in_tsdl(system.nodename) +
          ";\n\tdomain = \"kernel\";\n\tsysname = \"Linux\";\n\tkernel_release = " +
          in_tsdl(system.release) + ";\n\tkernel_version = " + in_tsdl(system.version) +
          ";\n\ttracer_name = \"lttng-modules\";\n\ttracer_major = 2;\n\ttracer_minor = 13;\n"
          "\trecorded_by = " +
          in_tsdl(fmt::format("cie-record, from {}", route)) + ";\n};\n\n";
  text += fmt::format(
      "clock {{\n\tname = \"monotonic\";\n\tuuid = {};\n\tdescription = \"Monotonic Clock\";\n"
      "\tfreq = 1000000000;\n\toffset = {};\n}};\n\n",
      in_tsdl(clock.uuid), clock.offset_ns);
  text += kStream;
  const auto& classes = kernel_event_classes();
  for (std::size_t id = 0; id < classes.size(); ++id) {
    text += fmt::format(
        "\nevent {{\n\tname = {};\n\tid = {};\n\tstream_id = 0;\n\tfields := struct {{\n",
        in_tsdl(classes[id].name), id);
    for (const KernelField& field : classes[id].fields) {
      text += "\t\t" + declaration(field) + '\n';
    }
    text += "\t};\n};\n";
  }
  return text;
}

bool read_clock(std::string_view metadata, TraceClock& clock) {
  const std::string text = without_packets(metadata);
  const std::size_t begin = text.find("clock {");
  const std::size_t end = text.find('}', begin);
  if (begin == std::string::npos || end == std::string::npos) return false;
  const std::string_view block = std::string_view(text).substr(begin, end - begin);
  const std::string_view offset = value_of(block, "offset");
  std::uint64_t number = 0;
  const auto [rest, error] = std::from_chars(offset.data(), offset.data() + offset.size(), number);
  const std::string_view uuid = value_of(block, "uuid");
  if (error != std::errc{} || offset.empty() || uuid.empty()) return false;
  clock = {.uuid = std::string(uuid), .offset_ns = number};
  return true;
}

CtfStream::CtfStream(const Directory& directory, const TraceUuid& trace, std::uint32_t cpu,
                     std::uint64_t begin)
    : directory_(&directory), trace_(trace), cpu_(cpu), begin_(begin), end_(begin) {
  packet_.resize(kHeaderSize);
}

void CtfStream::add(std::uint64_t time, std::string_view event) {
  if (packet_.size() + event.size() > kPacketSize) flush();
  packet_ += event;
  end_ = std::max(end_, time);
  ++events_;
}

void CtfStream::lose(std::uint64_t time, std::uint64_t total) {
  flush();
  // A packet of its own, without events: what lies between its times is what was lost.
  lost_ = std::max(lost_, total);
  end_ = std::max(end_, time);
  write_packet();
}

void CtfStream::flush() {
  if (packet_.size() > kHeaderSize) write_packet();
}

void CtfStream::finish(std::uint64_t end, std::uint64_t total_lost) {
  if (packets_ == 0 && packet_.size() == kHeaderSize && total_lost == 0) return;
  lost_ = std::max(lost_, total_lost);
  end_ = std::max(end_, end);
  write_packet();
}

void CtfStream::go_on() {
  file_ = FileDescriptor();
  size_ = 0;
}

void CtfStream::write_packet() {
  const std::string name = fmt::format("sched_{}", cpu_);
  if (!file_.is_open()) file_ = directory_->create(name);
  const PacketHeader start{.magic = kPacketMagic,
                           .trace_uuid = trace_,
                           .stream_id = 0,
                           .stream_instance_id = cpu_,
                           .begin = begin_,
                           .end = end_,
                           .content_bits = packet_.size() * 8,
                           .packet_bits = packet_.size() * 8,
                           .number = packets_,
                           .discarded_events = lost_};
  std::memcpy(packet_.data(), &start, sizeof start);
  std::memcpy(packet_.data() + sizeof start, &cpu_, sizeof cpu_);
  for (std::size_t done = 0; done < packet_.size();) {
    const ssize_t size = write(file_.get(), packet_.data() + done, packet_.size() - done);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) {
      const int error = errno;
      static_cast<void>(!ftruncate(file_.get(), static_cast<off_t>(size_)));
      throw system_error("cannot write " + in_quotes(directory_->path() / name), error);
    }
    done += static_cast<std::size_t>(size);
  }
  size_ += packet_.size();
  ++packets_;
  begin_ = end_;
  packet_.resize(kHeaderSize);
}

}  // namespace cie::record
