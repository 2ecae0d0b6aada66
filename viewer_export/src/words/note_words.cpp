#include "note_words.hpp"

#include <cie/viewer_export/text_style.hpp>

#include "base/text.hpp"
#include "text_layout.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <variant>

namespace cie::viewer_export {

namespace {

using analysis::Argument;
using analysis::Note;

// A place for an argument in a sentence.
struct Place {
  std::string_view name;
  char mark = '\0';         // ':' before a noun, '?' before words
  std::string_view words;   // behind the mark, that of one
  std::string_view plural;  // behind '|'; empty: none is told
};

Place place_of(std::string_view inside) {
  const auto mark = inside.find_first_of(":?");
  if (mark == std::string_view::npos) {
    return {.name = inside, .words = {}, .plural = {}};
  }
  const auto words = inside.substr(mark + 1);
  const auto bar = words.find('|');
  return {.name = inside.substr(0, mark),
          .mark = inside[mark],
          .words = words.substr(0, bar),
          .plural = bar == std::string_view::npos ? std::string_view() : words.substr(bar + 1)};
}

// Calls on_text() and on_place() with the parts of a sentence.
template <typename OnText, typename OnPlace>
void for_each_part(std::string_view sentence, const OnText& on_text, const OnPlace& on_place) {
  while (!sentence.empty()) {
    const auto begin = std::min(sentence.find('{'), sentence.size());
    on_text(sentence.substr(0, begin));
    sentence.remove_prefix(begin);
    if (sentence.empty()) {
      return;
    }
    const auto end = std::min(sentence.find('}'), sentence.size());
    on_place(place_of(sentence.substr(1, end - 1)));
    sentence.remove_prefix(std::min(end + 1, sentence.size()));
  }
}

std::optional<std::uint64_t> count_of(const Argument& argument) {
  if (const auto* count = std::get_if<std::uint64_t>(&argument.value)) {
    return *count;
  }
  if (const auto* number = std::get_if<std::int64_t>(&argument.value)) {
    return static_cast<std::uint64_t>(*number);
  }
  return std::nullopt;
}

class Writer {
 public:
  explicit Writer(bool has_units, const CallbackNames* names = nullptr)
      : has_units_{has_units}, names_{names} {}

  void write(std::string_view text) { text_ += text; }

  void write(const Note& note) {
    for_each_part(
        sentence_of_code(note.code), [this](std::string_view text) { text_ += text; },
        [&](const Place& place) {
          if (const auto* argument = find_argument(note, place.name)) {
            write(*argument, place);
          }
        });
  }

  std::string take() && { return std::move(text_); }

 private:
  void write(const Argument& argument, const Place& place) {
    const auto count = count_of(argument);
    if (count && place.mark == ':') {
      text_ += counted(*count, place.words, place.plural);
    } else if (count && place.mark == '?') {
      text_ += *count == 1 ? place.words : place.plural;
    } else {
      std::visit([this](const auto& value) { write_value(value); }, argument.value);
    }
  }

  void write_value(std::int64_t number) { text_ += std::to_string(number); }
  void write_value(std::uint64_t number) { text_ += std::to_string(number); }
  void write_value(analysis::Timestamp time) { text_ += std::to_string(time.ns) + " ns"; }
  // Durations that differ read differently.
  void write_value(analysis::Duration duration) {
    if (!has_units_) {
      text_ += std::to_string(duration.ns) + " ns";
      return;
    }
    const auto [first, is_new] = durations_.try_emplace(format_duration(duration.ns), duration.ns);
    text_ += first->first + difference_unseen(duration.ns, first->second);
  }
  void write_value(const std::string& text) { text_ += names_ == nullptr ? text : printable(text); }
  void write_value(const analysis::NamedCallback& callback) {
    text_ += names_ == nullptr ? callback.id : names_->of_id(callback.id);
  }
  void write_value(const analysis::NamedFile& file) { write_value(file.path); }
  void write_value(const Note& note) { write(note); }

  bool has_units_;                                 // or nanoseconds alone
  const CallbackNames* names_;                     // null: ids, nothing is escaped
  std::map<std::string, std::int64_t> durations_;  // by how they read, the first one
  std::string text_;
};

}  // namespace

std::string sentence(const Note& note) {
  Writer writer(false);
  writer.write(note);
  return std::move(writer).take();
}

std::string sentence(const Note& note, const CallbackNames& names) {
  const auto* one = &note;
  return sentence({&one, 1}, names);
}

std::string sentence(std::span<const Note* const> notes, const CallbackNames& names) {
  Writer writer(true, &names);
  for (std::size_t i = 0; i < notes.size(); ++i) {
    writer.write(i == 0 ? "" : "; ");
    writer.write(*notes[i]);
  }
  return std::move(writer).take();
}

std::string sentence_with_units(const Note& note) {
  Writer writer(true);
  writer.write(note);
  return std::move(writer).take();
}

std::string codes_of(const Note& note) {
  std::string codes(note.code);
  for (const auto& argument : note.arguments) {
    if (const auto* inner = std::get_if<Note>(&argument.value)) {
      codes += ' ' + codes_of(*inner);
    }
  }
  return codes;
}

bool is_worded(const Note& note) {
  bool is_whole = note.empty() || !sentence_of_code(note.code).empty();
  for_each_part(
      sentence_of_code(note.code), [](std::string_view /*text*/) {},
      [&](const Place& place) {
        is_whole = is_whole && find_argument(note, place.name) != nullptr;
      });
  return is_whole && std::ranges::all_of(note.arguments, [](const Argument& argument) {
           const auto* inner = std::get_if<Note>(&argument.value);
           return inner == nullptr || is_worded(*inner);
         });
}

}  // namespace cie::viewer_export
