// The tables of the provider's events, today's and those of older recordings, against the metadata of recordings.
// That today's is the provider's is shown where that tells of itself, too (tests/unit/tracepoints/provider_fields_test.cpp).
#include <algorithm>
#include <span>
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

void expect_same(const char* metadata, std::span<const ProviderEvent> state,
                 std::span<const ProviderEvent> events) {
  const auto recorded = parse_metadata(metadata_text(read_metadata(metadata)));
  for (const auto channel : {state, events}) {
    for (const auto& event : channel) {
      const auto known = parse_metadata(trace_text({}) + stream_text(0) + event_text(event, 0, 0));
      const auto* of_tracer = find(recorded, event.name);
      ASSERT_NE(of_tracer, nullptr) << event.name;
      EXPECT_EQ(description(*fields_of(known, known.events.at(0))),
                description(*fields_of(recorded, *of_tracer)))
          << event.name;
    }
  }
}

TEST(ProviderSchema, IsWhatTheTracerRecords) {
  expect_same(CIE_RECORDED_METADATA, state_channel_events(), event_channel_events());
}

// Without the last field of run_begin, and without the last event.
TEST(ProviderSchema, OfOlderRecordingsIsWhatTheTracerRecorded) {
  const auto events = event_channel_events();
  expect_same(CIE_OLD_RECORDED_METADATA, old_state_channel_events(),
              events.first(events.size() - 1));
}

}  // namespace
}  // namespace cie::analysis::ctf
