#include "version_text.hpp"

#include <cie/viewer_export/version.hpp>

#include <fmt/core.h>
#include <gcrypt.h>
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
  return text + fmt::format("libgcrypt {}, SQLite {}, zlib {}\n", gcry_check_version(nullptr),
                            sqlite3_libversion(), zlibVersion());
}

}  // namespace cie::cli
