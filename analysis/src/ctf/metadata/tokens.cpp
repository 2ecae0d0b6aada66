#include "tokens.hpp"

#include <algorithm>
#include <array>

namespace cie::analysis::ctf {
namespace {

constexpr bool is_name_start(char c) {
  return c == '_' || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }
constexpr bool is_name(char c) { return is_name_start(c) || is_digit(c); }
constexpr bool is_blank(char c) {
  return c == ' ' || c == '\n' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

// Characters as a table: a text is gone over one by one.
template <typename IsIn>
constexpr auto characters(IsIn is_in) {
  std::array<bool, 256> table{};
  for (unsigned c = 0; c < table.size(); ++c)
    table[c] = is_in(static_cast<char>(c));
  return table;
}
constexpr auto kOfNames = characters(is_name);
constexpr auto kOfBlanks = characters(is_blank);
// What tells where a plain structure ends, and that it is none: a length that is a name, a variant's
// tag, a text, a comment.
constexpr auto kNotable = characters(
    [](char c) { return std::string_view("[<\"'/{}").find(c) != std::string_view::npos; });

// The first place from `at` on whose character is not in the table.
std::size_t behind(const std::array<bool, 256>& table, std::string_view text, std::size_t at) {
  while (at < text.size() && table[static_cast<unsigned char>(text[at])])
    ++at;
  return at;
}

// Value of a digit in bases up to 16; 99 if it is none.
unsigned digit(char c) {
  if (is_digit(c)) return static_cast<unsigned>(c - '0');
  if (c >= 'a' && c <= 'f') return static_cast<unsigned>(c - 'a') + 10;
  if (c >= 'A' && c <= 'F') return static_cast<unsigned>(c - 'A') + 10;
  return 99;
}

// What can be shown of a token in a message.
std::string shown(const Token& token) {
  if (token.kind == Token::Kind::end) return "the end";
  constexpr std::size_t kMost = 40;
  std::string text = "\"";
  for (const char c : token.spelling.substr(0, kMost)) {
    text += c >= ' ' && c < '\x7f' ? c : '?';
  }
  return text + "\"";
}

constexpr std::array<std::string_view, 3> kLongPunctuation{"...", ":=", "->"};

}  // namespace

Tokens::Tokens(std::string_view text) : text_(text) {
  current_ = scan();
  next_ = scan();
}

void Tokens::fail(const std::string& what) const {
  fail_at(static_cast<std::size_t>(current_.spelling.data() - text_.data()),
          what + ", not " + shown(current_));
}

void Tokens::fail_at(std::size_t at, const std::string& what) const {
  const auto before = text_.substr(0, at);
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  throw MetadataError("line " + std::to_string(line) + ": " + what);
}

void Tokens::advance() {
  current_ = next_;
  next_ = scan();
}

Token Tokens::take() {
  const auto token = current_;
  advance();
  return token;
}

void Tokens::expect(std::string_view spelling) {
  if (!accept(spelling)) fail("expected \"" + std::string(spelling) + "\"");
}

std::string_view Tokens::block() const noexcept {
  if (!current_.is("{")) return {};
  const auto begin = static_cast<std::size_t>(current_.spelling.data() - text_.data());
  const auto end = text_.find('}', begin);
  return end == std::string_view::npos ? std::string_view{} : text_.substr(begin, end + 1 - begin);
}

std::string_view Tokens::plain_structure() const noexcept {
  if (!current_.is("struct") || !next_.is("{")) return {};
  const auto begin = static_cast<std::size_t>(current_.spelling.data() - text_.data());
  std::size_t depth = 0;
  for (auto at = begin; at < text_.size(); ++at) {
    const char c = text_[at];
    if (!kNotable[static_cast<unsigned char>(c)]) continue;
    if (c == '{') {
      ++depth;
    } else if (c == '}') {
      if (--depth == 0) return text_.substr(begin, at + 1 - begin);
    } else if (c != '[' || at + 1 >= text_.size() || !is_digit(text_[at + 1])) {
      return {};
    }
  }
  return {};
}

void Tokens::skip(std::string_view text) { go_to(text.substr(text.size())); }

void Tokens::go_to(std::string_view part) {
  at_ = static_cast<std::size_t>(part.data() - text_.data());
  current_ = scan();
  next_ = scan();
}

void Tokens::skip_blank() {
  for (;;) {
    at_ = behind(kOfBlanks, text_, at_);
    if (at_ >= text_.size() || text_[at_] != '/') return;
    if (is_next("//")) {
      at_ = std::min(text_.find('\n', at_), text_.size());
    } else if (is_next("/*")) {
      const auto end = text_.find("*/", at_ + 2);
      if (end == std::string_view::npos) fail_at(at_, "a comment without end");
      at_ = end + 2;
    } else {
      return;
    }
  }
}

Token Tokens::scan_number() {
  Token token{.kind = Token::Kind::number, .spelling = {}, .number = 0};
  const auto begin = at_;
  unsigned base = 10;
  if (text_[at_] == '0' && at_ + 1 < text_.size()) {
    const char next = text_[at_ + 1];
    if (next == 'x' || next == 'X') {
      base = 16;
      at_ += 2;
    } else if (next == 'b' || next == 'B') {
      base = 2;
      at_ += 2;
    } else if (is_digit(next)) {
      base = 8;
      ++at_;
    }
  }
  const auto digits = at_;
  for (; at_ < text_.size() && digit(text_[at_]) < base; ++at_) {
    if (__builtin_mul_overflow(token.number, base, &token.number) ||
        __builtin_add_overflow(token.number, digit(text_[at_]), &token.number)) {
      fail_at(begin, "a number beyond 64 bits");
    }
  }
  const auto digits_end = at_;
  while (at_ < text_.size() && std::string_view("uUlL").find(text_[at_]) != std::string_view::npos)
    ++at_;
  if (digits_end == digits || (at_ < text_.size() && is_name(text_[at_]))) {
    fail_at(begin, "a malformed number");
  }
  token.spelling = text_.substr(begin, at_ - begin);
  return token;
}

Token Tokens::scan_text() {
  Token token{.kind = Token::Kind::text, .spelling = {}, .number = 0};
  const auto begin = ++at_;
  for (; at_ < text_.size() && text_[at_] != '"' && text_[at_] != '\n'; ++at_) {
    if (text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;
  }
  if (at_ >= text_.size() || text_[at_] != '"') {
    fail_at(begin, "a text without closing quote");
  }
  token.spelling = text_.substr(begin, at_ - begin);
  ++at_;
  return token;
}

// 'a': a number as in C.
Token Tokens::scan_character() {
  Token token{.kind = Token::Kind::number, .spelling = {}, .number = 0};
  const auto begin = at_++;
  for (; at_ < text_.size() && text_[at_] != '\'' && text_[at_] != '\n'; ++at_) {
    if (text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;
  }
  const auto characters = unescape(text_.substr(begin + 1, at_ - begin - 1));
  if (at_ >= text_.size() || text_[at_] != '\'' || characters.empty()) {
    fail_at(begin, "a malformed character");
  }
  for (const char c : characters)
    token.number = token.number << 8U | static_cast<unsigned char>(c);
  ++at_;
  token.spelling = text_.substr(begin, at_ - begin);
  return token;
}

Token Tokens::scan() {
  skip_blank();
  if (at_ >= text_.size())
    return {.kind = Token::Kind::end, .spelling = text_.substr(text_.size()), .number = 0};
  const char c = text_[at_];
  if (c == 'L' && (is_next("L\"") || is_next("L'"))) ++at_;
  if (text_[at_] == '"') return scan_text();
  if (text_[at_] == '\'') return scan_character();
  if (is_digit(c)) return scan_number();
  Token token{.kind = Token::Kind::punctuation, .spelling = {}, .number = 0};
  const auto begin = at_;
  if (is_name_start(c)) {
    token.kind = Token::Kind::name;
    at_ = behind(kOfNames, text_, at_);
  } else {
    const auto found = std::ranges::find_if(
        kLongPunctuation, [this](std::string_view spelling) { return is_next(spelling); });
    at_ += found == kLongPunctuation.end() ? 1 : found->size();
  }
  token.spelling = text_.substr(begin, at_ - begin);
  return token;
}

std::string unescape(std::string_view spelling) {
  std::string text;
  for (std::size_t i = 0; i < spelling.size(); ++i) {
    if (spelling[i] != '\\' || i + 1 == spelling.size()) {
      text += spelling[i];
      continue;
    }
    const char c = spelling[++i];
    const auto simple = std::string_view("abfnrtv").find(c);
    if (simple != std::string_view::npos) {
      text += "\a\b\f\n\r\t\v"[simple];
      continue;
    }
    const unsigned base = c == 'x' ? 16 : 8;
    std::size_t at = c == 'x' ? i + 1 : i;
    unsigned value = 0;
    std::size_t digits = 0;
    while (at < spelling.size() && digits < (c == 'x' ? 2U : 3U) && digit(spelling[at]) < base) {
      value = value * base + digit(spelling[at++]);
      ++digits;
    }
    if (digits == 0) {
      text += c;  // an escaped quote, backslash or anything else stands for itself
      continue;
    }
    text += static_cast<char>(value);
    i = at - 1;
  }
  return text;
}

}  // namespace cie::analysis::ctf
