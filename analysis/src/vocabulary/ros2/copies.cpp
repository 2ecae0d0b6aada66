#include "copies.hpp"

#include <cstddef>
#include <functional>
#include <string_view>

namespace cie::analysis::ros2 {
namespace {

std::uint64_t digest_of(const Translation& translation, const Payload& fields) {
  constexpr std::uint64_t kPrime = 0x100000001b3;  // FNV-1a
  std::uint64_t digest = 0xcbf29ce484222325;
  const auto add = [&digest](std::uint64_t value) { digest = (digest ^ value) * kPrime; };
  // A session may lack the context that has the thread's name.
  const auto count = translation.fields.size() - (translation.has_thread_name ? 1 : 0);
  for (std::size_t i = 0; i < count; ++i) {
    if (const auto number = fields.integer(i)) add(static_cast<std::uint64_t>(*number));
    add(std::hash<std::string_view>{}(fields.text(i)));
    for (const auto element : fields.integers(i))
      add(element);
  }
  return digest;
}

}  // namespace

bool LastRecorded::is_copy(std::uint32_t trace, const Translation& translation,
                           const Payload& fields) {
  const auto digest = digest_of(translation, fields);
  const auto bit = std::uint64_t{1} << trace % 64;
  if (translation_ == &translation && digest_ == digest && (traces_ & bit) == 0) {
    traces_ |= bit;
    return true;
  }
  translation_ = &translation;
  digest_ = digest;
  traces_ = bit;
  return false;
}

}  // namespace cie::analysis::ros2
