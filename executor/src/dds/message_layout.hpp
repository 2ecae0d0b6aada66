// What must be known of a message type once the code that came with it may be gone.
#pragma once

#include "cdr_texts.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

struct dds_topic_descriptor;

namespace cie::executor {

// How a type's messages lie in memory and on the wire: a copy of what idlc generated, because
// messages outlive the component that their type came with, in other readers' queues and in users'
// hands. Immutable; knows nothing of a Context and may outlive it.
class MessageLayout {
 public:
  explicit MessageLayout(const dds_topic_descriptor& type);
  MessageLayout(const MessageLayout&) = delete;
  MessageLayout& operator=(const MessageLayout&) = delete;
  ~MessageLayout() = default;

  const std::string& type_name() const noexcept { return type_name_; }
  std::size_t size() const noexcept { return size_; }
  // The program of Cyclone's serialiser.
  const std::vector<std::uint32_t>& operations() const noexcept { return operations_; }
  // Whether this library's own serialisation can do it: without keys, unions, optional members or
  // members that may be added later. Types of ROS 2 are like that.
  bool is_plain() const noexcept { return texts_.has_value(); }
  // Of a plain layout.
  const CdrTexts& texts() const noexcept { return *texts_; }

  // Zeroed memory for a message; throws std::bad_alloc.
  void* allocate() const;
  // Frees the contents, and zeroes the message.
  void clear(void* message) const noexcept;
  // Frees the contents and the message.
  void free(void* message) const noexcept;

 private:
  std::string type_name_;
  std::size_t size_;
  std::vector<std::uint32_t> operations_;
  std::optional<CdrTexts> texts_;
};

using LayoutPtr = std::shared_ptr<const MessageLayout>;

// Takes over a message of this layout; what frees it is code of this library. Frees it when it
// throws (std::bad_alloc).
std::shared_ptr<const void> own_message(void* message, LayoutPtr layout);

}  // namespace cie::executor
