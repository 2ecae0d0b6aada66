// What evidence shows: a code, and what it is about. `cie` makes sentences of it (see README of viewer_export).
#pragma once

#include <cie/analysis/time.hpp>

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace cie::analysis {

// A callback, by its logical id.
struct NamedCallback {
  std::string id;
  friend bool operator==(const NamedCallback&, const NamedCallback&) = default;
  friend auto operator<=>(const NamedCallback&, const NamedCallback&) = default;
};

// A file of a recording.
struct NamedFile {
  std::string path;
  friend bool operator==(const NamedFile&, const NamedFile&) = default;
  friend auto operator<=>(const NamedFile&, const NamedFile&) = default;
};

struct Argument;

// Compared by code, then by arguments. Borrows its code and its arguments' names, which are literals.
struct Note {
  std::string_view code{};  // "deadline-missed"; empty: nothing is to be said
  std::vector<Argument> arguments;

  bool empty() const noexcept { return code.empty(); }
  friend bool operator==(const Note& a, const Note& b) noexcept;
  friend bool operator<(const Note& a, const Note& b) noexcept;
};

struct Argument {
  // A note: what else is to be said; without a code, nothing.
  using Value = std::variant<std::int64_t, std::uint64_t, Duration, Timestamp, std::string,
                             NamedCallback, NamedFile, Note>;

  Argument(std::string_view its_name, std::signed_integral auto number)
      : name{its_name}, value{std::int64_t{number}} {}
  Argument(std::string_view its_name, std::unsigned_integral auto number)
      : name{its_name}, value{std::uint64_t{number}} {}
  Argument(std::string_view its_name, std::string_view text)
      : name{its_name}, value{std::string(text)} {}
  Argument(std::string_view its_name, std::string text) : name{its_name}, value{std::move(text)} {}
  Argument(std::string_view its_name, const char* text) : Argument(its_name, std::string(text)) {}
  Argument(std::string_view its_name, std::optional<Note> note)
      : name{its_name}, value{std::move(note).value_or(Note{})} {}
  template <typename T>
  requires std::same_as<T, Duration> || std::same_as<T, Timestamp> ||
      std::same_as<T, NamedCallback> || std::same_as<T, NamedFile> || std::same_as<T, Note>
      Argument(std::string_view its_name, T its) : name{its_name}, value{std::move(its)} {}

  friend bool operator==(const Argument&, const Argument&) = default;
  friend bool operator<(const Argument& a, const Argument& b) noexcept {
    return a.name != b.name ? a.name < b.name : a.value < b.value;
  }

  std::string_view name;
  Value value;
};

inline bool operator==(const Note& a, const Note& b) noexcept {
  return a.code == b.code && a.arguments == b.arguments;
}
inline bool operator<(const Note& a, const Note& b) noexcept {
  return a.code != b.code ? a.code < b.code : a.arguments < b.arguments;
}

inline Note note(std::string_view code, std::initializer_list<Argument> arguments = {}) {
  return {.code = code, .arguments = arguments};
}
// A sentence as it is.
inline Note free_text(std::string text) { return note("text", {{"text", std::move(text)}}); }

// Of the note itself; null: it has none of that name.
inline const Argument* find_argument(const Note& note, std::string_view name) noexcept {
  const auto found = std::ranges::find(note.arguments, name, &Argument::name);
  return found == note.arguments.end() ? nullptr : &*found;
}

// Itself, or the first note in it, of that code; null: there is none.
inline const Note* find_note(const Note& note, std::string_view code) noexcept {
  if (note.code == code) return &note;
  for (const auto& argument : note.arguments) {
    const auto* inner = std::get_if<Note>(&argument.value);
    const auto* found = inner != nullptr ? find_note(*inner, code) : nullptr;
    if (found != nullptr) return found;
  }
  return nullptr;
}

// Calls visit() with each argument, those of notes in it among them.
template <typename Visit>
void for_each_argument(Note& note, const Visit& visit) {
  for (auto& argument : note.arguments) {
    if (auto* inner = std::get_if<Note>(&argument.value)) {
      for_each_argument(*inner, visit);
    } else {
      visit(argument);
    }
  }
}

}  // namespace cie::analysis
