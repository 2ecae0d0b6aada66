// Short names of a snapshot's callbacks, made as those of every other output.
#pragma once

#include "snapshot.hpp"
#include "words/callback_names.hpp"

#include <map>
#include <string>
#include <string_view>

namespace cie::live {

// Copies what it needs.
class Names {
 public:
  Names(const Snapshot& snapshot, const viewer_export::TextStyle& style);

  std::string of(const CallbackView& callback) const;
  // A sentence with short names in place of logical ids; printable. Of one that has such names, as
  // `says` has, without symbols where the style has none.
  std::string in_words(std::string_view sentence) const;

 private:
  std::map<std::uint32_t, std::string> by_index_;
  viewer_export::CallbackNames names_;
  bool has_symbols_;
};

}  // namespace cie::live
