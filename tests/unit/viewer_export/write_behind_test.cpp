#include "output/write_behind.hpp"

#include "base/file_descriptor.hpp"
#include "output/spool.hpp"
#include "output/write_all.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace cie::viewer_export {
namespace {

constexpr std::size_t kPiece = std::size_t{1} << 20U;

std::string piece(std::size_t i) { return std::string(kPiece, static_cast<char>(i)); }

TEST(WriteBehind, LeavesWhatWasWrittenAsItIs) {
  auto name = (temporary_place({}) / "cie.XXXXXX").string();
  const FileDescriptor file{::mkstemp(name.data())};
  ASSERT_TRUE(file.is_open());
  ::unlink(name.c_str());
  constexpr std::size_t kMany = 90;  // MiB: some leave the cache before the end is written
  WriteBehind behind(file.get(), 2 * kPiece);
  for (std::size_t i = 0; i < kMany; ++i) {
    write_all(file.get(), piece(i), "the test's file");
    behind.wrote(kPiece);
  }
  std::string read(kPiece, '\0');
  for (std::size_t i = 0; i < kMany; ++i) {
    const auto at = static_cast<::off_t>(i * kPiece);
    ASSERT_EQ(::pread(file.get(), read.data(), kPiece, at), static_cast<::ssize_t>(kPiece));
    ASSERT_TRUE(read == piece(i)) << "MiB " << i;
  }
  EXPECT_EQ(::lseek(file.get(), 0, SEEK_END), static_cast<::off_t>(kMany * kPiece));
}

}  // namespace
}  // namespace cie::viewer_export
