#include "base64.hpp"

#include <cie/tracepoints/sha256.hpp>

#include <array>
#include <cstddef>

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>

namespace cie::viewer_export {
namespace {

// Whole groups of three bytes only: beyond an incomplete one the iterator would read.
using Digits = boost::archive::iterators::base64_from_binary<
    boost::archive::iterators::transform_width<const char*, 6, 8>>;
constexpr std::size_t kGroup = 3;

}  // namespace

std::string base64(std::string_view bytes) {
  const auto rest = bytes.size() % kGroup;
  const auto* const end = bytes.data() + (bytes.size() - rest);
  std::string text;
  text.reserve((bytes.size() + kGroup - 1) / kGroup * 4);
  text.assign(Digits(bytes.data()), Digits(end));
  if (rest == 0) return text;
  std::array<char, kGroup> last{};
  bytes.copy(last.data(), rest, bytes.size() - rest);
  text.append(Digits(last.data()), Digits(last.data() + kGroup));
  text.replace(text.size() - (kGroup - rest), kGroup - rest, kGroup - rest, '=');
  return text;
}

std::string csp_hash(std::string_view text) {
  const auto digest = sha256(text);
  return "sha256-" + base64({reinterpret_cast<const char*>(digest.data()), digest.size()});
}

}  // namespace cie::viewer_export
