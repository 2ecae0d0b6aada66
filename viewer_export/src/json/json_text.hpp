// JSON written as it comes, without a document in memory: the bytes that write_json() writes of the
// same values. Keys are in the order given, once each, and need no escapes.
#pragma once

#include <charconv>
#include <concepts>
#include <cstddef>
#include <ostream>
#include <string_view>
#include <vector>

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
  void element();                   // before each element of an array

  void null() { verbatim("null"); }
  void value(std::same_as<bool> auto value) { verbatim(value ? "true" : "false"); }
  void value(double value);
  void value(std::string_view value);
  template <std::integral Integer>
  requires(!std::same_as<Integer, bool>) void value(Integer value) {
    constexpr std::size_t kDigits = 20;
    auto* digits = room(kDigits);
    at_ = std::to_chars(digits, digits + kDigits, value).ptr;
  }
  // A value that is JSON already.
  void verbatim(std::string_view json) { at_ += json.copy(room(json.size()), json.size()); }

  // Once, at the end.
  void flush();

 private:
  template <typename Inside>
  void nest(char begin, char end, const Inside& inside) {
    *room(1) = begin;
    ++at_;
    ++depth_;
    is_empty_ = true;
    inside();
    --depth_;
    if (!is_empty_) begin_last_line();
    is_empty_ = false;
    *room(1) = end;
    ++at_;
  }
  // Where that many bytes may be written; whoever does moves `at_` behind them.
  char* room(std::size_t size) {
    if (static_cast<std::size_t>(end_ - at_) < size) [[unlikely]]
      make_room(size);
    return at_;
  }
  void make_room(std::size_t size);
  // Writes what comes before a member or an element. The place behind it has that many bytes.
  inline char* separate(std::size_t size);
  void begin_last_line();
  std::size_t line_size() const noexcept {
    return indentation_ == kOneLine ? 0 : 1 + depth_ * static_cast<std::size_t>(indentation_);
  }
  // Writes what comes before a line, if there are lines. The place behind it has that many bytes.
  inline char* begin_line(bool has_comma, std::size_t size);

  std::ostream& out_;
  int indentation_;
  std::size_t depth_ = 0;
  bool is_empty_ = true;  // the innermost object or array, so far
  std::vector<char> text_;
  char* at_ = nullptr;  // behind what is not in `out_` yet
  char* end_ = nullptr;
};

}  // namespace cie::viewer_export
