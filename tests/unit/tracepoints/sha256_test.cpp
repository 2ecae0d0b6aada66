#include <cie/tracepoints/sha256.hpp>

#include "support/temporary_directory.hpp"

#include <fstream>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace cie {
namespace {

// Examples of NIST's for FIPS 180-4.
constexpr const char* kOfNothing =
    "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";
constexpr const char* kOfAbc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
constexpr const char* kOfAMillionA =
    "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0";

TEST(Sha256, IsThatOfFips180) {
  EXPECT_EQ(sha256_hex(""), kOfNothing);
  EXPECT_EQ(sha256_hex("abc"), kOfAbc);
  EXPECT_EQ(sha256_hex("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256("abc").front(), 0xba);
  EXPECT_EQ(sha256("abc").back(), 0xad);
}

TEST(Sha256, OfAFileIsThatOfItsBytes) {
  const test::TemporaryDirectory scratch;
  const auto file = scratch.path() / "a";
  std::ofstream(file) << std::string(1'000'000, 'a');  // many blocks, the last one not whole
  EXPECT_EQ(sha256_file(file), kOfAMillionA);
  std::ofstream(file, std::ios::trunc).close();
  EXPECT_EQ(sha256_file(file), kOfNothing);
  EXPECT_THROW(sha256_file(scratch.path() / "none"), std::system_error);
  EXPECT_THROW(sha256_file(scratch.path()), std::system_error);
}

TEST(Sha256, MayBeAskedForFirstBySeveralThreads) {
  std::vector<std::string> digests(8);
  {
    std::vector<std::jthread> threads;
    for (auto& digest : digests)
      threads.emplace_back([&digest] { digest = sha256_hex("abc"); });
  }
  EXPECT_EQ(digests, std::vector<std::string>(8, kOfAbc));
}

}  // namespace
}  // namespace cie
