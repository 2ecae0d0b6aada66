// A debug check of the order in which a class declares its members.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace cie {
namespace detail {

struct MemberExtent {
  std::uintptr_t begin;
  std::size_t size;
  std::size_t alignment;
};

template <typename Member>
MemberExtent extent_of(const Member& member) noexcept {
  return {.begin = reinterpret_cast<std::uintptr_t>(&member),
          .size = sizeof(Member),
          .alignment = alignof(Member)};
}

constexpr std::uintptr_t aligned(std::uintptr_t place, std::size_t alignment) noexcept {
  return (place + alignment - 1) / alignment * alignment;
}

}  // namespace detail

// Throws std::logic_error unless `last` are the last members of `owner`, in whatever order among
// themselves. Members are destroyed from the last to the first: of a class whose callbacks use its
// members, either the node or the handles must be the last ones, or the callbacks may run while what
// they use is gone. Call it in the constructor: check_member_order(*this, timer_, subscription_).
// Like assert(), it does nothing where NDEBUG is defined. What a derived class adds would go first,
// so the class must be final. Sees everything but a member that fits where the compiler pads.
// Any thread; neither allocates nor locks unless it throws.
template <typename Owner, typename... Members>
void check_member_order(const Owner& owner, const Members&... last) {
  static_assert(std::is_final_v<Owner>,
                "members of a derived class are destroyed before these: make the class final");
  static_assert(sizeof...(Members) > 0, "name the members that stand last");
#ifdef NDEBUG
  static_cast<void>(owner);
  (static_cast<void>(last), ...);
#else
  const auto whole = detail::extent_of(owner);
  std::array extents{detail::extent_of(last)...};
  std::ranges::sort(extents, {}, &detail::MemberExtent::begin);
  if (extents.front().begin < whole.begin ||
      extents.back().begin + extents.back().size > whole.begin + whole.size) {
    throw std::logic_error{"check_member_order: it was given what is no member of the object"};
  }
  auto end = extents.front().begin;
  const auto refuse_if = [&](bool is_wrong) {
    if (!is_wrong) return;
    throw std::logic_error{
        "check_member_order: at byte " + std::to_string(end - whole.begin) +
        " of the object is a member that is destroyed before a callback that may use it has ended: "
        "declare it further up"};
  };
  for (const auto& member : extents) {
    refuse_if(member.begin != detail::aligned(end, member.alignment));
    end = member.begin + member.size;
  }
  refuse_if(whole.begin + whole.size != detail::aligned(end, whole.alignment));
#endif
}

}  // namespace cie
