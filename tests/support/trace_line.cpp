#include "support/trace_writer.hpp"

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace cie::test::text {

void Line::fail(const std::string& why) const {
  throw std::invalid_argument(why + " in trace line: " + text);
}

const std::string& Line::word(std::size_t i) const {
  if (i >= words.size()) fail("a word is missing");
  return words[i];
}

bool Line::has(std::string_view flag) const {
  return std::find(words.begin(), words.end(), flag) != words.end();
}

std::int64_t Line::parse(std::string_view digits) const {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size()) fail("not a number");
  return value;
}

std::string Line::value(std::string_view key, std::string_view fallback) const {
  const auto found = values.find(key);
  return found == values.end() ? std::string(fallback) : found->second;
}

Line cut(std::string_view text) {
  Line line{.text = std::string(text), .words = {}, .values = {}};
  std::size_t begin = 0;
  while ((begin = text.find_first_not_of(" \t", begin)) != std::string_view::npos) {
    const auto end = std::min(text.find_first_of(" \t", begin), text.size());
    const auto word = text.substr(begin, end - begin);
    const auto equals = word.find('=');
    if (equals == std::string_view::npos) {
      line.words.emplace_back(word);
    } else {
      line.values.emplace(word.substr(0, equals), word.substr(equals + 1));
    }
    begin = end;
  }
  return line;
}

}  // namespace cie::test::text
