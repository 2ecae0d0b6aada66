// Compresses what is written to it and passes it on.
#pragma once

#include <memory>
#include <ostream>
#include <streambuf>

namespace cie::viewer_export {

// An ostream whose bytes arrive in `out` (borrowed) as one gzip member. Call finish() before use of
// what was written; without it the member has no end. Throws what `out` throws.
class GzipStream {
 public:
  explicit GzipStream(std::ostream& out);
  ~GzipStream();
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;

  std::ostream& stream() noexcept { return *stream_; }
  void finish();

 private:
  class Buffer;
  std::unique_ptr<Buffer> buffer_;
  std::unique_ptr<std::ostream> stream_;
};

}  // namespace cie::viewer_export
