// A snapshot as text, for pipes and logs.
#pragma once

#include <cie/viewer_export/text_style.hpp>

#include "choice.hpp"
#include "names.hpp"
#include "snapshot.hpp"
#include "words/text_layout.hpp"

#include <string>
#include <string_view>

namespace cie::live {

// Ends with an empty line. Names are printable whatever the trace holds.
std::string batch_text(const Snapshot& snapshot, SortKey key, std::string_view filter,
                       const viewer_export::TextStyle& style);

// The first lines of every view: state, the gravest rule, rate, losses; without what is watched, for
// which there may be little room. Without colours or line ends.
std::vector<std::string> headline(const Snapshot& snapshot);
// What a callback is called: with its machine in front, where several are followed.
std::string name_of(const CallbackView& callback, const Snapshot& snapshot);
// "isolated", "not isolated", "never ran" or "isolation unknown".
std::string_view isolation_of(const CallbackView& callback);
// What became of each machine, where several are followed.
std::vector<std::string> host_lines(const Snapshot& snapshot);

// How long the instance has been open that has been so for longest, if that is long, else the last
// response time; "-": none.
viewer_export::TextCell last_response(const CallbackView& callback);
// "planner ← /pose has not ended for 4.9 s (deadline 50 ms)": whose instance has been open for longest of
// those that have been so for long. Empty: none.
viewer_export::TextCell open_words(const Snapshot& snapshot, const Names& names);

// "20:15:07", of the local time zone.
std::string clock_time(std::int64_t realtime_ns);

// Which subject, and why; of either kind.
template <typename Told>
std::string sentence_of(const Told& told) {
  return told.says.empty() ? told.subject + ": " + told.note : told.says;
}

}  // namespace cie::live
