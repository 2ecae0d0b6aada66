#include "lttng/lttng_calls.hpp"

#include "system/error.hpp"

namespace cie::record {

void check(int result, const std::string& operation) {
  if (result < 0) {
    throw RecordError("cannot " + operation + ": " + lttng_strerror(result));
  }
}

lttng_domain user_space() {
  lttng_domain domain{};
  domain.type = LTTNG_DOMAIN_UST;
  domain.buf_type = LTTNG_BUFFER_PER_UID;
  return domain;
}

}  // namespace cie::record
