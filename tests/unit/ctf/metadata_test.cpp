// What CTF 1.8 metadata says, and what none may say.
#include "metadata_error.hpp"

#include <string>
#include <string_view>

#include <ctf/metadata/metadata_file.hpp>
#include <ctf/metadata/metadata_parser.hpp>
#include <ctf/program/trace_plan.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

using cie::test::error_of;
using testing::HasSubstr;

constexpr const char* kTrace = "trace { major = 1; minor = 8; byte_order = le; };\n";

Metadata parse(const std::string& text) { return parse_metadata(kTrace + text); }

// The type of the only field of the only event.
TypeRef field(const std::string& declarations, const std::string& declaration) {
  const auto metadata =
      parse(declarations + "event { id = 0; fields := struct { " + declaration + " }; };");
  return metadata.events.at(0).fields->members.at(0).type;
}

TEST(Metadata, TraceAndEnvironment) {
  const auto metadata = parse_metadata(
      "/* CTF 1.8 */ trace { major = 1; minor = 8; byte_order = be;\n"
      "uuid = \"3EC751a9-cc27-5c63-9d86-2a554687f351\"; }; // comment\n"
      "env { hostname = \"robot \\\"1\\\"\"; tracer_major = 2; low = -3; };");
  EXPECT_EQ(metadata.byte_order, ByteOrder::big);
  EXPECT_EQ(metadata.uuid, "3ec751a9-cc27-5c63-9d86-2a554687f351");
  EXPECT_EQ(metadata.environment.at("hostname"), "robot \"1\"");
  EXPECT_EQ(metadata.environment.at("tracer_major"), "2");
  EXPECT_EQ(metadata.environment.at("low"), "-3");
}

TEST(Metadata, Clock) {
  const auto metadata = parse(
      "clock { name = \"monotonic\"; uuid = \"u\"; description = \"d\"; freq = 1000;\n"
      "precision = 1; offset_s = -2; offset = 0x10; absolute = FALSE; };");
  const auto& clock = metadata.clocks.at(0);
  EXPECT_EQ(clock.name, "monotonic");
  EXPECT_EQ(clock.frequency, 1000U);
  EXPECT_EQ(clock.offset_s, -2);
  EXPECT_EQ(clock.offset, 16);
}

TEST(Metadata, IntegerAttributes) {
  const auto type = field("",
                          "integer { size = 27; align = 2; signed = true; byte_order = be; "
                          "base = hex; encoding = UTF8; map = clock.c.value; } x;");
  EXPECT_EQ(type->kind, Type::Kind::integer);
  EXPECT_EQ(type->size, 27U);
  EXPECT_EQ(type->align, 2U);
  EXPECT_TRUE(type->is_signed);
  EXPECT_TRUE(type->is_text);
  EXPECT_EQ(type->byte_order, ByteOrder::big);
  EXPECT_EQ(type->clock, "c");
}

TEST(Metadata, AlignmentIsAByteForWholeBytesAndABitOtherwise) {
  EXPECT_EQ(field("", "integer { size = 16; } x;")->align, 8U);
  EXPECT_EQ(field("", "integer { size = 9; } x;")->align, 1U);
}

// A kernel's metadata repeat a few integers some thousand times.
TEST(Metadata, IntegersThatAreWrittenAlikeAreAlike) {
  const auto metadata = parse(
      "event { id = 0; fields := struct { integer { size = 8; signed = 1; } a, b[2];\n"
      " integer { size = 8; signed = 1; } c; integer { size = 8; signed = 0; } d;\n"
      " integer { /* } */ size = 16; } e; integer { /* } */ size = 32; } f; }; };");
  const auto& members = metadata.events.at(0).fields->members;
  ASSERT_EQ(members.size(), 6U);
  EXPECT_TRUE(members[2].type->is_signed);
  EXPECT_FALSE(members[3].type->is_signed);
  EXPECT_EQ(members[4].type->size, 16U);
  EXPECT_EQ(members[5].type->size, 32U) << "the first } is of a comment";
}

TEST(Metadata, AliasesOfSeveralWordsAndDefinedTypes) {
  const std::string declarations =
      "typealias integer { size = 32; } := unsigned int;\n"
      "typedef integer { size = 7; } seven, sevens[3];\n"
      "typealias integer { size = 64; } := void *;\n";
  EXPECT_EQ(field(declarations, "unsigned int x;")->size, 32U);
  EXPECT_EQ(field(declarations, "const seven x;")->size, 7U);
  EXPECT_EQ(field(declarations, "void * x;")->size, 64U);
  const auto sevens = field(declarations, "sevens x;");
  EXPECT_EQ(sevens->kind, Type::Kind::array);
  EXPECT_EQ(sevens->length, 3U);
}

TEST(Metadata, ArraysOfArraysAndSequences) {
  const auto type =
      field("typealias integer { size = 8; } := u8;", "u8 x[2][stream.event.header.id][3];");
  EXPECT_EQ(type->length, 2U);
  EXPECT_EQ(type->element->kind, Type::Kind::sequence);
  EXPECT_EQ(type->element->reference, "stream.event.header.id");
  EXPECT_EQ(type->element->element->length, 3U);
}

TEST(Metadata, EnumerationCountsOnAndHasRanges) {
  const auto type = field(
      "", "enum : integer { size = 8; signed = 1; } { A, B = -3, C, \"d e\" = 5 ... 7, F } x;");
  ASSERT_EQ(type->ranges.size(), 5U);
  const auto low = [&](std::size_t i) { return static_cast<std::int64_t>(type->ranges[i].low); };
  EXPECT_EQ(low(0), 0);
  EXPECT_EQ(low(1), -3);
  EXPECT_EQ(low(2), -2);
  EXPECT_EQ(type->ranges[3].label, "d e");
  EXPECT_EQ(low(3), 5);
  EXPECT_EQ(type->ranges[3].high, 7U);
  EXPECT_EQ(low(4), 8);
}

TEST(Metadata, NamedTypesAreKnownInTheirBlockOnly) {
  const std::string structure = "struct pair { integer { size = 8; } a; } align(32);\n";
  EXPECT_EQ(field(structure, "struct pair x;")->align, 32U);
  EXPECT_THAT(error_of(kTrace + std::string("stream { struct pair { string s; }; };\n"
                                            "event { fields := struct { struct pair p; }; };")),
              HasSubstr("unknown type \"struct pair\""));
}

// A kernel declares a thousand classes, of which few have events.
struct UnreadFields : testing::Test {
  // Of `declaration`, an event's block, when nobody wants its class.
  static Metadata parse_unwanted(const std::string& text) {
    return parse_metadata(kTrace + text, [](std::string_view event) { return event == "wanted"; });
  }
  static bool is_left_unread(const std::string& block) {
    const auto metadata = parse_unwanted(
        "typealias integer { size = 8; } := u8;\n"
        "event { name = \"e\"; id = 0; " +
        block + " };");
    const auto& event = metadata.events.at(0);
    EXPECT_NE(event.unread_fields.empty(), event.fields == nullptr);
    return !event.unread_fields.empty();
  }
};

TEST_F(UnreadFields, AreReadWhenAskedFor) {
  const auto metadata = parse_unwanted(
      "event { name = \"wanted\"; id = 0; fields := struct { string s; }; };\n"
      "event { name = \"e\"; id = 1; fields := struct { integer { size = 8; } a[3]; }; };");
  EXPECT_EQ(metadata.events.at(0).fields->members.at(0).name, "s");
  const auto& unwanted = metadata.events.at(1);
  EXPECT_EQ(unwanted.fields, nullptr);
  const auto fields = metadata.reader->read(unwanted.unread_fields);
  EXPECT_EQ(fields->members.at(0).name, "a");
  EXPECT_EQ(fields->members.at(0).type->length, 3U);
}

TEST_F(UnreadFields, AreThoseThatCanBeReadAlone) {
  EXPECT_TRUE(is_left_unread("fields := struct { u8 a; enum : u8 { x, y = 3 } b[2]; };"));
  for (const auto* block :
       {"fields := struct { u8 n; u8 a[n]; };",
        "fields := struct { enum : u8 { x } t; variant <t> { u8 x; } v; };",
        "fields := struct { enum : u8 { \"}\" } a; };", "fields := struct { u8 a; /* } */ };",
        "fields := struct { u8 a; } align(32);",
        "typealias integer { size = 16; } := u8; fields := struct { u8 a; };",
        "context := struct { u8 c; }; fields := struct { u8 a; };",
        "fields := struct { u8 a; }; context := struct { u8 c; };",
        "fields := struct { u8 a; }; fields := struct { u8 b; };"})
    EXPECT_FALSE(is_left_unread(block)) << block;
  EXPECT_FALSE(parse_unwanted("event { fields := struct { string s; }; name = \"late\"; };")
                   .events.at(0)
                   .fields == nullptr)
      << "whether they are wanted was not known";
}

TEST_F(UnreadFields, OfTwoTheLastOnesCount) {
  const auto metadata = parse_unwanted(
      "event { name = \"e\"; fields := struct { string a; }; fields := struct { string b; }; };");
  EXPECT_EQ(metadata.events.at(0).fields->members.at(0).name, "b");
}

TEST_F(UnreadFields, KnowTheNamesOfTheirPlace) {
  const auto metadata = parse_unwanted(
      "typealias integer { size = 8; } := number;\n"
      "event { name = \"e\"; id = 0; fields := struct { number a; }; };\n"
      "typealias integer { size = 16; } := number;\n"
      "event { name = \"f\"; id = 1; fields := struct { number a; }; };");
  const auto size = [&metadata](const EventClass& event) {
    const auto fields = event.fields ? event.fields : metadata.reader->read(event.unread_fields);
    return fields->members.at(0).type->size;
  };
  EXPECT_EQ(size(metadata.events.at(0)), 8U);
  EXPECT_EQ(size(metadata.events.at(1)), 16U);
}

TEST_F(UnreadFields, AreWrongWhenTheyAreRead) {
  const auto metadata = parse_unwanted(
      "\nevent { name = \"e\"; id = 0; fields := struct {\n struct { unknown a; } s; }; };\n"
      "event { name = \"f\"; id = 1; fields := struct { string s; }; };");
  const auto read = [&metadata](std::size_t event) {
    return metadata.reader->read(metadata.events.at(event).unread_fields);
  };
  EXPECT_THAT([&] { read(0); },
              testing::ThrowsMessage<MetadataError>(HasSubstr("line 4: unknown type \"unknown\"")));
  EXPECT_EQ(read(1)->members.at(0).name, "s") << "what was wrong before is forgotten";
}

TEST_F(UnreadFields, MakeThePlanThatReadOnesMake) {
  const std::string text =
      "stream { event.header := struct { integer { size = 8; } id; integer { size = 64; } "
      "timestamp; }; };\n"
      "event { name = \"a\"; id = 0; fields := struct { integer { size = 8; } x[300]; }; };\n"
      "event { name = \"b\"; id = 1; fields := struct { string s; }; };\n"
      "event { name = \"c\"; id = 70000; fields := struct { integer { size = 64; } x; }; };";
  const TracePlan early(parse(text));
  const TracePlan late(parse_unwanted(text));
  const auto& stream = *late.find(0);
  EXPECT_LT(stream.most_fixed_bytes(), 300U);
  for (const std::uint64_t id : {0U, 1U, 70000U}) {
    const auto* expected = early.find(0)->find(id);
    const auto* found = stream.find(id);
    ASSERT_EQ(found->fixed.has_value(), expected->fixed.has_value()) << id;
    if (found->fixed) {
      EXPECT_EQ(found->fixed->bytes, expected->fixed->bytes) << id;
    }
    EXPECT_NE(found->fields, nullptr);
    EXPECT_EQ(found->number, expected->number);
  }
  EXPECT_EQ(stream.most_fixed_bytes(), early.find(0)->most_fixed_bytes());
  EXPECT_EQ(stream.fixed_events()[0].bytes, 300U);
  EXPECT_EQ(&late.event_class(stream.fixed_events()[0].event_class), stream.find(0));
}

TEST(Metadata, CallsitesAndUnknownAttributesAreSkipped) {
  const auto metadata = parse(
      "callsite { name = \"e\"; func = \"f\"; ip = 0x10; line = 3; };\n"
      "stream { id = 3; };\n"
      "event { name = \"a:b\"; id = 4; stream_id = 3; loglevel = 13; model.emf.uri = \"u\";\n"
      " separator = ';'; quote = '\\''; wide = L'\\x41'; };");
  EXPECT_EQ(metadata.events.at(0).name, "a:b");
  EXPECT_EQ(metadata.events.at(0).stream, 3U);
}

TEST(Metadata, ErrorsNameTheLine) {
  EXPECT_THAT(error_of("trace { major = 1;\n byte_order = le;\n };\nevent { id = ; };"),
              HasSubstr("line 4: expected a number, not \";\""));
  EXPECT_THAT(error_of("trace { byte_order = le; };\n\n/* no end"), HasSubstr("line 3"));
  const std::string integer = "integer {\n size = 8;\n }";
  EXPECT_THAT(error_of(kTrace + ("event { fields := struct {\n" + integer + " a;\n" + integer +
                                 " b;\n no_type c; }; };")),
              HasSubstr("line 9"));
  EXPECT_THAT(error_of("trace { major = 2; };"), HasSubstr("only CTF 1"));
  EXPECT_THAT(error_of(""), HasSubstr("no trace block"));
  EXPECT_THAT(error_of(kTrace + std::string("clock { freq = 0; };")),
              AllOf(HasSubstr("a clock must advance"), Not(HasSubstr(";"))));
  EXPECT_THAT(error_of("trace {"), HasSubstr("the end"));
}

TEST(Metadata, WhatCannotBeIsRefused) {
  const auto refused = [](const std::string& declaration) {
    return error_of(kTrace + ("event { fields := struct { " + declaration + " }; };"));
  };
  EXPECT_THAT(refused("integer { size = 65; } x;"), HasSubstr("1 to 64 bits"));
  EXPECT_THAT(refused("integer { align = 8; } x;"), HasSubstr("without a size"));
  EXPECT_THAT(refused("integer { size = 8; align = 3; } x;"), HasSubstr("power of two"));
  EXPECT_THAT(refused("integer { size = 99999999999999999999; } x;"), HasSubstr("64 bits"));
  EXPECT_THAT(refused("string s[nowhere];"), HasSubstr("\"nowhere\""));
  EXPECT_THAT(refused("string s; string t[s];"), HasSubstr("no integer before it"));
  EXPECT_THAT(refused("integer { size = 8; } t; variant <t> { string a; } v;"),
              HasSubstr("no enumeration"));
  EXPECT_THAT(error_of(kTrace + std::string("event { stream_id = 7; }; stream { id = 1; };")),
              HasSubstr("not declared"));
}

// An option without a label of the tag is never read; what it holds is not there for others.
TEST(Metadata, OptionsDoNotSeeEachOther) {
  EXPECT_THAT(error_of(kTrace + std::string("event { fields := struct {\n"
                                            "enum : integer { size = 8; } { a } tag;\n"
                                            "variant <tag> { integer { size = 8; } n;\n"
                                            " string a[n]; } v; }; };")),
              HasSubstr("\"n\", the length or tag of a field, is no integer before it"));
}

TEST(Metadata, NestingAndMultiplicationAreBounded) {
  std::string deep;
  for (int i = 0; i < 10'000; ++i)
    deep += "struct { ";
  EXPECT_THAT(error_of(kTrace + ("event { fields := " + deep)), HasSubstr("too deep"));
  // Forty structures of two of the next: 2^40 fields.
  std::string doubled = "struct s0 { integer { size = 8; } a; };\n";
  for (int i = 1; i < 40; ++i) {
    const auto inner = "struct s" + std::to_string(i - 1);
    doubled += "struct s" + std::to_string(i) + " { " + inner + " a; " + inner + " b; };\n";
  }
  EXPECT_THAT(error_of(kTrace + doubled + "event { fields := struct s39; };"),
              HasSubstr("more fields than"));
}

std::string metadata_packet(std::string_view text, std::size_t size, char compression = 0) {
  const auto u32 = [](std::size_t value) {
    std::string bytes;
    for (unsigned i = 0; i < 4; ++i)
      bytes += static_cast<char>(value >> 8 * i & 0xff);
    return bytes;
  };
  auto packet = u32(0x75D11D57) + std::string(16, 'u') + u32(0) + u32((37 + text.size()) * 8) +
                u32(size * 8) + compression + std::string(2, '\0') + "\x01\x08";
  packet += text;
  packet.resize(size, '\0');
  return packet;
}

TEST(MetadataFile, PacketsAreJoined) {
  EXPECT_EQ(metadata_text(metadata_packet("trace ", 64) + metadata_packet("{ };", 41)),
            "trace { };");
  EXPECT_EQ(metadata_text("trace { };"), "trace { };");
}

TEST(Metadata, CharactersAreNumbers) {
  const auto type = field("", "enum : integer { size = 8; } { a = 'a', nul = '\\0' } x;");
  EXPECT_EQ(type->ranges.at(0).low, 97U);
  EXPECT_EQ(type->ranges.at(1).low, 0U);
  EXPECT_THAT(error_of(kTrace + std::string("event { x = '; };")),
              HasSubstr("malformed character"));
  EXPECT_THAT(error_of(kTrace + std::string("event { x = ''; };")),
              HasSubstr("malformed character"));
}

// An editor's line feed, or what is left of a block.
TEST(MetadataFile, WhatIsTooShortForAPacketAndBeginsNoneIsIgnored) {
  const auto packet = metadata_packet("trace { };", 64);
  for (const auto* tail : {"\n", "W", "abcd", "a tail of thirty-six characters, all"})
    EXPECT_EQ(metadata_text(packet + tail), "trace { };") << tail;
}

TEST(MetadataFile, CutAndDamagedPacketsAreErrors) {
  const auto packet = metadata_packet("trace { };", 64);
  const auto error = [](const std::string& bytes) -> std::string {
    try {
      metadata_text(bytes);
    } catch (const MetadataError& caught) {
      return caught.what();
    }
    return "none";
  };
  EXPECT_THAT(error(packet + packet.substr(0, 20)), HasSubstr("cut at byte 64"));
  EXPECT_THAT(error(packet.substr(0, 40)), HasSubstr("cut at byte 0"));
  EXPECT_THAT(error(packet + std::string(64, 'x')), HasSubstr("damaged at byte 64"));
  EXPECT_THAT(error(metadata_packet("x", 64, 1)), HasSubstr("compressed"));
  EXPECT_THAT(error(metadata_packet("\x1e{}", 64)), HasSubstr("CTF 2, which has no packets"));
  EXPECT_THAT(error("[{}]"), HasSubstr("no text sequence"));
}

}  // namespace
}  // namespace cie::analysis::ctf
