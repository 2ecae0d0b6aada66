#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include <ctf/metadata/metadata_file.hpp>
#include <ctf/metadata/metadata_parser.hpp>
#include <ctf/program/trace_plan.hpp>

namespace {

using namespace cie::analysis::ctf;

// A plan for every stream and event that the metadata declares. Empty: there can be none.
std::optional<bool> is_all_understood(const std::string& text,
                                      const std::function<bool(std::string_view)>& is_wanted) {
  bool is_good = true;
  try {
    const auto metadata = parse_metadata(text, is_wanted);
    const TracePlan plan(metadata);
    for (const auto& [id, stream] : metadata.streams) {
      if (plan.find(id) == nullptr) std::abort();
    }
    for (const auto& event : metadata.events) {
      const auto* found = plan.find(event.stream)->find(event.id);
      if (found == nullptr || found->name != event.name) std::abort();
      is_good = is_good && !found->is_malformed;
    }
  } catch (const MetadataError&) {
    return std::nullopt;
  }
  return is_good;
}

}  // namespace

// Bytes end in a plan, in which classes may be malformed, or in a MetadataError. Whether the fields of
// classes are read at once or when they are asked for makes no difference to what is understood.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string text;
  try {
    text = metadata_text({reinterpret_cast<const char*>(data), size});
  } catch (const MetadataError&) {
    return 0;
  }
  const auto at_once = is_all_understood(text, {});
  const auto when_asked_for = is_all_understood(text, [](std::string_view) { return false; });
  if (at_once && when_asked_for != at_once) std::abort();
  return 0;
}
