#include "mapped.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <dlfcn.h>
#include <elf.h>
#include <link.h>

namespace cie::container {
namespace {

// What the object says of itself. The dynamic linker has relocated the pointers already.
struct DynamicSection {
  ElfW(Xword) flags = 0;
  const ElfW(Sym) * symbols = nullptr;
  const std::uint32_t* gnu_hash = nullptr;
};

DynamicSection read_dynamic_section(const link_map& map) {
  DynamicSection section;
  for (const ElfW(Dyn)* entry = map.l_ld; entry != nullptr && entry->d_tag != DT_NULL; ++entry) {
    // Addresses are integers in ELF.
    if (entry->d_tag == DT_FLAGS_1) section.flags = entry->d_un.d_val;
    if (entry->d_tag == DT_SYMTAB) {
      // NOLINTNEXTLINE(performance-no-int-to-ptr)
      section.symbols = reinterpret_cast<const ElfW(Sym)*>(entry->d_un.d_ptr);
    }
    if (entry->d_tag == DT_GNU_HASH) {
      // NOLINTNEXTLINE(performance-no-int-to-ptr)
      section.gnu_hash = reinterpret_cast<const std::uint32_t*>(entry->d_un.d_ptr);
    }
  }
  return section;
}

// The symbols an object exports, which its GNU hash table covers: header (buckets, first symbol,
// words of the Bloom filter, shift), filter, buckets, chains whose last element is odd.
bool exports_unique_symbol(const DynamicSection& section) {
  if (section.symbols == nullptr || section.gnu_hash == nullptr) return false;
  const std::uint32_t* const header = section.gnu_hash;
  const std::uint32_t first = header[1];
  const std::size_t filter_words = header[2] * (sizeof(ElfW(Addr)) / sizeof(std::uint32_t));
  const std::span buckets{header + 4 + filter_words, header[0]};
  const std::uint32_t* const chains = buckets.data() + buckets.size();
  return std::ranges::any_of(buckets, [&](std::uint32_t symbol) {
    if (symbol < first) return false;  // an empty bucket
    for (;; ++symbol) {
      if (ELF64_ST_BIND(section.symbols[symbol].st_info) == STB_GNU_UNIQUE) return true;
      if ((chains[symbol - first] & 1U) != 0) return false;
    }
  });
}

}  // namespace

std::string why_still_mapped(const std::string& library) {
  void* const handle = dlopen(library.c_str(), RTLD_LAZY | RTLD_NOLOAD);
  if (handle == nullptr) return {};
  DynamicSection section;
  link_map* map = nullptr;
  if (dlinfo(handle, RTLD_DI_LINKMAP, &map) == 0) section = read_dynamic_section(*map);
  const bool is_unique = exports_unique_symbol(section);
  dlclose(handle);
  if ((section.flags & DF_1_NODELETE) != 0) {
    return "it is linked with -z nodelete, which forbids it";
  }
  if (is_unique) {
    return "it exports GNU unique symbols, which the dynamic linker keeps for ever: build it with "
           "cie_add_component() or -fno-gnu-unique";
  }
  return "a library that stays loaded needs it, somebody still has a message that it published as "
         "a "
         "shared_ptr, or a thread that lives on has run its code and keeps a thread_local object "
         "with a destructor";
}

}  // namespace cie::container
