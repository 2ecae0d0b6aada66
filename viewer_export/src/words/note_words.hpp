// Sentences of what evidence shows.
#pragma once

#include <cie/analysis/note.hpp>
#include <cie/viewer_export/sentences.hpp>

#include "callback_names.hpp"

#include <span>
#include <string>
#include <string_view>

namespace cie::viewer_export {

// As screens have it: "seq 3 starts 1.2 us late", with callbacks' names. Printable.
std::string sentence(const analysis::Note& note, const CallbackNames& names);
// The same of several, "; " between them: durations that differ read differently.
std::string sentence(std::span<const analysis::Note* const> notes, const CallbackNames& names);
// With logical ids, and durations as screens have them. Not escaped.
std::string sentence_with_units(const analysis::Note& note);

// Its code, and those of the notes in it: notes of one are alike.
std::string codes_of(const analysis::Note& note);

// Every note of it has a sentence, and every place of that an argument.
bool is_worded(const analysis::Note& note);

// The sentence of a code; empty: there is none. "{name}" is the place of an argument, "{name:loss}" that of a number of
// losses, "{name?was|were}" of a word that goes with the number.
std::string_view sentence_of_code(std::string_view code) noexcept;

}  // namespace cie::viewer_export
