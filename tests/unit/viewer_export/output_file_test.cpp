#include <cie/viewer_export/output_file.hpp>

#include "support/temporary_directory.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace cie::viewer_export {
namespace {

namespace fs = std::filesystem;

class OutputFileTest : public testing::Test {
 protected:
  static std::string content(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  static void create(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }
  std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(fs::directory_iterator(directory_), fs::directory_iterator()));
  }

  const test::TemporaryDirectory temporary_;
  const fs::path directory_ = temporary_.path();
};

TEST_F(OutputFileTest, AppearsAtCommitAndNotBefore) {
  const auto target = directory_ / "report.json";
  OutputFile file(target);
  file.stream() << std::string(200'000, 'x');  // more than any buffer
  EXPECT_FALSE(fs::exists(target));
  file.commit();
  EXPECT_EQ(content(target), std::string(200'000, 'x'));
  EXPECT_EQ(files(), 1U) << "no temporary file is left";
}

TEST_F(OutputFileTest, WithoutCommitTheOldFileStaysAndNothingIsLeft) {
  const auto target = directory_ / "report.json";
  create(target, "old");
  {
    OutputFile file(target);
    file.stream() << std::string(200'000, 'x');
  }
  EXPECT_EQ(content(target), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFileTest, ReplacesTheFileBehindASymbolicLinkAndKeepsItsMode) {
  const auto real = directory_ / "real";
  create(real, "old");
  ASSERT_EQ(::chmod(real.c_str(), 0640), 0);
  fs::create_symlink("real", directory_ / "link");
  OutputFile file(directory_ / "link");
  file.stream() << "new";
  file.commit();
  EXPECT_TRUE(fs::is_symlink(directory_ / "link"));
  EXPECT_EQ(content(real), "new");
  struct stat status {};
  ASSERT_EQ(::stat(real.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 07777U, 0640U);
}

TEST_F(OutputFileTest, MakesTheFileThatASymbolicLinkNames) {
  fs::create_directory(directory_ / "elsewhere");
  fs::create_symlink("elsewhere/second", directory_ / "first");
  fs::create_symlink("file", directory_ / "elsewhere/second");
  OutputFile file(directory_ / "first");
  file.stream() << "new";
  file.commit();
  EXPECT_TRUE(fs::is_symlink(directory_ / "first"));
  EXPECT_TRUE(fs::is_symlink(directory_ / "elsewhere/second"));
  EXPECT_EQ(content(directory_ / "elsewhere/file"), "new");
}

TEST_F(OutputFileTest, RefusesSymbolicLinksThatNameEachOther) {
  fs::create_symlink("second", directory_ / "first");
  fs::create_symlink("first", directory_ / "second");
  try {
    const OutputFile file(directory_ / "first");
    ADD_FAILURE() << "it was opened";
  } catch (const WriteError& error) {
    EXPECT_THAT(error.what(), testing::EndsWith(": Too many levels of symbolic links"));
  }
  EXPECT_TRUE(fs::is_symlink(directory_ / "first"));
}

TEST_F(OutputFileTest, TakesTheLongestNameThereIs) {
  const auto target = directory_ / std::string(255, 'n');
  OutputFile file(target);
  file.stream() << "x";
  file.commit();
  EXPECT_EQ(content(target), "x");
}

TEST_F(OutputFileTest, TellsWhichTemporaryFileExists) {
  std::vector<fs::path> told;
  OutputFile file(directory_ / "report", [&](const fs::path& path) {
    EXPECT_EQ(fs::exists(path), !path.empty());
    told.push_back(path);
  });
  file.stream() << "x";
  file.commit();
  ASSERT_GE(told.size(), 2U);
  EXPECT_EQ(told.front().parent_path(), directory_);
  EXPECT_TRUE(told.back().empty());
}

TEST_F(OutputFileTest, ASignalWaitsWhileItTakesItsPlace) {
  const auto target = directory_ / "report";
  const auto child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    OutputFile file(target, [](const fs::path& temporary) {
      if (!temporary.empty()) std::raise(SIGTERM);
    });
    file.stream() << "whole";
    file.commit();
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGTERM);
  EXPECT_EQ(content(target), "whole");
  EXPECT_EQ(files(), 1U);
}

TEST_F(OutputFileTest, NamesWhatCannotBeWritten) {
  const auto message = [](const fs::path& target) {
    try {
      OutputFile file(target);
    } catch (const WriteError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(message(directory_), "cannot write \"" + directory_.string() + "\": Is a directory");
  const auto missing = directory_ / "missing" / "file";
  EXPECT_EQ(message(missing),
            "cannot create \"" + missing.string() + "\": No such file or directory");
  EXPECT_NE(message(""), "no error");
}

TEST_F(OutputFileTest, AFullDiskIsAnErrorOfTheWriteNotOfTheDestructor) {
  if (!fs::exists("/dev/full")) {
    GTEST_SKIP() << "not possible here: this system has no /dev/full";
  }
  OutputFile file("/dev/full");
  file.stream() << "x";
  try {
    file.commit();
    FAIL() << "a full disk took the data";
  } catch (const WriteError& error) {
    EXPECT_STREQ(error.what(), "cannot write \"/dev/full\": No space left on device");
  }
}

TEST_F(OutputFileTest, WritesDevicesDirectly) {
  OutputFile file("/dev/null");
  file.stream() << "x";
  file.commit();
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

}  // namespace
}  // namespace cie::viewer_export
