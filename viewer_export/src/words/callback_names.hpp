// What callbacks are called for people: "planner timer 100 ms", "planner timer tick 100 ms" (of a
// timer with a name), "planner ← /pose" (subscription), "cruise ⇐ /car/limit" (service), "cruise
// client /add"; "~" stands for the node in names below it. Of the node's namespace there is as much
// as tells nodes apart; pid and host stand behind names that several processes have.
#pragma once

#include <cie/analysis/identity.hpp>
#include <cie/analysis/report.hpp>
#include <cie/viewer_export/text_style.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cie::viewer_export {

// Printable, and different where ids or processes are. Copies what it needs.
class CallbackNames {
 public:
  // Of the report's callbacks. By `style`: arrows where it has symbols, else "<-" and "<="; logical
  // ids instead where it asks for them.
  CallbackNames(const analysis::Report& report, const TextStyle& style);
  // Of callbacks of which nothing is known but their logical ids.
  CallbackNames(const std::vector<std::string>& ids, const TextStyle& style);

  std::string of(const analysis::CallbackReport& callback) const;
  // The name that somebody gave it, else "planner → brake" of its first and its last callback: by
  // their nodes, where neither has another callback, else by their own names.
  std::string of(const analysis::ChainReport& chain) const;
  // Without a process; what is no id of these callbacks stays as it is.
  std::string of_id(std::string_view id) const;
  // A sentence with such names in place of logical ids. Those in quotation marks stay: they are for
  // a spec.
  std::string in_words(std::string_view sentence) const;

 private:
  struct Name {
    std::string node;  // as `all` has it; empty where that is the id
    std::string all;
  };
  using ChainKey = std::pair<std::string, std::optional<analysis::ProcessIndex>>;

  using Periods = std::map<std::string_view, std::uint64_t>;  // by id; 0: not known
  void name_ids(std::vector<std::string> ids, const Periods& periods, const TextStyle& style);
  void name_callbacks(const analysis::Report& report);
  void name_chains(const analysis::Report& report, const TextStyle& style);

  std::map<std::string, Name, std::less<>> of_id_;
  std::map<analysis::CallbackIndex, std::string> of_callback_;
  std::map<ChainKey, std::string> of_chain_;
};

// Names in a text as a style without symbols has them: "planner <- /pose".
std::string without_symbols(std::string text);

// Where a logical id that begins at `at` of a sentence ends; `at` if there is none.
std::size_t end_of_id(std::string_view sentence, std::size_t at);

// Sentences that differ in numbers and logical ids only are the same with "N" and "a callback" in
// their place.
std::string without_subjects(std::string_view sentence);

}  // namespace cie::viewer_export
