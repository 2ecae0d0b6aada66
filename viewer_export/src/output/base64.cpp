#include "base64.hpp"

#include <array>
#include <new>

#include <openssl/evp.h>

namespace cie::viewer_export {
namespace {

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

}  // namespace

std::string base64(std::string_view bytes) {
  constexpr std::size_t kPiece = 3U << 20U;  // EVP counts in int
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4 + 1);
  std::string part(kPiece / 3 * 4 + 1, '\0');
  while (!bytes.empty()) {
    const auto piece = bytes.substr(0, kPiece);
    const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(part.data()), bytes_of(piece),
                                     static_cast<int>(piece.size()));
    text.append(part, 0, static_cast<std::size_t>(size));
    bytes.remove_prefix(piece.size());
  }
  return text;
}

std::string csp_hash(std::string_view text) {
  std::array<char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (EVP_Digest(text.data(), text.size(), reinterpret_cast<unsigned char*>(digest.data()), &size,
                 EVP_sha256(), nullptr) != 1) {
    throw std::bad_alloc();  // the only way it fails
  }
  return "sha256-" + base64({digest.data(), size});
}

}  // namespace cie::viewer_export
