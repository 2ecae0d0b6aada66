// Every kind of field of CTF 2 against bytes laid out by hand.
#include "fields_of.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <ctf/metadata/metadata_parser.hpp>
#include <ctf/metadata/tokens.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace cie::analysis::ctf {
namespace {

using test::Bytes;
using test::FieldsOf;
using testing::ElementsAre;
using testing::HasSubstr;

// 'single quotes' are double ones: JSON that can be read here.
std::string json(std::string text) {
  for (auto& c : text) {
    if (c == '\'') c = '"';
  }
  return text;
}

std::string member(const std::string& name, const std::string& field_class) {
  return "{'name': '" + name + "', 'field-class': " + field_class + "}";
}

std::string fixed(const std::string& kind, int bits, const std::string& more = "") {
  return "{'type': 'fixed-length-" + kind + "', 'length': " + std::to_string(bits) +
         (more.find("byte-order") == std::string::npos ? ", 'byte-order': 'little-endian'" : "") +
         more + "}";
}
const std::string kU8 = fixed("unsigned-integer", 8);
const std::string kI8 = fixed("signed-integer", 8);
const std::string kBoolean = fixed("boolean", 8);
const std::string kUnsignedLeb = "{'type': 'variable-length-unsigned-integer'}";
const std::string kSignedLeb = "{'type': 'variable-length-signed-integer'}";

std::string at(const std::string& path, const std::string& origin = "") {
  return (origin.empty() ? "{" : "{'origin': '" + origin + "', ") + "'path': [" + path + "]}";
}
std::string optional(const std::string& path, const std::string& field_class,
                     const std::string& ranges = "") {
  return "{'type': 'optional', 'selector-field-location': " + at(path) +
         (ranges.empty() ? "" : ", 'selector-field-ranges': " + ranges) +
         ", 'field-class': " + field_class + "}";
}
std::string blob(const std::string& path, const std::string& origin = "") {
  return "{'type': 'dynamic-length-blob', 'length-field-location': " + at(path, origin) + "}";
}
std::string option(const std::string& ranges, const std::string& field_class) {
  return "{'selector-field-ranges': " + ranges + ", 'field-class': " + field_class + "}";
}
std::string variant(const std::string& path, const std::string& options) {
  return "{'type': 'variant', 'selector-field-location': " + at(path) + ", 'options': [" + options +
         "]}";
}
std::string structure(const std::string& members) {
  return "{'type': 'structure', 'member-classes': [" + members + "]}";
}

Metadata metadata(const std::string& members) {
  return parse_metadata(
      json("\x1e{'type': 'preamble', 'version': 2}\n"
           "\x1e{'type': 'data-stream-class'}\n"
           "\x1e{'type': 'event-record-class', 'payload-field-class': " +
           structure(members) + "}\n"));
}

class Layout : public FieldsOf {
 public:
  Layout(const std::string& members, std::vector<FieldRequest> requests)
      : FieldsOf(metadata(members), std::move(requests)) {}
};

std::string error_of(const std::string& members, std::vector<FieldRequest> requests = {}) {
  try {
    Layout layout(members, std::move(requests));
  } catch (const MetadataError& error) {
    return error.what();
  }
  return "none";
}

TEST(Ctf2Fields, NumbersOfVariableLength) {
  Layout layout(member("a", kUnsignedLeb) + "," + member("b", kSignedLeb) + "," + member("c", kU8),
                {"a", "b", "c"});
  // The examples of the specification: 1 876 916 and -220 236.
  const auto got = layout.decode({0xb4, 0xc7, 0x72, 0xb4, 0xc7, 0x72, 9});
  EXPECT_EQ(got.outcome, Outcome::ok);
  EXPECT_EQ(got.number(0), 0x34 + (0x47 << 7) + (0x72 << 14));
  EXPECT_EQ(got.number(0), 1'876'916);
  EXPECT_EQ(got.number(1), -220'236);
  EXPECT_EQ(got.number(2), 9);
  // Bytes that add nothing.
  EXPECT_EQ(layout.decode({0x80, 0x80, 0x00, 0xff, 0x7f, 9}).number(0), 0);
  EXPECT_EQ(layout.decode({0x80, 0x80, 0x00, 0xff, 0x7f, 9}).number(1), -1);
  EXPECT_EQ(layout.decode({0x80, 0x80}).outcome, Outcome::cut);
}

TEST(Ctf2Fields, NumbersOfVariableLengthHaveUpTo64Bits) {
  Layout layout(member("a", kUnsignedLeb), {"a"});
  const Bytes nine(9, 0xff);
  const auto with = [&nine](std::uint8_t last) {
    auto bytes = nine;
    bytes.push_back(last);
    return bytes;
  };
  EXPECT_EQ(static_cast<std::uint64_t>(layout.decode(with(1)).number(0)),
            std::numeric_limits<std::uint64_t>::max());
  EXPECT_EQ(layout.decode(with(2)).outcome, Outcome::too_large);
  EXPECT_EQ(layout.decode(with(0x81)).outcome, Outcome::too_large);
  Layout with_sign(member("a", kSignedLeb), {"a"});
  EXPECT_EQ(
      with_sign.decode({0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x80, 0x7f}).number(0),
      std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(with_sign.decode(with(0)).number(0), std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(with_sign.decode(with(1)).outcome, Outcome::too_large);
}

TEST(Ctf2Fields, ListsOfNumbersOfVariableLength) {
  Layout layout(member("n", kU8) + "," +
                    member("s", "{'type': 'dynamic-length-array', 'length-field-location': " +
                                    at("'n'") + ", 'element-field-class': " + kUnsignedLeb + "}") +
                    "," + member("after", kU8),
                {"s", "after"});
  const auto got = layout.decode({3, 1, 0x81, 0x01, 0x7f, 42});
  EXPECT_THAT(got.integers(0), ElementsAre(1, 129, 127));
  EXPECT_EQ(got.number(1), 42);
}

TEST(Ctf2Fields, BitsInTheOtherOrder) {
  // 0b0000'0110 with its first bit as the most significant one: 0b0110'0000.
  Layout little(member("a", fixed("unsigned-integer", 8, ", 'bit-order': 'last-to-first'")) + "," +
                    member("b", fixed("signed-integer", 4, ", 'bit-order': 'last-to-first'")),
                {"a", "b"});
  const auto got = little.decode({0x06, 0x05});
  EXPECT_EQ(got.number(0), 0x60);
  EXPECT_EQ(got.number(1), 0xa - 0x10);  // 0b0101 becomes 0b1010
  Layout big(member("a", fixed("unsigned-integer", 16,
                               ", 'byte-order': 'big-endian', 'bit-order': 'first-to-last'")),
             {"a"});
  EXPECT_EQ(big.decode({0x80, 0x01}).number(0), 0x8001);
  EXPECT_EQ(big.decode({0xc0, 0x00}).number(0), 0x0003);
  Layout usual(member("a", fixed("unsigned-integer", 16,
                                 ", 'byte-order': 'big-endian', 'bit-order': 'last-to-first'")),
               {"a"});
  EXPECT_EQ(usual.decode({0x12, 0x34}).number(0), 0x1234);
}

TEST(Ctf2Fields, BooleansAreTrueWithAnyBitSet) {
  Layout layout(member("a", fixed("boolean", 12)) + "," + member("b", fixed("boolean", 4)),
                {"a", "b"});
  EXPECT_EQ(layout.decode({0x00, 0xf0}).number(0), 0);
  EXPECT_EQ(layout.decode({0x00, 0xf0}).number(1), 1);
  EXPECT_EQ(layout.decode({0x00, 0x08}).number(0), 1);
  EXPECT_EQ(layout.decode({0x00, 0x08}).number(1), 0);
}

TEST(Ctf2Fields, BitArraysAndBitMapsAreTheirBits) {
  Layout layout(member("a", fixed("bit-array", 12)) + "," +
                    member("b", fixed("bit-map", 4, ", 'flags': {'x': [[0, 3]]}")) + "," +
                    member("wide", fixed("bit-array", 72)) + "," + member("c", kU8),
                {"a", "b", "wide", "c"});
  const auto got = layout.decode({0x34, 0x52, 1, 2, 3, 4, 5, 6, 7, 8, 9, 77});
  EXPECT_EQ(got.number(0), 0x234);
  EXPECT_EQ(got.number(1), 5);
  EXPECT_FALSE(got.has(2));
  EXPECT_EQ(got.number(3), 77);
}

TEST(Ctf2Fields, TextsOfKnownLengthEndAtTheirFirstNul) {
  Layout layout(member("s", "{'type': 'static-length-string', 'length': 5}") + "," +
                    member("n", kUnsignedLeb) + "," +
                    member("t", "{'type': 'dynamic-length-string', 'length-field-location': " +
                                    at("'n'") + "}") +
                    "," + member("z", "{'type': 'null-terminated-string'}"),
                {"s", "t", "z"});
  const auto got = layout.decode({'a', 'b', 0, 'x', 'y', 3, 'c', 'd', 'e', 'f', 0});
  EXPECT_EQ(got.text(0), "ab");
  EXPECT_EQ(got.text(1), "cde");
  EXPECT_EQ(got.text(2), "f");
  EXPECT_EQ(layout.decode({'a', 'b', 'c', 'd', 'e', 0, 0}).text(0), "abcde");
  EXPECT_EQ(layout.decode({'a', 'b', 'c', 'd', 'e', 2, 'x'}).outcome, Outcome::cut);
}

TEST(Ctf2Fields, TextsOfOtherEncodingsAreSteppedOverAndNotAskedFor) {
  const auto wide = member("s", "{'type': 'null-terminated-string', 'encoding': 'utf-16be'}");
  const auto fixed_wide =
      member("f", "{'type': 'static-length-string', 'encoding': 'utf-32le', 'length': 4}");
  Layout layout(wide + "," + fixed_wide + "," + member("a", kU8), {"a"});
  // A NUL across two characters ends nothing.
  EXPECT_EQ(layout.decode({1, 0, 0, 1, 0, 0, 9, 9, 9, 9, 42}).number(0), 42);
  EXPECT_EQ(layout.decode({1, 0, 0, 1, 0}).outcome, Outcome::cut);
  EXPECT_THAT(error_of(wide, {"s"}), HasSubstr("\"s\" is not in UTF-8"));
  EXPECT_THAT(error_of(fixed_wide, {"f"}), HasSubstr("\"f\" is not in UTF-8"));
}

TEST(Ctf2Fields, WhatAThreadIsCalledMayBeOfAnotherEncoding) {
  Layout layout(member("procname", "{'type': 'null-terminated-string', 'encoding': 'utf-16be'}") +
                    "," + member("a", kU8),
                {"procname", "a"});
  const auto got = layout.decode({0, 'x', 0, 0, 42});
  EXPECT_EQ(got.text(0), "");
  EXPECT_EQ(got.number(1), 42);
}

TEST(Ctf2Fields, HowANumberWantsToLookRefusesNothing) {
  for (const auto* base : {"16", "'sixteen'", "-16", "null", "[16]"}) {
    const auto number = member("a",
                               "{'type': 'fixed-length-unsigned-integer', 'length': 8, "
                               "'byte-order': 'little-endian', 'preferred-display-base': " +
                                   std::string(base) + "}");
    Layout layout(number, {"a"});
    EXPECT_EQ(layout.decode({42}).number(0), 42) << base;
  }
}

TEST(Ctf2Fields, BlobsAreBytes) {
  Layout layout(member("s", "{'type': 'static-length-blob', 'length': 2, 'media-type': 'x/y'}") +
                    "," + member("n", kU8) + "," + member("d", blob("'n'")),
                {"s", "d"});
  EXPECT_THAT(layout.decode({1, 2, 0}).integers(0), ElementsAre(1, 2));
  Layout dynamic(member("n", kU8) + "," + member("d", blob("'n'")), {"d"});
  EXPECT_THAT(dynamic.decode({2, 0xfe, 0xff}).integers(0), ElementsAre(0xfe, 0xff));
}

TEST(Ctf2Fields, OptionalByBoolean) {
  Layout layout(member("is", kBoolean) + "," + member("o", optional("'is'", kU8)) + "," +
                    member("after", kU8),
                {"after"});
  EXPECT_EQ(layout.decode({0, 42}).number(0), 42);
  EXPECT_EQ(layout.decode({4, 1, 42}).number(0), 42);
}

TEST(Ctf2Fields, OptionalByRanges) {
  const auto layout_with = [](const std::string& selector) {
    return Layout(member("by", selector) + "," +
                      member("o", optional("'by'", kU8, "[[-12, -12], [3, 5], [200, 255]]")) + "," +
                      member("after", kU8),
                  {"after"});
  };
  auto plain = layout_with(kU8);
  EXPECT_EQ(plain.decode({2, 42}).number(0), 42);
  EXPECT_EQ(plain.decode({4, 1, 42}).number(0), 42);
  EXPECT_EQ(plain.decode({0xf4, 1, 42}).number(0), 42);  // 244
  auto with_sign = layout_with(kI8);
  EXPECT_EQ(with_sign.decode({0xf4, 1, 42}).number(0), 42);  // -12
  EXPECT_EQ(with_sign.decode({0xf5, 42}).number(0), 42);
  auto leb = layout_with(kSignedLeb);
  EXPECT_EQ(leb.decode({0xc8, 0x01, 1, 42}).number(0), 42);  // 200
  EXPECT_EQ(leb.decode({0x74, 1, 42}).number(0), 42);        // -12
}

TEST(Ctf2Fields, VariantByRanges) {
  Layout layout(member("by", kI8) + "," +
                    member("v", variant("'by'", option("[[-5, -5], [1, 2]]",
                                                       "{'type': "
                                                       "'null-terminated-string'}") +
                                                    "," + option("[[7, 100]]", kU8))) +
                    "," + member("after", kU8),
                {"after"});
  EXPECT_EQ(layout.decode({0xfb, 'x', 'y', 0, 42}).number(0), 42);
  EXPECT_EQ(layout.decode({100, 9, 42}).number(0), 42);
  EXPECT_EQ(layout.decode({3, 9, 42}).outcome, Outcome::no_option);
}

TEST(Ctf2Fields, LabelsAreRangesOfNumbers) {
  constexpr std::array<std::string_view, 2> kWanted{"ok", "exception"};
  const FieldRequest request("status", kWanted);
  const std::string mappings =
      ", 'mappings': {'exception': [[-7, -3], [9, 9]], 'ok': [[0, 1], [200, 300]], 'other': [[2, "
      "2]]}";
  Layout with_sign(member("status", fixed("signed-integer", 8, mappings)), {request});
  EXPECT_EQ(with_sign.decode({0xfa}).fields[0].label, 1);
  EXPECT_EQ(with_sign.decode({1}).fields[0].label, 0);
  EXPECT_EQ(with_sign.decode({2}).fields[0].label, -1);
  Layout leb(member("status", "{'type': 'variable-length-unsigned-integer'" + mappings + "}"),
             {request});
  EXPECT_EQ(leb.decode({0xac, 0x02}).fields[0].label, 0);  // 300
  EXPECT_EQ(leb.decode({9}).fields[0].label, 1);
}

TEST(Ctf2Fields, LengthsOfStructuresAround) {
  Layout layout(
      member("n", kU8) + "," +
          member("a", structure(member("b", structure(member("d", blob("null, null, 'n'")))))) +
          "," + member("after", kU8),
      {"after"});
  EXPECT_EQ(layout.decode({3, 9, 9, 9, 42}).number(0), 42);
  EXPECT_THAT(error_of(member("d", blob("null, 'n'"))), HasSubstr("is no integer before it"));
}

TEST(Ctf2Fields, LengthInTheSameElement) {
  Layout layout(
      member("all", "{'type': 'static-length-array', 'length': 2, 'element-field-class': " +
                        structure(member("n", kU8) + "," + member("d", blob("'n'"))) + "}") +
          "," + member("after", kU8),
      {"after"});
  EXPECT_EQ(layout.decode({2, 9, 9, 1, 9, 42}).number(0), 42);
  const auto outside =
      member("all", "{'type': 'static-length-array', 'length': 2, 'element-field-class': " +
                        structure(member("n", kU8)) + "}") +
      "," + member("d", blob("'all', 'n'"));
  EXPECT_THAT(error_of(outside), HasSubstr("is no integer before it"));
}

TEST(Ctf2Fields, LengthThatIsAVariant) {
  Layout layout(
      member("by", kU8) + "," +
          member("n", variant("'by'", option("[[0, 0]]", kU8) + "," +
                                          option("[[1, 1]]", fixed("unsigned-integer", 16)) + "," +
                                          option("[[2, 2]]", kUnsignedLeb))) +
          "," + member("d", blob("'n'")) + "," + member("e", blob("'n'")) + "," +
          member("after", kU8),
      {"after"});
  EXPECT_EQ(layout.decode({0, 1, 9, 9, 42}).number(0), 42);
  EXPECT_EQ(layout.decode({1, 2, 0, 9, 9, 9, 9, 42}).number(0), 42);
  EXPECT_EQ(layout.decode({2, 0x81, 0x00, 9, 9, 42}).number(0), 42);
}

TEST(Ctf2Fields, LengthInAnOptionThatWasNotChosenIsDamage) {
  const auto n =
      structure(member("n", kU8) + "," + member("own", blob("'v', 'n'", "event-record-payload")));
  Layout layout(member("by", kU8) + "," +
                    member("v", variant("'by'", option("[[0, 0]]", n) + "," +
                                                    option("[[1, 1]]", structure("")))) +
                    "," + member("d", blob("'v', 'n'")) + "," + member("after", kU8),
                {"after"});
  EXPECT_EQ(layout.decode({0, 1, 9, 9, 42}).number(0), 42);
  // Not the length that the event before had.
  EXPECT_EQ(layout.decode({1, 9, 42}).outcome, Outcome::cut);
}

TEST(Ctf2Fields, SelectorInAnOptionalThatIsNotThereSelectsNothing) {
  Layout layout(
      member("is", kBoolean) + "," + member("by", optional("'is'", kI8)) + "," +
          member("v", variant("'by'", option("[[-1, -1]]", kU8) + "," + option("[[0, 5]]", kU8))),
      {});
  EXPECT_EQ(layout.decode({1, 0xff, 9}).outcome, Outcome::ok);
  EXPECT_EQ(layout.decode({0, 9}).outcome, Outcome::no_option);
}

TEST(Ctf2Fields, LengthInAnOptionalThatIsNotThereIsDamage) {
  Layout layout(member("is", kBoolean) + "," + member("n", optional("'is'", kU8)) + "," +
                    member("d", optional("'is'", blob("'n'"))) + "," + member("e", blob("'n'")),
                {});
  EXPECT_EQ(layout.decode({1, 2, 9, 9, 9, 9}).outcome, Outcome::ok);
  EXPECT_EQ(layout.decode({0, 9, 9}).outcome, Outcome::cut);
}

TEST(Ctf2Fields, AlignmentOfStructuresArraysAndBits) {
  Layout layout(member("a", kU8) + "," +
                    member("s", "{'type': 'structure', 'minimum-alignment': 32}") + "," +
                    member("flags",
                           "{'type': 'static-length-array', 'length': 3, "
                           "'minimum-alignment': 64, 'element-field-class': " +
                               fixed("boolean", 1) + "}") +
                    "," + member("b", fixed("unsigned-integer", 8, ", 'alignment': 16")),
                {"a", "b"});
  const auto got = layout.decode({1, 0, 0, 0, 0, 0, 0, 0, 7, 0, 42});
  EXPECT_EQ(got.number(1), 42);
  EXPECT_EQ(got.end, 88U);
}

TEST(Ctf2Fields, NamesAreAsTheyStand) {
  Layout layout(member("_a", kU8) + "," + member("a", kU8), {"a"});
  EXPECT_EQ(layout.decode({1, 2}).number(0), 2);
}

TEST(Ctf2Fields, LengthsAndSelectorsMustBeWhatTheySay) {
  EXPECT_THAT(error_of(member("n", kI8) + "," + member("d", blob("'n'"))), HasSubstr("is signed"));
  EXPECT_THAT(error_of(member("n", kBoolean) + "," + member("d", blob("'n'"))),
              HasSubstr("no integer"));
  EXPECT_THAT(error_of(member("n", fixed("bit-array", 8)) + "," + member("d", blob("'n'"))),
              HasSubstr("no integer"));
  EXPECT_THAT(error_of(member("n", kU8) + "," + member("o", optional("'n'", kU8))),
              HasSubstr("does not fit its ranges"));
  EXPECT_THAT(error_of(member("n", kBoolean) + "," + member("o", optional("'n'", kU8, "[[1, 1]]"))),
              HasSubstr("does not fit its ranges"));
  EXPECT_THAT(error_of(member("d", blob("'n'")) + "," + member("n", kU8)),
              HasSubstr("is no integer before it"));
  EXPECT_THAT(error_of(member("d", blob("'d'"))), HasSubstr("is no integer before it"));
  EXPECT_THAT(error_of(member("n", kU8) + "," + member("d", blob("'n'", "packet-header"))),
              HasSubstr("is no integer before it"));
  const auto mixed = variant("'by'", option("[[0, 0]]", kU8) + "," + option("[[1, 1]]", kI8));
  EXPECT_THAT(error_of(member("by", kU8) + "," + member("n", mixed) + "," +
                       member("v", variant("'n'", option("[[0, 0]]", kU8)))),
              HasSubstr("now one with a sign"));
}

}  // namespace
}  // namespace cie::analysis::ctf
