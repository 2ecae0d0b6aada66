#include <cie/executor/message.hpp>

#include <cstring>
#include <new>
#include <stdexcept>
#include <string>

#include <dds/dds.h>

namespace cie {
namespace executor {

dds_topic_descriptor with_wire_name(const dds_topic_descriptor& type, const char* name) noexcept {
  dds_topic_descriptor renamed = type;
  renamed.m_typename = name;
  return renamed;
}

void* allocate_message(const dds_topic_descriptor& type) { return allocate_contents(type.m_size); }

void free_message(void* message, const dds_topic_descriptor& type) noexcept {
  if (message != nullptr) dds_sample_free(message, &type, DDS_FREE_ALL);
}

void* allocate_contents(std::size_t bytes) {
  void* const memory = dds_alloc(bytes);  // zeroed
  if (memory == nullptr) throw std::bad_alloc{};
  return memory;
}

void free_contents(void* contents) noexcept { dds_free(contents); }

}  // namespace executor

void set_text(char*& field, std::string_view text) {
  if (const auto zero = text.find('\0'); zero != std::string_view::npos) {
    throw std::invalid_argument{"a text of " + std::to_string(text.size()) +
                                " bytes has a zero behind the first " + std::to_string(zero) +
                                ": a message's texts end there"};
  }
  auto* const copy = static_cast<char*>(executor::allocate_contents(text.size() + 1));
  if (!text.empty()) std::memcpy(copy, text.data(), text.size());
  executor::free_contents(field);
  field = copy;
}

}  // namespace cie
