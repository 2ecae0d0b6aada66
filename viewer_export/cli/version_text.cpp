#include "version_text.hpp"

#include <cie/viewer_export/version.hpp>

#include <babeltrace2/babeltrace.h>
#include <fmt/core.h>
#include <openssl/crypto.h>
#include <sqlite3.h>
#include <zlib.h>

namespace cie::cli {
namespace {

#ifdef __clang__
constexpr auto kCompiler = "clang " __clang_version__;
#else
constexpr auto kCompiler = "g++ " __VERSION__;
#endif

}  // namespace

std::string version_text() {
  auto text = fmt::format("cie {}\n", viewer_export::tool_version());
  if (!built_commit().empty()) text += fmt::format("commit {}, ", built_commit());
  text += fmt::format("built with {}\n", kCompiler);
  return text + fmt::format("libbabeltrace2 {}.{}.{}, OpenSSL {}, SQLite {}, zlib {}\n",
                            bt_version_get_major(), bt_version_get_minor(), bt_version_get_patch(),
                            OpenSSL_version(OPENSSL_VERSION_STRING), sqlite3_libversion(),
                            zlibVersion());
}

}  // namespace cie::cli
