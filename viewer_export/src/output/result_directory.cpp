#include "result_directory.hpp"

#include <cie/viewer_export/output_file.hpp>

#include "base/directory.hpp"
#include "base/text.hpp"

#include <exception>
#include <string>
#include <system_error>

namespace cie::viewer_export {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& directory, const std::string& why) {
  throw WriteError("cannot make " + directory.string() + ": " + why);
}

}  // namespace

void make_result_directory(const std::filesystem::path& directory) {
  try {
    const Directory made = Directory::make(directory);
    if (const auto why = made.distrust(); !why.empty()) {
      refuse(directory, "it is there and " + why + ", who could put links in the way of its files");
    }
  } catch (const UntrustedLink& link) {
    refuse(directory, link.what());
  } catch (const std::system_error& error) {
    refuse(directory, error.code().message());
  }
}

}  // namespace cie::viewer_export
