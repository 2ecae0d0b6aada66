#include "output/base64.hpp"

#include <string>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

TEST(Base64, IsThatOfRfc4648) {  // its section 10
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

TEST(Base64, HasAllDigitsForAllBytes) {
  // 64 digits in order, which are 48 bytes: 0x00 0x10 0x83 ...
  std::string bytes;
  for (unsigned digit = 0; digit < 64; digit += 4) {
    const auto group = digit << 18U | (digit + 1) << 12U | (digit + 2) << 6U | (digit + 3);
    for (const auto shift : {16U, 8U, 0U})
      bytes += static_cast<char>(group >> shift & 0xffU);
  }
  EXPECT_EQ(base64(bytes), "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/");
}

TEST(Base64, HashesAsContentSecurityPoliciesWant) {
  // An example of Content Security Policy Level 3.
  EXPECT_EQ(csp_hash("doSomething();"), "sha256-RFWPLDbv2BY+rCkDzsE+0fr8ylGr2R2faWMhq4lfEQc=");
}

}  // namespace
}  // namespace cie::viewer_export
