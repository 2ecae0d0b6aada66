#include <cie/tracepoints/sha256.hpp>

#include "base/file.hpp"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <span>
#include <string>
#include <system_error>

#include <gcrypt.h>

namespace cie {
namespace {

constexpr std::size_t kBytes = 32;
constexpr std::size_t kBlock = 65'536;  // that is read at once

// Once per process, unless the application did: libgcrypt wants to be asked for its version first.
// Nothing here is secret.
void prepare_library() {
  static const bool is_prepared = [] {
    if (gcry_control(GCRYCTL_INITIALIZATION_FINISHED_P) != 0) return true;
    gcry_check_version(nullptr);
    gcry_control(GCRYCTL_DISABLE_SECMEM, 0);
    gcry_control(GCRYCTL_INITIALIZATION_FINISHED, 0);
    return true;
  }();
  static_cast<void>(is_prepared);
}

struct CloseHash {
  void operator()(gcry_md_handle* hash) const noexcept { gcry_md_close(hash); }
};

class Sha256 {
 public:
  Sha256() {
    prepare_library();
    gcry_md_hd_t hash = nullptr;
    if (gcry_md_open(&hash, GCRY_MD_SHA256, 0) != 0) throw std::bad_alloc();
    hash_.reset(hash);
  }
  void update(const void* bytes, std::size_t size) { gcry_md_write(hash_.get(), bytes, size); }
  std::span<const std::uint8_t> finish() {
    return {gcry_md_read(hash_.get(), GCRY_MD_SHA256), kBytes};
  }

 private:
  std::unique_ptr<gcry_md_handle, CloseHash> hash_;
};

std::string hex(std::span<const std::uint8_t> digest) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(2 * digest.size());
  for (const auto byte : digest) {
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 0xfU];
  }
  return text;
}

}  // namespace

std::array<std::uint8_t, kBytes> sha256(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes.data(), bytes.size());
  std::array<std::uint8_t, kBytes> digest{};
  std::ranges::copy(hash.finish(), digest.begin());
  return digest;
}

std::string sha256_hex(std::string_view bytes) { return hex(sha256(bytes)); }

std::string sha256_file(const std::filesystem::path& file) {
  try {
    const FileDescriptor opened = open_to_read(file);
    Sha256 hash;
    for (std::string block; !(block = read_all(opened, kBlock)).empty();)
      hash.update(block.data(), block.size());
    return hex(hash.finish());
  } catch (const std::system_error& error) {
    throw std::system_error(error.code(), "cannot read " + file.string());
  }
}

}  // namespace cie
