#include "gzip_stream.hpp"

#include <cie/viewer_export/output_file.hpp>

#include <array>
#include <cstddef>

#include <zlib.h>

namespace cie::viewer_export {

class GzipStream::Buffer final : public std::streambuf {
 public:
  explicit Buffer(std::ostream& out) : out_(out) {
    constexpr int kGzipWindow = MAX_WBITS + 16;  // zlib: 16 more means a gzip header
    constexpr int kMemoryLevel = 8;
    if (deflateInit2(&z_, Z_BEST_SPEED, Z_DEFLATED, kGzipWindow, kMemoryLevel,
                     Z_DEFAULT_STRATEGY) != Z_OK) {
      throw WriteError("cannot compress: zlib does not start");
    }
    setp(input_.data(), input_.data() + input_.size());
  }
  ~Buffer() override { deflateEnd(&z_); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  void finish() { compress(Z_FINISH); }

 protected:
  int_type overflow(int_type c) override {
    compress(Z_NO_FLUSH);
    if (!traits_type::eq_int_type(c, traits_type::eof())) {
      *pptr() = traits_type::to_char_type(c);
      pbump(1);
    }
    return traits_type::not_eof(c);
  }

 private:
  void compress(int flush) {
    z_.next_in = reinterpret_cast<Bytef*>(pbase());
    z_.avail_in = static_cast<uInt>(pptr() - pbase());
    do {
      z_.next_out = reinterpret_cast<Bytef*>(output_.data());
      z_.avail_out = static_cast<uInt>(output_.size());
      deflate(&z_, flush);  // cannot fail: the state is ours and there is room
      out_.write(output_.data(), static_cast<std::streamsize>(output_.size() - z_.avail_out));
    } while (z_.avail_out == 0);
    setp(input_.data(), input_.data() + input_.size());
  }

  std::ostream& out_;
  z_stream z_{};
  std::array<char, 65536> input_{};
  std::array<char, 65536> output_{};
};

GzipStream::GzipStream(std::ostream& out)
    : buffer_(std::make_unique<Buffer>(out)),
      stream_(std::make_unique<std::ostream>(buffer_.get())) {
  stream_->exceptions(std::ios::badbit | std::ios::failbit);
}
GzipStream::~GzipStream() = default;

void GzipStream::finish() { buffer_->finish(); }

}  // namespace cie::viewer_export
