// Ownership of Cyclone DDS handles, and its errors as exceptions.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <dds/dds.h>

namespace cie::executor::dds {

// what(): the operation, its object, and the cause in Cyclone's words.
class Error : public std::runtime_error {
 public:
  Error(std::string_view operation, std::string_view object, dds_return_t code)
      : std::runtime_error(std::string{operation} + " of \"" + std::string{object} +
                           "\" failed: " + dds_strretcode(code)) {}
};

// Throws Error if `code` is negative, else returns it.
inline dds_return_t check(dds_return_t code, std::string_view operation, std::string_view object) {
  if (code < 0) throw Error{operation, object, code};
  return code;
}

// Owns one entity of DDS. Deleting it waits for its running listeners, so that must not happen in
// one.
class Entity {
 public:
  Entity() = default;
  Entity(dds_entity_t handle, std::string_view operation, std::string_view object)
      : handle_(check(handle, operation, object)) {}
  Entity(Entity&& other) noexcept : handle_(std::exchange(other.handle_, 0)) {}
  Entity& operator=(Entity&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Entity() { reset(); }

  dds_entity_t get() const noexcept { return handle_; }
  void reset() noexcept {
    if (handle_ > 0) dds_delete(std::exchange(handle_, 0));
  }

 private:
  dds_entity_t handle_ = 0;
};

}  // namespace cie::executor::dds
