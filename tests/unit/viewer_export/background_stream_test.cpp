#include "output/background_stream.hpp"

#include <cstddef>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <streambuf>
#include <string>
#include <thread>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

// Takes so many bytes and then fails.
class Full final : public std::streambuf {
 public:
  explicit Full(std::size_t capacity) : left_(capacity) {}
  std::thread::id writer() const noexcept { return writer_; }

 protected:
  std::streamsize xsputn(const char* /*bytes*/, std::streamsize size) override {
    writer_ = std::this_thread::get_id();
    if (static_cast<std::size_t>(size) > left_) throw std::runtime_error("no space left");
    left_ -= static_cast<std::size_t>(size);
    return size;
  }
  int_type overflow(int_type /*c*/) override { throw std::runtime_error("not in blocks"); }

 private:
  std::size_t left_;
  std::thread::id writer_;
};

constexpr std::size_t kMany = 20'000'000;  // bytes: more than wait for the other thread

// Pieces of different lengths, so that blocks end anywhere in them.
std::string piece(std::size_t i) {
  return std::string(1 + i % 1'000, static_cast<char>('a' + i % 26));
}

TEST(BackgroundStream, HandsOnEverythingInOrder) {
  for (const std::size_t most : {std::size_t{0}, std::size_t{1}, std::size_t{262'144}, kMany}) {
    std::ostringstream out;
    std::string expected;
    BackgroundStream background(out);
    for (std::size_t i = 0; expected.size() < most; ++i) {
      background.stream() << piece(i);
      expected += piece(i);
    }
    background.finish();
    EXPECT_TRUE(out.str() == expected) << out.str().size() << " of " << expected.size();
  }
}

TEST(BackgroundStream, WritesOnAnotherThread) {
  Full buffer(kMany);
  std::ostream out(&buffer);
  BackgroundStream background(out);
  background.stream() << "text";
  background.finish();
  EXPECT_NE(buffer.writer(), std::this_thread::get_id());
  EXPECT_NE(buffer.writer(), std::thread::id());
}

std::string error_of(std::size_t capacity, std::size_t bytes) {
  Full buffer(capacity);
  std::ostream out(&buffer);
  out.exceptions(std::ios::badbit | std::ios::failbit);
  try {
    BackgroundStream background(out);
    for (std::size_t i = 0; i < bytes; i += 1'000)
      background.stream() << std::string(1'000, 'x');
    background.finish();
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

TEST(BackgroundStream, ThrowsWhatWasThrownBehindIt) {
  EXPECT_EQ(error_of(kMany, kMany), "");
  EXPECT_EQ(error_of(kMany / 2, kMany), "no space left") << "long before the end";
  EXPECT_EQ(error_of(kMany - 1, kMany), "no space left") << "in the last block";
  EXPECT_EQ(error_of(0, 1'000), "no space left") << "in the only one";
}

TEST(BackgroundStream, CanBeLeftWithoutBeingFinished) {
  std::ostringstream out;
  {
    BackgroundStream background(out);
    for (std::size_t i = 0; i < 10'000; ++i)
      background.stream() << piece(i);
  }
  std::string all;
  for (std::size_t i = 0; i < 10'000; ++i)
    all += piece(i);
  EXPECT_EQ(all.substr(0, out.str().size()), out.str()) << "a part of it, its beginning";
}

}  // namespace
}  // namespace cie::viewer_export
