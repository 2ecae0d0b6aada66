#include <cie/tracepoints/scheduling_spec.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

// An accepted spec answers for its own entries; anything else is a SpecError.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const auto spec = cie::SchedulingSpec::parse(text, "fuzz.yaml");
    for (const auto& entry : spec.callbacks()) {
      const auto id =
          entry.is_wildcard() ? entry.id.substr(0, entry.id.size() - 2) + "@Timer(1)" : entry.id;
      const auto* found = spec.find_callback(id);
      if (found == nullptr || (found != &entry && found->is_wildcard())) std::abort();
    }
    for (const auto& entry : spec.threads()) {
      if (spec.find_thread(entry.id) != &entry) std::abort();
    }
    // The bytes as lscpu's words too; either answer is one.
    try {
      cie::check_hardware_info(spec, text);
    } catch (const cie::SpecError&) {
    }
    // What is good for all domains is good for one, with no more entries.
    const auto of_domain = cie::SchedulingSpec::parse(text, "fuzz.yaml", 1);
    if (of_domain.callbacks().size() > spec.callbacks().size() ||
        of_domain.threads().size() > spec.threads().size()) {
      std::abort();
    }
  } catch (const cie::SpecError&) {  // the other answer
  }
  return 0;
}
