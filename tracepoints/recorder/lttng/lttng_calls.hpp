// What calls of liblttng-ctl have in common.
#pragma once

#include <memory>
#include <string>

#include <lttng/lttng.h>

namespace cie::record {

// LTTng's functions return a negative error code, or, the older ones, a positive LTTNG_OK. Throws
// RecordError for the former, naming the operation.
void check(int result, const std::string& operation);

template <typename T, void (*Destroy)(T*)>
struct Destroyer {
  void operator()(T* object) const noexcept { Destroy(object); }
};

lttng_domain user_space();

}  // namespace cie::record
