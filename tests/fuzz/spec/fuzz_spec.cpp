#include <cie/tracepoints/scheduling_spec.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

// An accepted spec answers for its own entries; anything else is a SpecError.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const auto spec = cie::SchedulingSpec::parse(
        std::string_view(reinterpret_cast<const char*>(data), size), "fuzz.yaml");
    for (const auto& entry : spec.callbacks()) {
      const auto id =
          entry.is_wildcard() ? entry.id.substr(0, entry.id.size() - 2) + "@Timer(1)" : entry.id;
      const auto* found = spec.find_callback(id);
      if (found == nullptr || (found != &entry && found->is_wildcard())) std::abort();
    }
    for (const auto& entry : spec.threads()) {
      if (spec.find_thread(entry.id) != &entry) std::abort();
    }
  } catch (const cie::SpecError&) {  // the other answer
  }
  return 0;
}
