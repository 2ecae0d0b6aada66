// Messages are the C structs that idlc generates. This header gives them ownership: contents
// (strings, sequences) live on the heap of Cyclone DDS and are freed with the message.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string_view>
#include <type_traits>

struct dds_topic_descriptor;  // <dds/dds.h>; generated code refers to it

namespace cie {

// Specialised for each message type, by cie_generate_messages() of CMake, with
// `static const dds_topic_descriptor& descriptor() noexcept`.
template <typename T>
struct MessageTraits;

template <typename T>
concept Message = std::is_trivially_copyable_v<T> && requires {
  { MessageTraits<T>::descriptor() }
  noexcept->std::same_as<const dds_topic_descriptor&>;
};

// What is known of a received message besides its contents.
struct MessageInfo {
  std::int64_t source_timestamp_realtime_ns = 0;  // the writer's clock
  std::int64_t arrival_ns = -1;  // CLOCK_MONOTONIC when it entered this reader's queue; -1 unknown
  std::uint64_t writer_gid = 0;  // names the writer in every process alike; 0 unknown
};

namespace executor {
// A type under the name it has in DDS. `name` is static.
dds_topic_descriptor with_wire_name(const dds_topic_descriptor& type, const char* name) noexcept;
// Zeroed memory for a message; throws std::bad_alloc.
void* allocate_message(const dds_topic_descriptor& type);
// Frees a message of allocate_message() and its contents.
void free_message(void* message, const dds_topic_descriptor& type) noexcept;
// Zeroed memory for a message's contents; throws std::bad_alloc.
void* allocate_contents(std::size_t bytes);
void free_contents(void* contents) noexcept;
}  // namespace executor

template <Message T>
struct MessageDeleter {
  void operator()(T* message) const noexcept {
    executor::free_message(message, MessageTraits<T>::descriptor());
  }
};

template <Message T>
using MessagePtr = std::unique_ptr<T, MessageDeleter<T>>;

// An empty message: numbers 0, strings null (written as ""), sequences empty.
template <Message T>
MessagePtr<T> make_message() {
  return MessagePtr<T>{static_cast<T*>(executor::allocate_message(MessageTraits<T>::descriptor()))};
}

// Replaces the text of a message's string. One with a zero inside, which the string would end at,
// throws std::invalid_argument.
void set_text(char*& field, std::string_view text);

// Makes a message's sequence `length` elements long. Existing elements are kept, with what they
// own; what was never an element before is zero (an empty string, sequence, struct). Throws
// std::bad_alloc.
template <typename Sequence>
void resize(Sequence& sequence, std::uint32_t length) {
  using Element = std::remove_pointer_t<decltype(sequence._buffer)>;
  if (length > sequence._maximum) {
    void* const fresh = executor::allocate_contents(length * sizeof(Element));
    if (sequence._maximum > 0) {
      std::memcpy(fresh, sequence._buffer, sequence._maximum * sizeof(Element));
    }
    if (sequence._release) executor::free_contents(sequence._buffer);
    sequence._buffer = static_cast<Element*>(fresh);
    sequence._maximum = length;
    sequence._release = true;
  }
  sequence._length = length;
}

}  // namespace cie
