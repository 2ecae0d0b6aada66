// What cdr_bytes.cpp, message_layout.cpp, message_data.cpp, topic.cpp and service_type.cpp need: to write and read
// CDR by a type's operations.
#include <cstddef>
#include <cstdint>

// clang-format off
#include <dds/features.h>
#include <dds/dds.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_protocol.h>
#include <dds/ddsrt/heap.h>
// clang-format on

#include "same.hpp"

using Operations = const std::uint32_t*;

int main() {
  same<void(dds_istream_t*, std::uint32_t, const void*, std::uint32_t)>(dds_istream_init);
  same<void(dds_ostream_t*, std::uint32_t, std::uint32_t)>(dds_ostream_init);
  same<Operations(char*, std::uint32_t*, std::uint32_t, bool, std::uint32_t, Operations)>(
      dds_stream_normalize_data);
  same<Operations(dds_ostream_t*, const char*, Operations)>(dds_stream_write);
  same<Operations(dds_istream_t*, char*, Operations)>(dds_stream_read);
  same<void(void*, Operations)>(dds_stream_free_sample);
  same<std::uint32_t(Operations, std::uint32_t, const dds_key_descriptor_t*)>(dds_stream_countops);
  same<std::uint16_t(Operations)>(dds_stream_minimum_xcdr_version);
  same<bool(Operations, ddsi_sertype_extensibility*)>(dds_stream_extensibility);
  same<void*(std::size_t)>(ddsrt_malloc);
  same<void*(std::size_t)>(ddsrt_malloc_s);

  dds_ostream_t stream{};
  same<unsigned char>(stream.m_buffer);
  same<std::uint32_t>(&stream.m_index);
  same<std::uint32_t>(&stream.m_size);
  static_assert(CDR_ENC_VERSION_1 == 1 && CDR_ENC_IS_NATIVE(CDR_LE) != CDR_ENC_IS_NATIVE(CDR_BE));
  return DDSI_SERTYPE_EXT_FINAL == DDSI_SERTYPE_EXT_MUTABLE;
}
