#include "copies.hpp"

#include "vocabulary/event_batch.hpp"

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

// What tells an event from others of its thread.
std::uint64_t digest_of(const EventBody& body) {
  Digest digest;
  digest.add(body.index());
  std::visit(
      Overloaded{[&](const CallbackRelease& e) { digest.add(e.callback, e.release_seq); },
                 [&](const ThreadWakeup& e) { digest.add(e.callback); },
                 [&](const CallbackStart& e) { digest.add(e.callback, e.seq); },
                 [&](const CallbackEnd& e) { digest.add(e.callback, e.seq); },
                 [&](const Publish& e) { digest.add(e.publisher, e.seq); },
                 [&](const SampleLost& e) { digest.add(e.callback, e.total); },
                 [&](const ClockSync& e) { digest.add(e.monotonic_ns); },
                 [&](const ThreadSched& e) { digest.add(e.tid, e.n); },
                 [&](const RunBegin& e) { digest.add(e.monotonic_ns); },
                 [&](const CallbackFini& e) { digest.add(e.callback); },
                 [&](const PublisherFini& e) { digest.add(e.publisher); },
                 [&](const ThreadFini& e) { digest.add(e.tid); }, [](const auto& /*event*/) {}},
      body);
  return digest.value();
}

}  // namespace

bool LastRecorded::knows_copies_of(const EventBody& body) noexcept {
  constexpr auto kKnown =
      kinds<CallbackRelease, ThreadWakeup, CallbackStart, CallbackEnd, Publish, SampleLost,
            ClockSync, ThreadSched, RunBegin, CallbackFini, PublisherFini, ThreadFini, RunEnd>();
  return (kKnown >> body.index() & 1U) != 0;
}

bool LastRecorded::is_copy(std::uint32_t trace, const Translation& translation,
                           const Payload& fields) {
  return is_copy(trace, &translation, digest_of(translation, fields));
}

bool LastRecorded::is_copy(std::uint32_t trace, const EventBody& body) {
  return is_copy(trace, nullptr, digest_of(body));
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
