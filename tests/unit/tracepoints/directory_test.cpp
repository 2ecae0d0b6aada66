// What others prepared: links, files that are there already, FIFOs in place of files.
#include "base/directory.hpp"

#include <cie/tracepoints/recording_manifest.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/sha256.hpp>

#include "base/file.hpp"
#include "support/temporary_directory.hpp"

#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

namespace cie {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::StartsWith;

constexpr uid_t kNobody = 65'534;

void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }

std::string text_of(const fs::path& file) { return read_file(file); }

template <typename Exception, typename Function>
std::string message(const Function& function) {
  try {
    function();
  } catch (const Exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

// A test that waits for a FIFO's writer ends all the same, as one that failed.
class Impatience {
 public:
  Impatience() { alarm(20); }
  ~Impatience() { alarm(0); }
  Impatience(const Impatience&) = delete;
  Impatience& operator=(const Impatience&) = delete;
};

class Below : public testing::Test {
 protected:
  const test::TemporaryDirectory temporary_;
  const fs::path root_ = temporary_.path();
};
using Files = Below;
using Directories = Below;

class AnotherUser : public Below {
 protected:
  void SetUp() override {
    if (geteuid() != 0) GTEST_SKIP() << "not possible here: only root makes files of another user";
    fs::create_directory(root_ / "theirs");
    give(root_ / "theirs");
    fs::create_directory(root_ / "ours");
    write(root_ / "ours/file", "ours");
  }
  static void give(const fs::path& path) { ASSERT_EQ(lchown(path.c_str(), kNobody, kNobody), 0); }
  static void plant(const fs::path& link, const fs::path& target) {
    fs::create_symlink(target, link);
    give(link);
  }
};

TEST_F(Files, AreReadUpToABound) {
  write(root_ / "file", "abcdef");
  EXPECT_EQ(read_file(root_ / "file"), "abcdef");
  EXPECT_EQ(read_file(root_ / "file", 4), "abcd");
  fs::create_symlink("file", root_ / "link");
  EXPECT_EQ(read_file(root_ / "link"), "abcdef");
}

TEST_F(Files, ThatAreNoneAreRefusedAtOnce) {
  const Impatience impatience;
  const fs::path fifo = root_ / "fifo";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const FileDescriptor writer(open(fifo.c_str(), O_RDWR | O_CLOEXEC));  // who never writes
  const char* const kNoFile = "it is a FIFO, a device or a socket, and no file";
  EXPECT_EQ(message<std::system_error>([&] { read_file(fifo); }), kNoFile);
  EXPECT_EQ(message<std::system_error>([&] { read_file("/dev/zero"); }), kNoFile);
  EXPECT_EQ(message<std::system_error>([&] { read_file(root_); }), "Is a directory");
  EXPECT_EQ(message<std::system_error>([&] { read_file(root_ / "none"); }),
            "No such file or directory");
  EXPECT_EQ(message<SpecError>([&] { SchedulingSpec::load(fifo); }),
            fifo.string() + ": cannot read it: " + kNoFile);
  EXPECT_THAT(message<std::system_error>([&] { sha256_file(fifo); }), HasSubstr(kNoFile));
  ASSERT_EQ(mkfifo((root_ / kManifestName).c_str(), 0600), 0);
  EXPECT_THAT(message<ManifestError>([&] { load_recording_manifest(root_); }), HasSubstr(kNoFile));
}

TEST_F(Files, OfThisProcessAreReadWhateverTheyAre) {
  const Impatience impatience;
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  const FileDescriptor reader(ends[0]);
  FileDescriptor writer(ends[1]);
  write_all(writer, "given");
  writer.close();
  EXPECT_EQ(read_file("/dev/fd/" + std::to_string(reader.get())), "given");
}

TEST_F(Directories, AreReachedOverLinksOfOnesOwn) {
  fs::create_directories(root_ / "a/b");
  fs::create_symlink("a", root_ / "link");
  fs::create_symlink(root_ / "link/b", root_ / "a/further");
  const Directory directory = Directory::open(root_ / "a/further/../../link/./b/");
  directory.put("file", "text");
  EXPECT_EQ(text_of(root_ / "a/b/file"), "text");
  EXPECT_EQ(directory.distrust(), "");
  EXPECT_THROW(Directory::open(root_ / "a/none"), std::system_error);
}

TEST_F(Directories, StayWhatTheyAreWhenTheyAreRenamed) {
  const Directory directory = Directory::make(root_ / "first");
  EXPECT_TRUE(directory.is_new());
  fs::rename(root_ / "first", root_ / "second");
  fs::create_directory(root_ / "first");
  directory.put("file", "text");
  EXPECT_FALSE(fs::exists(root_ / "first/file"));
  EXPECT_EQ(text_of(root_ / "second/file"), "text");
  EXPECT_EQ(text_of(directory.way() / "file"), "text");
  EXPECT_FALSE(Directory::make(root_ / "first").is_new());
}

TEST_F(Directories, AreMadeWithThoseAboveThemAndNotForEverybody) {
  const mode_t before = umask(0);
  const Directory directory = Directory::make(root_ / "a/b/c");
  umask(before);
  EXPECT_EQ(directory.distrust(), "");
  EXPECT_TRUE(fs::is_directory(root_ / "a/b/c"));
  ASSERT_EQ(chmod((root_ / "a").c_str(), 01777), 0);
  EXPECT_EQ(Directory::open(root_ / "a").distrust(), "may be written to by everybody");
}

TEST_F(Directories, NeverWriteOverALink) {
  write(root_ / "file", "old");
  fs::create_symlink("file", root_ / "link");
  const Directory directory = Directory::open(root_);
  EXPECT_THAT(message<std::system_error>([&] { directory.create("link"); }),
              HasSubstr("cannot create \"" + (root_ / "link").string()));
  EXPECT_THROW(directory.create("file"), std::system_error);
  EXPECT_THROW(directory.read("link"), std::system_error);
  directory.put("link", "new");  // takes its place
  EXPECT_FALSE(fs::is_symlink(root_ / "link"));
  EXPECT_EQ(text_of(root_ / "link"), "new");
  EXPECT_EQ(text_of(root_ / "file"), "old");
  EXPECT_EQ(directory.read("file"), "old");
  EXPECT_EQ(directory.read("none"), std::nullopt);
  EXPECT_TRUE(directory.remove("link"));
  EXPECT_FALSE(directory.remove("link"));
}

TEST_F(AnotherUser, IsNotFollowed) {
  plant(root_ / "theirs/link", root_ / "ours");
  plant(root_ / "theirs/file", root_ / "ours/file");
  const auto refusal = [](const fs::path& path) {
    return message<UntrustedLink>([&] { Directory::make(path); });
  };
  EXPECT_EQ(refusal(root_ / "theirs/link/new"),
            '"' + (root_ / "theirs/link/new").string() +
                "\" leads over \"link\", a link of another user (uid 65534), which is not "
                "followed: name the place itself");
  EXPECT_THAT(refusal(root_ / "theirs/link"), HasSubstr("a link of another user"));
  EXPECT_THROW(Place::of(root_ / "theirs/file"), UntrustedLink);
  EXPECT_FALSE(fs::exists(root_ / "ours/new"));
}

TEST_F(AnotherUser, IsToldOfWhereItOwnsTheDirectory) {
  EXPECT_EQ(Directory::open(root_ / "theirs").distrust(), "belongs to another user (uid 65534)");
  EXPECT_EQ(Directory::make(root_ / "theirs/ours").distrust(), "");
}

TEST(UnguessableName, KeepsWhatItIsFor) {
  EXPECT_THAT(unguessable_name("report.html"), StartsWith(".report.html."));
  EXPECT_NE(unguessable_name("x"), unguessable_name("x"));
  EXPECT_LE(unguessable_name(std::string(255, 'x')).size(), 255U);
}

}  // namespace
}  // namespace cie
