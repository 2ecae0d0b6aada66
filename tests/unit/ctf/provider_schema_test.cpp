// The table of the provider's events against the metadata of a recording of it, which is one without the last
// field of run_begin and without publish_failed. That the table of today is the provider's is shown where that tells of itself
// (tests/unit/tracepoints/provider_fields_test.cpp).
#include <algorithm>
#include <string>
#include <string_view>

#include <ctf/metadata/metadata_file.hpp>
#include <ctf/metadata/metadata_parser.hpp>
#include <ctf/salvage/provider_schema.hpp>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

// What a reader goes by.
std::string description(const Type& type) {
  std::string text = std::to_string(static_cast<int>(type.kind)) + ", " +
                     std::to_string(type.size) + (type.is_signed ? " bits signed" : " bits") +
                     ", aligned to " + std::to_string(type.align);
  if (type.is_text) text += ", text";
  for (const auto& range : type.ranges)
    text += ' ' + range.label + '=' + std::to_string(range.low) + ".." + std::to_string(range.high);
  if (type.length > 0) text += ", " + std::to_string(type.length) + " elements";
  if (!type.reference.empty()) text += ", as many as " + type.reference;
  if (type.element) text += " of (" + description(*type.element) + ')';
  for (const auto& member : type.members)
    text += "\n  " + member.name + ": " + description(*member.type);
  return text;
}

const EventClass* find(const Metadata& metadata, std::string_view name) {
  const auto found = std::ranges::find(metadata.events, name, &EventClass::name);
  return found == metadata.events.end() ? nullptr : &*found;
}

TypeRef fields_of(const Metadata& metadata, const EventClass& event) {
  return event.fields ? event.fields : metadata.reader->read(event.unread_fields);
}

TEST(ProviderSchema, IsWhatTheTracerRecords) {
  const auto recorded = parse_metadata(metadata_text(read_metadata(CIE_RECORDED_METADATA)));
  for (const auto channel : {old_state_channel_events(), event_channel_events()}) {
    for (const auto& event : channel) {
      const auto known = parse_metadata(trace_text({}) + stream_text(0) + event_text(event, 0, 0));
      const auto* of_tracer = find(recorded, event.name);
      if (event.name == "cie:publish_failed") {  // of later recordings
        EXPECT_EQ(of_tracer, nullptr);
        continue;
      }
      ASSERT_NE(of_tracer, nullptr) << event.name;
      EXPECT_EQ(description(*fields_of(known, known.events.at(0))),
                description(*fields_of(recorded, *of_tracer)))
          << event.name;
    }
  }
}

}  // namespace
}  // namespace cie::analysis::ctf
