// A stream written to by one thread while another one hands on, compresses or writes what came
// before.
#pragma once

#include <memory>
#include <ostream>

namespace cie::viewer_export {

// Memory is bounded: who writes waits for who hands on. To be used by one thread.
class BackgroundStream {
 public:
  // Bytes go to `out`, which nobody else may use before finish() or the destructor.
  explicit BackgroundStream(std::ostream& out);
  // What was not handed on yet is forgotten.
  ~BackgroundStream();
  BackgroundStream(const BackgroundStream&) = delete;
  BackgroundStream& operator=(const BackgroundStream&) = delete;

  // Throws, sooner or later, what `out` threw.
  std::ostream& stream() noexcept { return *stream_; }
  // Hands on what is left and waits for it. Call it once, at the end. Throws what `out` threw.
  void finish();

 private:
  class Buffer;
  std::unique_ptr<Buffer> buffer_;
  std::unique_ptr<std::ostream> stream_;
};

}  // namespace cie::viewer_export
