// Who a row is about: numbers that an analysis gives to what it meets, in the order in which it
// does. They stay the same as long as the analysis runs, so what is told of instances on the way
// belongs to the report's rows by them. Names, pids and tids may be the same on several hosts.
#pragma once

#include <cstddef>
#include <cstdint>

namespace cie::analysis {

enum class HostIndex : std::uint32_t {};
enum class ProcessIndex : std::uint32_t {};
enum class ThreadIndex : std::uint32_t {};
enum class CallbackIndex : std::uint32_t {};
enum class GroupIndex : std::uint32_t {};
enum class PublisherIndex : std::uint32_t {};
enum class ChainIndex : std::uint32_t {};

template <typename Index>
constexpr std::size_t at(Index index) noexcept {
  return static_cast<std::size_t>(index);
}

}  // namespace cie::analysis
