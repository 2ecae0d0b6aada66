#include "service_type.hpp"

#include "service_endpoint.hpp"

// clang-format off
#include <dds/features.h>
#include <dds/ddsi/ddsi_cdrstream.h>
// clang-format on

namespace cie::executor {
namespace {

constexpr std::uint32_t kHeaderSize = sizeof(CallHeader);

// The program that idlc writes for
//   struct { CallHeader's members; Payload payload; };
// up to the payload's own, which follows: its jumps are relative.
std::vector<std::uint32_t> operations_of(const dds_topic_descriptor& payload) {
  constexpr std::uint32_t kMember = DDS_OP_ADR;
  constexpr std::uint32_t kToNext = 3U << 16U;
  constexpr std::uint32_t kToPayload = 4;
  std::vector<std::uint32_t> operations{kMember | DDS_OP_TYPE_8BY,
                                        offsetof(CallHeader, guid),
                                        kMember | DDS_OP_TYPE_8BY | DDS_OP_FLAG_SGN,
                                        offsetof(CallHeader, seq),
                                        kMember | DDS_OP_TYPE_EXT,
                                        kHeaderSize,
                                        kToNext | kToPayload,
                                        DDS_OP_RTS};
  operations.insert(operations.end(), payload.m_ops,
                    payload.m_ops + dds_stream_countops(payload.m_ops, 0, nullptr));
  return operations;
}

}  // namespace

// Without type information, which would be that of the payload alone.
ServiceType::ServiceType(const dds_topic_descriptor& payload)
    : operations_(operations_of(payload)),
      descriptor_{.m_size = payload.m_size + kHeaderSize,
                  .m_align = alignof(CallHeader),
                  .m_flagset = payload.m_flagset & ~DDS_TOPIC_XTYPES_METADATA,
                  .m_nkeys = 0,
                  .m_typename = payload.m_typename,
                  .m_keys = nullptr,
                  .m_nops = static_cast<std::uint32_t>(operations_.size()),
                  .m_ops = operations_.data(),
                  .m_meta = "",
                  .type_information = {},
                  .type_mapping = {},
                  .restrict_data_representation = payload.restrict_data_representation} {}

void* payload_of(void* message) noexcept { return static_cast<std::byte*>(message) + kHeaderSize; }
const void* payload_of(const void* message) noexcept {
  return static_cast<const std::byte*>(message) + kHeaderSize;
}

}  // namespace cie::executor
