// For functions fields(visit, object), which name the members of an object once for whoever writes
// or reads them.
#pragma once

#include <concepts>
#include <type_traits>

namespace cie {

// `T` is an `Object` that is written, or one that is read.
template <typename T, typename Object>
concept Is = std::same_as<std::remove_const_t<T>, Object>;

}  // namespace cie
