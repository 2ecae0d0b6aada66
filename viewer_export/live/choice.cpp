#include "choice.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <tuple>
#include <utility>

namespace cie::live {
namespace {

constexpr std::array<std::pair<SortKey, std::string_view>, 7> kKeys{{{SortKey::response, "p99"},
                                                                     {SortKey::p50, "p50"},
                                                                     {SortKey::max, "max"},
                                                                     {SortKey::rate, "rate"},
                                                                     {SortKey::late, "late"},
                                                                     {SortKey::missed, "missed"},
                                                                     {SortKey::name, "name"}}};

std::string lower(std::string_view text) {
  std::string result(text);
  for (auto& c : result)
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

std::int64_t value_of(const CallbackView& callback, SortKey key) {
  const auto of_response = [&callback](std::int64_t analysis::Summary::*field) {
    return callback.response ? *callback.response.*field : -1;
  };
  switch (key) {
    case SortKey::response:
      return of_response(&analysis::Summary::p99);
    case SortKey::p50:
      return of_response(&analysis::Summary::p50);
    case SortKey::max:
      return of_response(&analysis::Summary::max);
    case SortKey::rate:
      return static_cast<std::int64_t>(callback.instances);
    case SortKey::late:
      return callback.total_late ? static_cast<std::int64_t>(*callback.total_late) : -1;
    case SortKey::missed:
      return callback.total_missed ? static_cast<std::int64_t>(*callback.total_missed) : -1;
    case SortKey::name:
      break;
  }
  return 0;
}

}  // namespace

std::string_view label(SortKey key) noexcept {
  for (const auto& [known, text] : kKeys) {
    if (known == key) return text;
  }
  return {};
}

std::optional<SortKey> sort_key(std::string_view text) noexcept {
  for (const auto& [key, known] : kKeys) {
    if (known == text) return key;
  }
  return std::nullopt;
}

std::vector<const CallbackView*> choose(const Snapshot& snapshot, SortKey key,
                                        std::string_view filter) {
  const auto wanted = lower(filter);
  std::vector<const CallbackView*> chosen;
  for (const auto& callback : snapshot.callbacks) {
    const auto names = lower(callback.logical_id) + '\n' + lower(callback.name) + '\n' +
                       lower(callback.host) + '\n' + std::to_string(callback.pid);
    if (names.find(wanted) != std::string::npos) chosen.push_back(&callback);
  }
  std::ranges::stable_sort(chosen, [key](const CallbackView* a, const CallbackView* b) {
    const auto place = [key](const CallbackView& c) {
      return std::tuple(-value_of(c, key), std::string_view(c.name), std::string_view(c.logical_id),
                        c.pid);
    };
    return place(*a) < place(*b);
  });
  return chosen;
}

}  // namespace cie::live
