// JSON written as it comes, without a document in memory: the bytes that write_json() writes of the
// same values. Keys are in the order given, once each, and need no escapes.
#pragma once

#include <array>
#include <charconv>
#include <concepts>
#include <cstddef>
#include <ostream>
#include <string>
#include <string_view>

namespace cie::viewer_export {

class JsonText {
 public:
  static constexpr int kOneLine = -1;

  // Borrowed until flush(). `indentation`: spaces per level.
  explicit JsonText(std::ostream& out, int indentation = 2)
      : out_(out), indentation_(indentation) {}
  JsonText(const JsonText&) = delete;
  JsonText& operator=(const JsonText&) = delete;

  template <std::invocable Members>
  void object(const Members& members) {
    nest('{', '}', members);
  }
  template <std::invocable Elements>
  void array(const Elements& elements) {
    nest('[', ']', elements);
  }
  void key(std::string_view name);  // before each member's value
  void element() { separate(); }    // before each element of an array

  void null() { text_ += "null"; }
  void value(std::same_as<bool> auto value) { text_ += value ? "true" : "false"; }
  void value(double value);
  void value(std::string_view value);
  template <std::integral Integer>
  requires(!std::same_as<Integer, bool>) void value(Integer value) {
    std::array<char, 20> digits{};
    text_.append(digits.data(), std::to_chars(digits.begin(), digits.end(), value).ptr);
  }
  // A value that is JSON already.
  void verbatim(std::string_view json) { text_ += json; }

  // Once, at the end.
  void flush();

 private:
  template <typename Inside>
  void nest(char begin, char end, const Inside& inside) {
    text_ += begin;
    ++depth_;
    is_empty_ = true;
    inside();
    --depth_;
    if (!is_empty_) break_line();
    is_empty_ = false;
    text_ += end;
  }
  void separate();
  void break_line();

  std::ostream& out_;
  int indentation_;
  std::size_t depth_ = 0;
  bool is_empty_ = true;  // the innermost object or array, so far
  std::string text_;      // not in `out_` yet
};

}  // namespace cie::viewer_export
