#include "warnings.hpp"

#include <cstdio>
#include <mutex>

namespace cie::executor {

void Warnings::tell(const std::string& text) noexcept try {
  {
    const std::lock_guard lock{mutex_};
    if (!told_.insert(text).second) return;
  }
  if (handler_) {
    handler_(text);
  } else {
    std::fprintf(stderr, "cie: %s\n", text.c_str());
  }
} catch (...) {
  // Nobody could be told of this either.
}

}  // namespace cie::executor
