#include "pinned_library.hpp"

#include <dlfcn.h>
#include <link.h>

namespace cie::executor {

std::shared_ptr<void> pin_library_of(const void* code) {
  Dl_info info{};
  void* entry = nullptr;
  if (dladdr1(code, &info, &entry, RTLD_DL_LINKMAP) == 0 || entry == nullptr) return nullptr;
  const auto* const map = static_cast<const link_map*>(entry);
  if (map->l_name == nullptr || map->l_name[0] == '\0') return nullptr;
  void* const handle = dlopen(map->l_name, RTLD_LAZY | RTLD_NOLOAD);
  if (handle == nullptr) return nullptr;
  return {handle, [](void* library) { dlclose(library); }};
}

}  // namespace cie::executor
