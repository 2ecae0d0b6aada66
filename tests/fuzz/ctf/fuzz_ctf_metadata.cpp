#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include <ctf/metadata/metadata_file.hpp>
#include <ctf/metadata/metadata_parser.hpp>
#include <ctf/program/trace_plan.hpp>

// Bytes end in a plan for every stream and event that the metadata declares, or in a MetadataError.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace cie::analysis::ctf;
  try {
    const auto text = metadata_text({reinterpret_cast<const char*>(data), size});
    const auto metadata = parse_metadata(text);
    const TracePlan plan(metadata);
    for (const auto& [id, stream] : metadata.streams) {
      if (plan.find(id) == nullptr) std::abort();
    }
    for (const auto& event : metadata.events) {
      const auto* found = plan.find(event.stream)->find(event.id);
      if (found == nullptr || found->name != event.name) std::abort();
    }
  } catch (const MetadataError&) {  // the other answer
  }
  return 0;
}
