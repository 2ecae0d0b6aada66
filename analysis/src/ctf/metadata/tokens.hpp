// Splits TSDL, the language of CTF 1.8 metadata, into tokens.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>

namespace cie::analysis::ctf {

// The metadata cannot be understood; what() names line and cause.
class MetadataError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// So much of a name of the metadata goes into a message, in characters.
inline constexpr std::size_t kShown = 100;

// CTF 2's fragments are separated by them, as JSON's tokens are.
inline constexpr std::string_view kBlank = " \t\r\n";

struct Token {
  enum class Kind : std::uint8_t { end, name, number, text, punctuation };
  Kind kind = Kind::end;
  std::string_view spelling;  // into the metadata; of a text, without quotes
  std::uint64_t number = 0;

  bool is(std::string_view punctuation_or_name) const noexcept {
    return (kind == Kind::punctuation || kind == Kind::name) && spelling == punctuation_or_name;
  }
};

// `text` is borrowed.
class Tokens {
 public:
  explicit Tokens(std::string_view text);

  // The next token, and the one after it.
  const Token& peek() const noexcept { return current_; }
  const Token& peek_next() const noexcept { return next_; }
  Token take();
  // Takes it if it is there. Inline: most often it is not, and what is asked for is known here.
  bool accept(std::string_view spelling) {
    if (!current_.is(spelling)) return false;
    advance();
    return true;
  }
  void expect(std::string_view spelling);
  // If "{" is next: the text from there to the first "}". Empty: it is not, or there is none.
  std::string_view block() const noexcept;
  // If "struct {" is next: the text from there to the "}" that closes it, if that refers to nothing
  // outside and has neither texts nor comments. Empty: it is not, or has.
  std::string_view plain_structure() const noexcept;
  // Goes on after a text that begins with the next token.
  void skip(std::string_view text);
  // Goes on where a part of the text begins.
  void go_to(std::string_view part);
  [[noreturn]] void fail(const std::string& what) const;

 private:
  void advance();
  Token scan();
  void skip_blank();
  bool is_next(std::string_view text) const noexcept {
    return text_.substr(at_, text.size()) == text;
  }
  Token scan_number();
  Token scan_text();
  Token scan_character();
  // `what` of the place `at`.
  [[noreturn]] void fail_at(std::size_t at, const std::string& what) const;

  std::string_view text_;
  std::size_t at_ = 0;
  Token current_;
  Token next_;
};

// The characters that a text token stands for.
std::string unescape(std::string_view spelling);

}  // namespace cie::analysis::ctf
