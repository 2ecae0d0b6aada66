// The files of a trace while they are read: how many stay open, and what becomes of them meanwhile.
#include "support/temporary_directory.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <ctf/metadata/file.hpp>
#include <gtest/gtest.h>

namespace cie::test {
namespace {

namespace fs = std::filesystem;
using analysis::ctf::File;

class TraceFile : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) {
    const auto path = directory_.path() / name;
    std::ofstream(path) << text;
    return path.string();
  }
  static std::string read(const File& file, std::uint64_t offset) {
    std::array<std::uint8_t, 16> bytes{};
    const auto count = file.read(offset, bytes);
    return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)};
  }
  // Descriptors of this process.
  static std::ptrdiff_t open_files() {
    return std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator());
  }

  TemporaryDirectory directory_;
};

TEST_F(TraceFile, MayBeOneOfMoreThanStayOpen) {
  constexpr int kFiles = 200;
  constexpr int kMostOpen = 64;
  const auto before = open_files();
  {
    std::vector<File> files;
    for (int i = 0; i < kFiles; ++i)
      files.emplace_back(write(std::to_string(i), "file " + std::to_string(i)));
    EXPECT_EQ(open_files(), before + kMostOpen);
    for (int i = 0; i < kFiles; ++i)
      EXPECT_EQ(read(files[static_cast<std::size_t>(i)], 5), std::to_string(i));
    const auto copies = files;
    EXPECT_EQ(open_files(), before + kMostOpen);
    EXPECT_EQ(read(copies.back(), 0), "file 199");
  }
  EXPECT_EQ(open_files(), before);
  const File another(write("another", "text"));  // which may stay open again
  EXPECT_EQ(open_files(), before + 1);
}

TEST_F(TraceFile, EndsEarlierWhenItShrinks) {
  const auto path = write("file", "0123456789");
  const File file(path);
  fs::resize_file(path, 4);
  EXPECT_EQ(read(file, 0), "0123");
  EXPECT_EQ(read(file, 4), "");
  EXPECT_EQ(file.size(), 10U);
}

TEST_F(TraceFile, IsNotReadableWhenItIsNoFile) {
  EXPECT_EQ(File(directory_.path() / "none").error(), "No such file or directory");
  EXPECT_EQ(File(directory_.path()).error(), "not a regular file");
  const auto before = open_files();
  const File folder(directory_.path());
  EXPECT_EQ(open_files(), before);
}

}  // namespace
}  // namespace cie::test
