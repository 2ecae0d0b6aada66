#include "json/json_text.hpp"

#include "json/json.hpp"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace cie::viewer_export {
namespace {

std::string written(const auto& write, int indentation = 2) {
  std::ostringstream out;
  JsonText json(out, indentation);
  write(json);
  json.flush();
  return out.str();
}

TEST(JsonText, BreaksLinesAsDocumentsDo) {
  const auto write = [](JsonText& json) {
    json.object([&] {
      json.key("empty");
      json.object([] {});
      json.key("none");
      json.array([] {});
      json.key("rows");
      json.array([&] {
        json.element();
        json.object([&] {
          json.key("known");
          json.value(true);
          json.key("ns");
          json.null();
        });
        json.element();
        json.value(-1);
      });
      json.key("more");
      json.verbatim("[1]");
    });
  };
  EXPECT_EQ(written(write), R"({
  "empty": {},
  "none": [],
  "rows": [
    {
      "known": true,
      "ns": null
    },
    -1
  ],
  "more": [1]
})");
  EXPECT_EQ(written(write, JsonText::kOneLine),
            R"({"empty":{},"none":[],"rows":[{"known":true,"ns":null},-1],"more":[1]})");
}

TEST(JsonText, WritesValuesAsDocumentsDo) {
  const auto expect_same = [](const auto& value) {
    EXPECT_EQ(written([&value](JsonText& json) { json.value(value); }), json_text(Json(value)));
  };
  for (const double value :
       {0.0, -0.0, 1.0, 0.1, 1234.5, 1e15, 1e16, 1e-5, 2.0 / 3, 1e300,
        std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    expect_same(value);
  }
  expect_same(std::numeric_limits<std::int64_t>::min());
  expect_same(std::numeric_limits<std::uint64_t>::max());
  for (const std::string_view text : {"", "plain /text~\x7f", "\"quoted\"", "back\\slash",
                                      "line\n\x01", "na\xc3\xafve", "\xff"}) {
    expect_same(text);
  }
}

TEST(JsonText, HandsOverWhatIsLong) {
  const auto text = written([](JsonText& json) {
    json.array([&] {
      for (int i = 0; i < 100'000; ++i) {
        json.element();
        json.value(i);
      }
    });
  });
  std::vector<int> expected(100'000);
  for (int i = 0; i < 100'000; ++i)
    expected[static_cast<std::size_t>(i)] = i;
  EXPECT_EQ(Json::parse(text).get<std::vector<int>>(), expected);
}

// Each of them larger than what it keeps, and what follows after all but full.
TEST(JsonText, HandsOverTextsLongerThanItsBuffer) {
  for (const std::size_t size : {65'500U, 65'534U, 65'535U, 65'536U, 65'537U, 200'000U}) {
    const std::string plain(size, 'a');
    const std::string escaped(size, '"');
    const auto text = written([&](JsonText& json) {
      json.object([&] {
        json.key("plain");
        json.value(std::string_view(plain));
        json.key("escaped");
        json.value(std::string_view(escaped));
        json.key("verbatim");
        json.verbatim("1");
      });
    });
    const Json expected = {{"plain", plain}, {"escaped", escaped}, {"verbatim", 1}};
    EXPECT_EQ(text, expected.dump(2)) << size;
  }
}

// Of strings shorter and longer than a word, which is looked at at once; json_string asks nobody.
TEST(JsonText, CopiesExactlyWhatNeedsNoEscape) {
  for (std::size_t size = 1; size <= 20; ++size) {
    for (std::size_t at = 0; at < size; ++at) {
      for (int byte = 0; byte < 256; ++byte) {
        std::string text(size, '~');
        text[at] = static_cast<char>(byte);
        const auto quoted = '"' + text + '"';
        ASSERT_EQ(needs_no_escape(text), json_string(text) == quoted)
            << "byte " << byte << " at " << at << " of " << size;
      }
    }
  }
  EXPECT_TRUE(needs_no_escape(""));
}

TEST(JsonText, EscapesWhatATerminalObeysOrHidesAndMeansTheSame) {
  const std::string text = "\x7F \xC2\x9B \xE2\x80\xAE \xF3\xA0\x80\x81 \xC3\xA9 \xF0\x9F\x9A\x97";
  const auto escaped = json_string(text);
  EXPECT_EQ(escaped, R"("\u007f \u009b \u202e \udb40\udc01 )"
                     "\xC3\xA9 \xF0\x9F\x9A\x97\"");
  EXPECT_EQ(Json::parse(escaped), text);
  std::ostringstream out;
  write_json(out, Json(text));
  EXPECT_EQ(out.str(), escaped + '\n');
}

}  // namespace
}  // namespace cie::viewer_export
