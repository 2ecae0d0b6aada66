#include "proofs.hpp"

#include <array>
#include <cstdint>

namespace cie::analysis {
namespace {

template <typename Index>
std::uint64_t number_of(const std::optional<Index>& index) noexcept {
  return index ? std::uint64_t{1} + at(*index) : 0;
}

}  // namespace

std::size_t Proofs::Hash::operator()(const Subject& subject) const noexcept {
  std::uint64_t hash = static_cast<std::uint64_t>(subject.kind);
  for (const auto number : std::array{number_of(subject.process), number_of(subject.thread),
                                      number_of(subject.callback)}) {
    hash = (hash ^ number) * 0x9E3779B97F4A7C15U;
    hash ^= hash >> 32U;
  }
  return hash;
}

void Proofs::add(EventKinds kinds, const Scope& subject, TimeWindow window) {
  kinds.for_each([&](EventKind kind) {
    windows_[{subject.process, subject.thread, subject.callback, kind}].add(window);
  });
}

std::optional<Timestamp> Proofs::first_unproven(EventKind kind, const Scope& scope,
                                                TimeWindow window) const noexcept {
  // A proof holds for what belongs to all that it names.
  std::array<const Windows*, 8> holding{};
  std::size_t count = 0;
  for (unsigned named = 0; named < 8; ++named) {
    const bool names_process = (named & 1U) != 0;
    const bool names_thread = (named & 2U) != 0;
    const bool names_callback = (named & 4U) != 0;
    if ((names_process && !scope.process) || (names_thread && !scope.thread) ||
        (names_callback && !scope.callback)) {
      continue;
    }
    const auto found = windows_.find({.process = names_process ? scope.process : std::nullopt,
                                      .thread = names_thread ? scope.thread : std::nullopt,
                                      .callback = names_callback ? scope.callback : std::nullopt,
                                      .kind = kind});
    if (found != windows_.end()) {
      holding.at(count++) = &found->second;
    }
  }
  auto time = window.from;
  for (std::size_t i = 0; i < count;) {
    if (time > window.to) {
      return std::nullopt;
    }
    const auto end = holding.at(i)->end_of_window_at(time);
    if (!end) {
      ++i;
    } else if (*end == kLatest) {
      return std::nullopt;
    } else {
      time = Timestamp{end->ns + 1};
      i = 0;  // another proof may go on there
    }
  }
  return time <= window.to ? std::optional{time} : std::nullopt;
}

}  // namespace cie::analysis
