// A part of a recording that was ended, while LTTng writes it out.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

struct lttng_rotation_handle;

namespace cie::record {

// A chunk that was ended and that LTTng is still writing out.
class PendingChunk {
 public:
  explicit PendingChunk(lttng_rotation_handle* handle) noexcept : handle_(handle) {}
  // Where it lies; empty while it is not complete. Throws RecordError when LTTng could not write
  // it.
  std::optional<std::filesystem::path> poll() const;

 private:
  struct Destroy {
    void operator()(lttng_rotation_handle* handle) const noexcept;
  };
  std::unique_ptr<lttng_rotation_handle, Destroy> handle_;
};

}  // namespace cie::record
