// What CTF 2 metadata says, and what none may say.
#include <cie/analysis/analyzer.hpp>

#include "ctf_trace.hpp"
#include "metadata_error.hpp"

#include <string>
#include <vector>

#include <ctf/metadata/metadata_parser.hpp>
#include <ctf/program/trace_plan.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

using cie::test::error_of;
using testing::ElementsAre;
using testing::HasSubstr;

const std::string kPreamble = R"({"type": "preamble", "version": 2})";
const std::string kStream = R"({"type": "data-stream-class"})";

std::string sequence(const std::vector<std::string>& fragments) {
  std::string text;
  for (const auto& fragment : fragments)
    text += '\x1e' + fragment + '\n';
  return text;
}

std::string error_of(const std::vector<std::string>& fragments) {
  return error_of(sequence(fragments));
}
std::string alias(const std::string& field_class, const std::string& name = "a") {
  return R"({"type": "field-class-alias", "name": ")" + name + R"(", "field-class": )" +
         field_class + "}";
}
// What is wrong with a field class.
std::string error_of_class(const std::string& field_class) {
  return error_of({kPreamble, alias(field_class), kStream});
}

std::string u(int bits, const std::string& role = "") {
  return R"({"type": "fixed-length-unsigned-integer", "byte-order": "little-endian", "length": )" +
         std::to_string(bits) + (role.empty() ? "" : R"(, "roles": [")" + role + "\"]") + "}";
}
std::string member(const std::string& name, const std::string& field_class) {
  return R"({"name": ")" + name + R"(", "field-class": )" + field_class + "}";
}
std::string structure(const std::string& members) {
  return R"({"type": "structure", "member-classes": [)" + members + "]}";
}

TEST(Ctf2Metadata, PreambleTraceAndClock) {
  const auto metadata = parse_metadata(sequence(
      {R"({"type": "preamble", "version": 2, "uuid": [62, 199, 81, 169, 204, 39, 92, 99, 157, 134, 42,
          85, 70, 135, 243, 81], "attributes": {"x": {"y": [1]}}, "extensions": {"x": {}}})",
       R"({"type": "trace-class", "environment": {"hostname": "robot \"1\"", "n": -3, "m": 2}})",
       R"({"type": "clock-class", "id": "c", "name": "monotonic", "frequency": 1000,
          "uid": "3EC751a9-cc27-5c63-9d86-2a554687f351", "origin": "unix-epoch", "precision": 1,
          "accuracy": 0, "description": "d", "offset-from-origin": {"seconds": -2, "cycles": 16}})",
       R"({"type": "data-stream-class", "id": 3, "default-clock-class-id": "c"})",
       R"({"type": "event-record-class", "id": 7, "data-stream-class-id": 3, "name": "n"})"}));
  EXPECT_EQ(metadata.uuid, "3ec751a9-cc27-5c63-9d86-2a554687f351");
  EXPECT_EQ(metadata.environment.at("hostname"), "robot \"1\"");
  EXPECT_EQ(metadata.environment.at("n"), "-3");
  EXPECT_EQ(metadata.environment.at("m"), "2");
  const TracePlan plan(metadata);
  const auto& clock = plan.find(3)->clock;
  EXPECT_EQ(clock.frequency, 1000U);
  EXPECT_EQ(clock.offset_ns, -2'000'000'000 + 16'000'000);
  EXPECT_EQ(clock.uuid, "3ec751a9-cc27-5c63-9d86-2a554687f351");
  EXPECT_EQ(plan.find(3)->find(7)->name, "n");
  EXPECT_EQ(plan.find(3)->find(0), nullptr);
}

TEST(Ctf2Metadata, ClocksWithoutAUuidAreKnownByNamespaceNameAndUid) {
  const auto identity = [](const std::string& more) {
    return parse_metadata(
               sequence({kPreamble,
                         R"({"type": "clock-class", "id": "c", "frequency": 1)" + more + "}",
                         kStream}))
        .clocks.at(0)
        .uuid;
  };
  EXPECT_EQ(identity(R"(, "name": "hot", "uid": "w28", "namespace": "t")"), "t/hot/w28");
  EXPECT_EQ(identity(R"(, "name": "hot", "uid": "w28")"), "/hot/w28");
  EXPECT_EQ(identity(R"(, "name": "hot")"), "");
  EXPECT_EQ(identity(R"(, "uid": "w28")"), "");
}

TEST(Ctf2Metadata, RolesCountAndNamesDoNot) {
  test::TraceFolder folder;
  const auto header = structure(member("stream_id", u(32, "packet-magic-number")) + "," +
                                member("magic", u(8, "data-stream-id")));
  const auto context = structure(
      member("inner", structure(member("timestamp_end", u(16, "packet-total-length")) + "," +
                                member("packet_size", u(8, "default-clock-timestamp")))) +
      "," + member("cpu_id", u(8)) + "," +
      member("events_discarded", u(8, "packet-sequence-number")));
  const auto event = structure(member("timestamp", u(8, "event-record-class-id")) + "," +
                               member("id", u(8, "default-clock-timestamp")));
  folder.write("metadata",
               sequence({kPreamble,
                         R"({"type": "trace-class", "packet-header-field-class": )" + header + "}",
                         R"({"type": "clock-class", "id": "c", "frequency": 1000000000})",
                         R"({"type": "data-stream-class", "default-clock-class-id": "c",
                            "packet-context-field-class": )" +
                             context + R"(, "event-record-header-field-class": )" + event + "}",
                         R"({"type": "event-record-class", "id": 4, "name": "one"})",
                         R"({"type": "event-record-class", "id": 5, "name": "other"})"}));
  // Magic, instance, 14 bytes in all, from 200 on, CPU 3, packet 9; times of eight bits wrap.
  const std::string packet("\xc1\x1f\xfc\xc1\x01\x70\x00\xc8\x03\x09\x04\xd2\x05\x02", 14);
  auto next = packet;
  next[9] = 11;
  folder.write("s", packet + next);
  EXPECT_THAT(test::read(folder),
              ElementsAre("210 one on 3", "258 other on 3", "258 lost 1 packets until 200",
                          "210 after 258", "210 one on 3", "258 other on 3"));
}

TEST(Ctf2Metadata, ATimeOfVariableLengthIsAsManyBitsOfTheClockAsItHas) {
  test::TraceFolder folder;
  folder.write(
      "metadata",
      sequence({kPreamble, R"({"type": "clock-class", "id": "c", "frequency": 1000000000})",
                R"({"type": "data-stream-class", "default-clock-class-id": "c",
                            "event-record-header-field-class": )" +
                    structure(member("t", R"({"type": "variable-length-unsigned-integer",
                                                      "roles": ["default-clock-timestamp"]})")) +
                    "}",
                R"({"type": "event-record-class", "name": "tick"})"}));
  // 300; 45 (the next time the low seven bits are 45 is 301); 44 + 128 * 3; 5 (512 + 5)
  folder.write("s", "\xac\x02\x2d\xac\x03\x05");
  EXPECT_THAT(test::read(folder),
              ElementsAre("300 tick on ?", "301 tick on ?", "428 tick on ?", "517 tick on ?"));
}

TEST(Ctf2Metadata, ExtensionsAreRefusedByName) {
  EXPECT_THAT(error_of({R"({"type": "preamble", "version": 2,
                           "extensions": {"my.tracer": {"piano": {"keys": 88}}}})",
                        kStream}),
              HasSubstr("the extension \"piano\" of \"my.tracer\""));
  EXPECT_THAT(error_of_class(R"({"type": "structure", "extensions": {"a": {"b": 1}}})"),
              HasSubstr("the extension \"b\" of \"a\""));
}

TEST(Ctf2Metadata, FragmentsThatAreCutOrNoJson) {
  const auto whole = sequence({kPreamble, kStream});
  EXPECT_EQ(error_of(whole), "none");
  for (std::size_t kept = kPreamble.size() + 4; kept + 2 < whole.size(); ++kept) {
    EXPECT_THAT(error_of(whole.substr(0, kept)),
                HasSubstr("fragment 2: it is cut at byte " + std::to_string(kept)));
  }
  EXPECT_THAT(error_of(whole.substr(0, kPreamble.size() + 3)), HasSubstr("no data stream class"));
  EXPECT_THAT(
      error_of("\x1e" + kPreamble + "x\n\x1e" + kStream),
      HasSubstr("fragment 1: it is no JSON at byte " + std::to_string(kPreamble.size() + 1)));
  EXPECT_THAT(error_of({kPreamble, "[]"}), HasSubstr("fragment 2: it is no JSON object"));
  // Separators may follow each other.
  EXPECT_EQ(error_of("\x1e\x1e \n" + whole), "none");
}

TEST(Ctf2Metadata, SizeAndDepthAreBounded) {
  const std::string open(300, '[');
  EXPECT_THAT(error_of({kPreamble, R"({"type": "x", "attributes": )" + open}), HasSubstr("nested"));
  EXPECT_THAT(error_of({kPreamble, R"({"type": ")" + std::string(5U << 20U, 'x') + "\"}"}),
              HasSubstr("larger than 4 MiB"));
  // Aliases of aliases nest as well.
  std::vector<std::string> fragments{kPreamble, alias(u(8), "0")};
  for (int i = 0; i < 60; ++i) {
    fragments.push_back(
        alias(structure(member("x", '"' + std::to_string(i) + '"')), std::to_string(i + 1)));
  }
  EXPECT_THAT(error_of(fragments), HasSubstr("nested too deeply"));
}

TEST(Ctf2Metadata, AliasesThatMultiplyAreBounded) {
  std::vector<std::string> fragments{kPreamble, alias(u(8), "0")};
  for (int i = 0; i < 40; ++i) {
    const auto below = '"' + std::to_string(i) + '"';
    fragments.push_back(
        alias(structure(member("x", below) + "," + member("y", below)), std::to_string(i + 1)));
  }
  fragments.push_back(kStream);
  fragments.push_back(R"({"type": "event-record-class", "payload-field-class": "40"})");
  EXPECT_THAT(error_of(fragments), HasSubstr("more fields"));
}

TEST(Ctf2Metadata, RangesThatMultiplyAreBounded) {
  std::string ranges;
  for (int i = 0; i < 1000; ++i)
    ranges += (i > 0 ? ",[" : "[") + std::to_string(2 * i) + "," + std::to_string(2 * i) + "]";
  const auto wide =
      structure(member("n", u(8)) + "," +
                member("o", R"({"type": "optional", "selector-field-location": {"path": ["n"]},
                     "selector-field-ranges": [)" +
                                ranges + R"(], "field-class": )" + u(8) + "}"));
  std::string members;
  for (int i = 0; i < 1000; ++i)
    members += (i > 0 ? "," : "") + member(std::to_string(i), "\"a\"");
  EXPECT_THAT(error_of({kPreamble, alias(wide), kStream,
                        R"({"type": "event-record-class", "payload-field-class": )" +
                            structure(members) + "}"}),
              testing::AnyOf(HasSubstr("more fields"), HasSubstr("too many lengths")));
}

TEST(Ctf2Metadata, StreamsAndEventsAreBounded) {
  const auto declared = [](int count, const std::string& kind) {
    std::vector<std::string> fragments{kPreamble};
    if (kind != "data-stream-class") fragments.push_back(kStream);
    for (int i = 0; i < count; ++i) {
      fragments.push_back(R"({"type": ")" + kind + R"(", "id": )" + std::to_string(i) + "}");
    }
    return error_of(fragments);
  };
  EXPECT_EQ(declared(1000, "data-stream-class"), "none");
  EXPECT_THAT(declared(10'001, "data-stream-class"), HasSubstr("more streams or events"));
  EXPECT_THAT(declared(100'001, "event-record-class"), HasSubstr("more streams or events"));
}

TEST(Ctf2Metadata, LargeIdsOfManyStreamsAreBounded) {
  std::vector<std::string> fragments{kPreamble};
  for (int i = 0; i < 100; ++i) {
    fragments.push_back(R"({"type": "data-stream-class", "id": )" + std::to_string(i) + "}");
    fragments.push_back(R"({"type": "event-record-class", "id": 65535, "name": "last",
                            "data-stream-class-id": )" +
                        std::to_string(i) + "}");
  }
  const TracePlan plan(parse_metadata(sequence(fragments)));
  for (std::uint64_t i = 0; i < 100; ++i)
    EXPECT_EQ(plan.find(i)->find(65535)->name, "last");
}

TEST(Ctf2Metadata, WhatFragmentsMustHave) {
  EXPECT_THAT(error_of({kStream, kPreamble}), HasSubstr("must be a preamble"));
  EXPECT_THAT(error_of({kPreamble, kPreamble, kStream}), HasSubstr("must be a preamble"));
  EXPECT_THAT(error_of({R"({"type": "preamble", "version": 3})", kStream}),
              HasSubstr("versions 1.8 and 2"));
  EXPECT_THAT(error_of({R"({"type": "preamble", "version": 2, "uuid": [1, 2]})", kStream}),
              HasSubstr("16 bytes"));
  EXPECT_THAT(error_of({kPreamble, kStream, R"({"type": "trace-class"})"}),
              HasSubstr("trace class"));
  EXPECT_THAT(error_of({kPreamble, kStream, kStream}), HasSubstr("a second data stream class 0"));
  EXPECT_THAT(error_of({kPreamble, R"({"type": "event-record-class"})", kStream}),
              HasSubstr("is not declared"));
  EXPECT_THAT(error_of({kPreamble, kStream, R"({"type": "event-record-class"})",
                        R"({"type": "event-record-class"})"}),
              HasSubstr("a second event 0"));
  EXPECT_THAT(
      error_of({kPreamble, R"({"type": "data-stream-class", "default-clock-class-id": "c"})"}),
      HasSubstr("unknown clock"));
  EXPECT_THAT(
      error_of({kPreamble, R"({"type": "clock-class", "id": "c", "frequency": 0})", kStream}),
      HasSubstr("must advance"));
  EXPECT_THAT(error_of({kPreamble,
                        R"({"type": "clock-class", "id": "c", "frequency": 10,
                           "offset-from-origin": {"cycles": 10}})",
                        kStream}),
              HasSubstr("less than a second"));
  EXPECT_THAT(
      error_of({kPreamble,
                R"({"type": "clock-class", "id": "c", "frequency": 1, "origin": "big-bang"})",
                kStream}),
      HasSubstr("unknown origin"));
  EXPECT_THAT(error_of({kPreamble, R"({"type": "surprise"})"}), HasSubstr("unknown type"));
  EXPECT_THAT(error_of({kPreamble, alias(u(8)), alias(u(8)), kStream}),
              HasSubstr("a second alias"));
  EXPECT_THAT(
      error_of({kPreamble,
                R"({"type": "data-stream-class", "packet-context-field-class": )" + u(8) + "}"}),
      HasSubstr("must be a structure"));
  EXPECT_THAT(
      error_of({kPreamble, R"({"type": "data-stream-class",
                                      "event-record-header-field-class": )" +
                               structure(member("t", u(8, "default-clock-timestamp"))) + "}"}),
      HasSubstr("times, but no clock"));
}

TEST(Ctf2Metadata, WhatFieldClassesMustHave) {
  EXPECT_EQ(error_of_class(u(8)), "none");
  EXPECT_THAT(error_of_class("\"unknown\""), HasSubstr("unknown field class \"unknown\""));
  EXPECT_THAT(error_of_class("5"), HasSubstr("an object is missing"));
  EXPECT_THAT(error_of_class(R"({"type": "integer"})"), HasSubstr("unknown field class"));
  EXPECT_THAT(error_of_class(u(0)), HasSubstr("1 to 65536 bits"));
  EXPECT_THAT(error_of_class(R"({"type": "fixed-length-boolean", "length": 1.0})"),
              HasSubstr("\"length\" must be an integer"));
  EXPECT_THAT(error_of_class(R"({"type": "fixed-length-boolean", "length": 1})"),
              HasSubstr("\"byte-order\" is missing"));
  EXPECT_THAT(error_of_class(R"({"type": "fixed-length-floating-point-number", "length": 24,
                                "byte-order": "big-endian"})"),
              HasSubstr("floating point"));
  EXPECT_THAT(error_of_class(R"({"type": "structure", "minimum-alignment": 3})"),
              HasSubstr("power of two"));
  EXPECT_THAT(error_of_class(structure(member("x", u(8)) + "," + member("x", u(8)))),
              HasSubstr("a second field \"x\""));
  EXPECT_THAT(error_of_class(u(8, "king")), HasSubstr("unknown role \"king\""));
  EXPECT_THAT(error_of_class(u(16, "packet-magic-number")), HasSubstr("must have 32 bits"));
  EXPECT_THAT(error_of_class(R"({"type": "static-length-blob", "length": 15,
                                "roles": ["metadata-stream-uuid"]})"),
              HasSubstr("a role that its class cannot have"));
  EXPECT_THAT(error_of_class(R"({"type": "variable-length-signed-integer",
                                "roles": ["packet-total-length"]})"),
              HasSubstr("a role that its class cannot have"));
  EXPECT_THAT(error_of_class(R"({"type": "null-terminated-string", "encoding": "latin-1"})"),
              HasSubstr("unknown encoding"));
  EXPECT_THAT(
      error_of_class(R"({"type": "dynamic-length-blob", "length-field-location": {"path": []}})"),
      HasSubstr("a path must end"));
  EXPECT_THAT(error_of_class(R"({"type": "dynamic-length-blob",
                                "length-field-location": {"path": ["a", null]}})"),
              HasSubstr("a path must end"));
  EXPECT_THAT(error_of_class(R"({"type": "dynamic-length-blob",
                                "length-field-location": {"origin": "moon", "path": ["a"]}})"),
              HasSubstr("unknown origin"));
  EXPECT_THAT(error_of_class(R"({"type": "variant", "options": [],
                                "selector-field-location": {"path": ["a"]}})"),
              HasSubstr("without options"));
  EXPECT_THAT(error_of_class(R"({"type": "variable-length-unsigned-integer",
                                "mappings": {"a": [[5, 4]]}})"),
              HasSubstr("ends before it begins"));
  EXPECT_THAT(
      error_of_class(R"({"type": "variable-length-unsigned-integer", "mappings": {"a": []}})"),
      HasSubstr("a filled array"));
}

}  // namespace
}  // namespace cie::analysis::ctf
