// What evidence shows, in a sentence.
#pragma once

#include <cie/analysis/note.hpp>

#include <string>

namespace cie::viewer_export {

// As documents have it: "seq 3 starts, whose end was not seen", with logical ids and nanoseconds. Not escaped.
std::string sentence(const analysis::Note& note);

}  // namespace cie::viewer_export
