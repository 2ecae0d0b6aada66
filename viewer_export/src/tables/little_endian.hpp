// Numbers as Parquet and RowBinary store them.
#pragma once

#include <string>
#include <type_traits>

namespace cie::viewer_export {

// The bytes of `value` as they lie in memory: little endian on every machine that is supported.
template <typename Number>
void append_little_endian(std::string& out, Number value) {
  static_assert(std::is_trivially_copyable_v<Number>);
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace cie::viewer_export
