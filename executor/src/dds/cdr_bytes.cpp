#include "cdr_bytes.hpp"

// features.h decides the layout of what follows.
// clang-format off
#include <dds/features.h>
#include <dds/dds.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_protocol.h>
#include <dds/ddsrt/heap.h>
// clang-format on

namespace cie::executor {

void CdrBytes::complete(std::uint32_t message_size) const noexcept {
  const std::uint32_t padding = (4 - message_size % 4) % 4;
  std::memset(message() + message_size, 0, padding);
  const std::uint16_t identifier =
      ddsi_sertype_get_native_enc_identifier(CDR_ENC_VERSION_1, CDR_ENC_FORMAT_PLAIN);
  std::memcpy(encoding(), &identifier, sizeof identifier);
  encoding()[2] = 0;
  encoding()[3] = static_cast<unsigned char>(padding);
  const std::uint32_t size = kMessage - kEncoding + message_size + padding;
  std::memcpy(memory_, &size, sizeof size);
}

void FreeCdrBytes::operator()(unsigned char* memory) const noexcept { dds_free(memory); }

CdrBytesPtr cdr_of(const MessageLayout& layout, const void* message) noexcept {
  constexpr std::uint32_t kFirstSize = 128;
  dds_ostream_t stream;
  dds_ostream_init(&stream, kFirstSize, CDR_ENC_VERSION_1);
  stream.m_index = CdrBytes::kMessage;
  const bool is_written = dds_stream_write(&stream, static_cast<const char*>(message),
                                           layout.operations().data()) != nullptr;
  CdrBytesPtr memory{stream.m_buffer};
  if (!is_written) return nullptr;
  const std::uint32_t size = stream.m_index - CdrBytes::kMessage;
  const std::uint32_t needed = stream.m_index + sizeof(std::uint32_t);
  if (stream.m_size < needed) {
    memory.reset(static_cast<unsigned char*>(dds_realloc(memory.release(), needed)));
  }
  CdrBytes{memory.get()}.complete(size);
  return memory;
}

CdrBytesPtr cdr_of_nothing() noexcept {
  CdrBytesPtr memory{
      static_cast<unsigned char*>(ddsrt_malloc(CdrBytes::kMessage + sizeof(std::uint32_t)))};
  CdrBytes{memory.get()}.complete(0);
  return memory;
}

CdrBytesPtr room_for_cdr(std::size_t size) noexcept {
  if (size < CdrBytes::kEncoding || size > CdrBytes::kMostSize) return nullptr;
  return CdrBytesPtr{static_cast<unsigned char*>(
      ddsrt_malloc_s(CdrBytes::kEncoding + size + sizeof(std::uint32_t)))};
}

}  // namespace cie::executor
