// What the provider writes, its reader uses: each event that is recorded, each field, as the provider has it. What
// becomes metadata is the provider's own description of itself: it stands for what is written.
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include "provider/provider.h"

#include <algorithm>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <ctf/salvage/provider_schema.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vocabulary/vocabulary.hpp>

namespace cie::analysis {
namespace {

constexpr std::string_view kTrigger = "cie:deadline_miss";  // no recording holds it

using Texts = std::vector<std::string>;

std::string integer(unsigned bits, bool is_signed) {
  return (is_signed ? "i" : "u") + std::to_string(bits);
}

std::string kind_of(const lttng_ust_type_common& type) {
  switch (type.type) {
    case lttng_ust_type_integer: {
      const auto& number = reinterpret_cast<const struct lttng_ust_type_integer&>(type);
      return integer(number.size, number.signedness != 0);
    }
    case lttng_ust_type_string:
      return "text";
    case lttng_ust_type_enum:
      return "label";
    case lttng_ust_type_sequence:
      return "sequence";
    default:
      return "unknown";
  }
}

std::string kind_of(ProviderField::Kind kind) {
  using enum ProviderField::Kind;
  switch (kind) {
    case u32:
    case i32:
      return integer(32, kind == i32);
    case u64:
    case count:
      return integer(64, false);
    case i64:
    case realtime:
    case realtime_or_nothing:
      return integer(64, true);
    case label:
      return "label";
    case text:
      return "text";
    case u32_sequence:
      return "sequence";
    case characters:
      return "unknown";
  }
  return {};
}

// "period_ns u64".
Texts written(const lttng_ust_event_desc& event) {
  Texts fields;
  for (const auto* field : std::span(event.tp_class->fields, event.tp_class->nr_fields)) {
    if (field->name[0] == '_') continue;  // LTTng's own: a sequence's length
    fields.push_back(std::string(field->name) + ' ' + kind_of(*field->type));
  }
  return fields;
}

Texts read(const ProviderEvent& event) {
  Texts fields;
  for (const auto& field : event.fields)
    fields.push_back(std::string(field.name) + ' ' + kind_of(field.kind));
  return fields;
}

const ProviderEvent* find(std::string_view name) {
  for (const auto channel : {ctf::state_channel_events(), ctf::event_channel_events()}) {
    const auto found = std::ranges::find(channel, name, &ProviderEvent::name);
    if (found != channel.end()) return &*found;
  }
  return nullptr;
}

Texts names_of(const Translation& translation) {
  Texts names;
  for (const auto& field : translation.fields)
    names.emplace_back(field.names);
  return names;
}

Texts names_of(const ProviderEvent& event) {
  Texts names;
  for (const auto& field : event.fields)
    names.emplace_back(field.name);
  return names;
}

TEST(ProviderFields, AreThoseThatTheReaderAsksFor) {
  const auto& provider = lttng_ust__probe_desc___cie;
  ASSERT_GT(provider.nr_events, 0U);
  for (const auto* event : std::span(provider.event_desc, provider.nr_events)) {
    const auto name = "cie:" + std::string(event->event_name);
    if (name == kTrigger) continue;
    const auto* known = find(name);
    const auto* translation = find_translation(name);
    ASSERT_NE(known, nullptr) << name;
    EXPECT_EQ(read(*known), written(*event)) << name;
    ASSERT_NE(translation, nullptr) << name;
    EXPECT_EQ(names_of(*translation), names_of(*known)) << name;
  }
}

}  // namespace
}  // namespace cie::analysis
