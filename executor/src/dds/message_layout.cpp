#include "message_layout.hpp"

#include <cie/executor/message.hpp>

#include <cstring>
#include <utility>

// features.h decides the layout of what follows.
// clang-format off
#include <dds/features.h>
#include <dds/dds.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/q_protocol.h>
// clang-format on

namespace cie::executor {
namespace {

bool has_plain_layout(const dds_topic_descriptor& type) {
  auto extensibility = DDSI_SERTYPE_EXT_MUTABLE;
  return type.m_nkeys == 0 && (type.m_flagset & DDS_TOPIC_CONTAINS_UNION) == 0 &&
         dds_stream_extensibility(type.m_ops, &extensibility) &&
         extensibility == DDSI_SERTYPE_EXT_FINAL &&
         dds_stream_minimum_xcdr_version(type.m_ops) == CDR_ENC_VERSION_1;
}

}  // namespace

MessageLayout::MessageLayout(const dds_topic_descriptor& type)
    : type_name_(type.m_typename),
      size_(type.m_size),
      operations_(type.m_ops,
                  type.m_ops + dds_stream_countops(type.m_ops, type.m_nkeys, type.m_keys)) {
  if (has_plain_layout(type)) texts_.emplace(operations_);
}

void* MessageLayout::allocate() const { return allocate_contents(size_); }

void MessageLayout::clear(void* message) const noexcept {
  dds_stream_free_sample(message, operations_.data());
  std::memset(message, 0, size_);
}

void MessageLayout::free(void* message) const noexcept {
  if (message == nullptr) return;
  dds_stream_free_sample(message, operations_.data());
  free_contents(message);
}

std::shared_ptr<const void> own_message(void* message, LayoutPtr layout) {
  return {message, [layout = std::move(layout)](void* owned) { layout->free(owned); }};
}

}  // namespace cie::executor
