#include "copies.hpp"

#include <cstddef>
#include <functional>
#include <string_view>
#include <variant>

namespace cie::analysis::ros2 {
namespace {

class Digest {
 public:
  void add(std::uint64_t value) noexcept { value_ = (value_ ^ value) * kPrime; }
  template <typename... Values>
  void add(Values... values) noexcept {
    (add(static_cast<std::uint64_t>(values)), ...);
  }
  std::uint64_t value() const noexcept { return value_; }

 private:
  static constexpr std::uint64_t kPrime = 0x100000001b3;  // FNV-1a
  std::uint64_t value_ = 0xcbf29ce484222325;
};

std::uint64_t digest_of(const Translation& translation, const Payload& fields) {
  Digest digest;
  // A session may lack the context that has the thread's name.
  const auto count = translation.fields.size() - (translation.has_thread_name ? 1 : 0);
  for (std::size_t i = 0; i < count; ++i) {
    if (const auto number = fields.integer(i)) digest.add(*number);
    digest.add(std::hash<std::string_view>{}(fields.text(i)));
    for (const auto element : fields.integers(i))
      digest.add(element);
  }
  return digest.value();
}

}  // namespace

std::optional<std::uint64_t> digest_of(const EventBody& body) {
  const auto of = [&body](auto... told) {
    Digest digest;
    digest.add(body.index(), told...);
    return std::optional(digest.value());
  };
  return std::visit(
      Overloaded{[&](const CallbackRelease& e) { return of(e.callback, e.release_seq); },
                 [&](const ThreadWakeup& e) { return of(e.callback); },
                 [&](const CallbackStart& e) { return of(e.callback, e.seq); },
                 [&](const CallbackEnd& e) { return of(e.callback, e.seq); },
                 [&](const Publish& e) { return of(e.publisher, e.seq); },
                 [&](const PublishFailed& e) { return of(e.publisher, e.total); },
                 [&](const SampleLost& e) { return of(e.callback, e.total); },
                 [&](const ClockSync& e) { return of(e.monotonic_ns); },
                 [&](const ThreadSched& e) { return of(e.tid, e.n); },
                 [&](const RunBegin& e) { return of(e.monotonic_ns); },
                 [&](const RunEnd&) { return of(); },
                 [&](const CallbackFini& e) { return of(e.callback); },
                 [&](const PublisherFini& e) { return of(e.publisher); },
                 [&](const ThreadFini& e) { return of(e.tid); },
                 [](const auto& /*event*/) { return std::optional<std::uint64_t>{}; }},
      body);
}

bool LastRecorded::is_copy(std::uint32_t trace, const Translation& translation,
                           const Payload& fields) {
  return is_copy(trace, &translation, digest_of(translation, fields));
}

bool LastRecorded::is_copy(std::uint32_t trace, std::uint64_t digest) {
  return is_copy(trace, nullptr, digest);
}

bool LastRecorded::is_copy(std::uint32_t trace, const Translation* translation,
                           std::uint64_t digest) {
  const auto bit = std::uint64_t{1} << trace % 64;
  if (translation_ == translation && digest_ == digest && (traces_ & bit) == 0) {
    traces_ |= bit;
    return true;
  }
  translation_ = translation;
  digest_ = digest;
  traces_ = bit;
  return false;
}

}  // namespace cie::analysis::ros2
