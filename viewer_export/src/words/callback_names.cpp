#include "callback_names.hpp"

#include <cie/analysis/report_rows.hpp>
#include <cie/tracepoints/logical_id.hpp>

#include "text_layout.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <set>
#include <system_error>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::CallbackReport;
using analysis::ChainReport;
using analysis::Report;

// Between a node and what its callback takes or serves, and between the ends of a chain.
constexpr std::string_view kTakes = " ← ";
constexpr std::string_view kTakesPlain = " <- ";
constexpr std::string_view kServes = " ⇐ ";
constexpr std::string_view kServesPlain = " <= ";
constexpr std::string_view kLeadsTo = " → ";
constexpr std::string_view kLeadsToPlain = " -> ";

bool is_number(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

// Empty where the node has no name.
std::optional<LogicalId> parts_of(std::string_view id) {
  const auto parts = LogicalId::parse(id);
  return parts && !parts->node.empty() ? parts : std::nullopt;
}

// "unknown callback 2" of "?2": its callback_init was not seen. Empty of another id.
std::string unknown_words(std::string_view id) {
  if (!id.starts_with('?') || !is_number(id.substr(1))) return {};
  return "unknown callback " + std::string(id.substr(1));
}

// "100 ms", "33.33 ms"; a timer's own name stays.
std::string period_words(std::string_view what) {
  std::int64_t ns = 0;
  const auto [end, error] = std::from_chars(what.data(), what.data() + what.size(), ns);
  constexpr std::int64_t kTooLong = 9'999'000'000'000;  // for four digits of seconds
  if (!is_number(what) || error != std::errc{} || ns >= kTooLong) return printable(what);
  return short_duration(ns);
}

// "~/get" of "/plan/get" for the node "/plan".
std::string source_words(const LogicalId& parts) {
  const bool is_below = parts.what.size() > parts.node.size() + 1 &&
                        parts.what.starts_with(parts.node) && parts.what[parts.node.size()] == '/';
  return is_below ? "~" + printable(parts.what.substr(parts.node.size())) : printable(parts.what);
}

// "100 ms"; of a timer with a name "tick 100 ms", or "tick" where its period is not known.
std::string timer_words(std::string_view what, std::uint64_t period_ns) {
  auto words = period_words(what);
  if (is_number(what) || period_ns == 0) return words;
  return words + ' ' + period_words(std::to_string(period_ns));
}

std::string name_words(const LogicalId& parts, std::uint64_t period_ns, const std::string& node,
                       const TextStyle& style) {
  const auto said = [&]() -> std::string {
    if (parts.kind == "Timer") return " timer " + timer_words(parts.what, period_ns);
    if (parts.kind == "Subscription")
      return std::string(style.unicode ? kTakes : kTakesPlain) + source_words(parts);
    if (parts.kind == "Service")
      return std::string(style.unicode ? kServes : kServesPlain) + source_words(parts);
    if (parts.kind == "Client") return " client " + source_words(parts);
    return ' ' + printable(parts.kind) + ' ' + source_words(parts);
  };
  const auto number = parts.number.empty() ? std::string() : " #" + std::string(parts.number);
  return node + said() + number;
}

// What is left of a name without its first parts; empty at its end.
std::string_view without_first_part(std::string_view name) {
  const auto slash = name.find('/', 1);
  return slash == std::string_view::npos ? std::string_view() : name.substr(slash);
}

// Each node's name from the part on from which no other node ends likewise; all of it if there is
// no such part.
std::map<std::string_view, std::string> short_nodes(const std::set<std::string_view>& nodes) {
  std::map<std::string_view, std::size_t> ends;  // "/b" of "/a/b": how many nodes end so
  for (const auto node : nodes) {
    for (auto end = node; !end.empty(); end = without_first_part(end))
      ++ends[end];
  }
  std::map<std::string_view, std::string> names;
  for (const auto node : nodes) {
    auto shortest = node;
    for (auto end = node; !end.empty() && ends[end] == 1; end = without_first_part(end))
      shortest = end;
    const bool is_all = ends[shortest] > 1;
    if (!is_all && shortest.starts_with('/')) shortest.remove_prefix(1);
    names.emplace(node, printable(shortest));
  }
  return names;
}

// " (pid 4001)" or " (pid 4001, program 2)", as much as tells the processes apart.
std::string place_of(const analysis::ProcessReport& process,
                     const std::vector<const analysis::ProcessReport*>& among) {
  std::set<std::string> pids;
  std::set<std::string_view> hosts;
  for (const auto* other : among) {
    pids.insert(pid_words(*other));
    hosts.insert(other->host);
  }
  if (pids.size() == 1 && hosts.size() == 1) return {};
  if (hosts.size() == among.size()) return " on " + printable(process.host);
  const auto host = hosts.size() > 1 ? " on " + printable(process.host) : std::string();
  return fmt::format(" ({}{})", pid_words(process), host);
}

// With what tells rows of one name apart: which life of a callback they are, and the processes that
// they are of.
template <typename Row>
struct Named {
  Row row;
  std::optional<analysis::ProcessIndex> process{};
  std::string ordinal{};
};
template <typename Row, typename Keep>
void place(const std::map<std::string, std::vector<Named<Row>>>& by_name,
           const analysis::ReportRows& rows, const Keep& keep) {
  for (const auto& [name, alike] : by_name) {
    std::vector<const analysis::ProcessReport*> processes;
    for (const auto& named : alike)
      processes.push_back(named.process ? &rows.process(*named.process) : nullptr);
    std::erase(processes, nullptr);
    for (const auto& named : alike) {
      const bool is_placed = alike.size() > 1 && named.process.has_value();
      const auto where =
          is_placed ? place_of(rows.process(*named.process), processes) : std::string();
      keep(named.row, fmt::format("{}{}{}", name, named.ordinal, where));
    }
  }
}

bool is_named_by_hops(const ChainReport& chain) {
  return !chain.is_specified && chain.name.find(" -> ") != std::string::npos && !chain.hops.empty();
}

}  // namespace

CallbackNames::CallbackNames(const Report& report, const TextStyle& style) {
  std::vector<std::string> ids;
  Periods periods;
  for (const auto& callback : report.callbacks) {
    ids.push_back(callback.logical_id);
    const auto period = callback.period_ns.value_or(0);
    const auto [known, is_new] = periods.emplace(callback.logical_id, period);
    if (!is_new && known->second != period) known->second = 0;  // it differs between processes
  }
  name_ids(std::move(ids), periods, style);
  name_callbacks(report);
  name_chains(report, style);
}

CallbackNames::CallbackNames(const std::vector<std::string>& ids, const TextStyle& style) {
  name_ids(ids, {}, style);
}

void CallbackNames::name_ids(std::vector<std::string> ids, const Periods& periods,
                             const TextStyle& style) {
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  std::set<std::string_view> nodes;
  for (const auto& id : ids) {
    if (const auto parts = parts_of(id)) nodes.insert(parts->node);
  }
  const auto short_of = short_nodes(nodes);
  std::map<std::string, std::size_t> times;
  for (const auto& id : ids) {
    Name name{.node = {}, .all = printable(id)};
    if (const auto parts = parts_of(id); parts && !style.ids) {
      name.node = short_of.at(parts->node);
      const auto period = periods.find(id);
      name.all = name_words(*parts, period == periods.end() ? 0 : period->second, name.node, style);
    } else if (auto unknown = unknown_words(id); !unknown.empty() && !style.ids) {
      name.all = std::move(unknown);
    }
    ++times[name.all];
    of_id_.emplace(id, std::move(name));
  }
  for (auto& [id, name] : of_id_) {  // periods that differ behind the fourth digit
    if (times.at(name.all) > 1) name.all = printable(id);
  }
}

void CallbackNames::name_callbacks(const Report& report) {
  std::map<std::string, std::vector<Named<analysis::CallbackIndex>>> by_name;
  for (const auto& callback : report.callbacks) {
    by_name[of_id(callback.logical_id)].push_back(
        {callback.index, callback.process, ordinal(callback)});
  }
  place(by_name, analysis::ReportRows(report), [this](auto index, const std::string& name) {
    of_callback_.insert_or_assign(index, name);
  });
}

void CallbackNames::name_chains(const Report& report, const TextStyle& style) {
  const auto arrow = style.unicode ? kLeadsTo : kLeadsToPlain;
  const auto node_of = [this](const std::string& id) {
    const auto found = of_id_.find(id);
    return found == of_id_.end() || found->second.node.empty() ? of_id(id) : found->second.node;
  };
  const auto ends = [&](const ChainReport& chain, const auto& name_of) {
    return fmt::format("{}{}{}", name_of(chain.hops.front()), arrow, name_of(chain.hops.back()));
  };
  std::map<std::string_view, std::size_t> callbacks_of;  // by node
  for (const auto& [id, name] : of_id_)
    ++callbacks_of[name.node];
  const auto is_told_by_node = [&](const std::string& id) {
    const auto found = of_id_.find(id);
    return found == of_id_.end() || callbacks_of.at(found->second.node) == 1;
  };
  // A node tells its callback where it has no other one. What several chains have between the same
  // nodes is told by the callbacks, then by numbers.
  std::map<std::string, std::set<std::string_view>> between_nodes;
  std::map<std::string, std::vector<std::string_view>> between_callbacks;
  const auto full = [this](const std::string& id) { return of_id(id); };
  for (const auto& chain : report.chains) {
    if (!is_named_by_hops(chain)) continue;
    between_nodes[ends(chain, node_of)].insert(chain.name);
    auto& alike = between_callbacks[ends(chain, full)];
    if (std::ranges::find(alike, chain.name) == alike.end()) alike.push_back(chain.name);
  }
  const auto name_of = [&](const ChainReport& chain) -> std::string {
    if (!is_named_by_hops(chain)) return printable(chain.name);
    auto name = ends(chain, node_of);
    const bool are_ends_told =
        is_told_by_node(chain.hops.front()) && is_told_by_node(chain.hops.back());
    if (are_ends_told && between_nodes.at(name).size() == 1) return name;
    name = ends(chain, full);
    const auto& alike = between_callbacks.at(name);
    const auto number = std::ranges::find(alike, chain.name) - alike.begin() + 1;
    return number == 1 ? name : fmt::format("{} #{}", name, number);
  };
  std::map<std::string, std::vector<Named<ChainKey>>> by_name;
  for (const auto& chain : report.chains)
    by_name[name_of(chain)].push_back({{chain.name, chain.process}, chain.process});
  place(by_name, analysis::ReportRows(report), [this](const auto& key, const std::string& name) {
    of_chain_.insert_or_assign(key, name);
  });
}

std::string CallbackNames::of(const CallbackReport& callback) const {
  const auto found = of_callback_.find(callback.index);
  return found == of_callback_.end() ? of_id(callback.logical_id) : found->second;
}

std::string CallbackNames::of(const ChainReport& chain) const {
  const auto found = of_chain_.find(ChainKey{chain.name, chain.process});
  return found == of_chain_.end() ? printable(chain.name) : found->second;
}

std::string CallbackNames::of_id(std::string_view id) const {
  const auto found = of_id_.find(id);
  return found == of_id_.end() ? printable(id) : found->second.all;
}

std::string CallbackNames::in_words(std::string_view sentence) const {
  std::string text;
  std::size_t told = 0;
  for (std::size_t i = 0; i < sentence.size(); ++i) {
    const auto end = end_of_id(sentence, i);
    const bool is_quoted = i > 0 && sentence[i - 1] == '"';
    if (end == i || is_quoted) continue;
    text += printable(sentence.substr(told, i - told)) + of_id(sentence.substr(i, end - i));
    told = end;
    i = end - 1;
  }
  return text + printable(sentence.substr(told));
}

std::string without_symbols(std::string text) {
  for (const auto& [symbol, plain] :
       {std::pair(kTakes, kTakesPlain), std::pair(kServes, kServesPlain),
        std::pair(kLeadsTo, kLeadsToPlain)}) {
    for (auto at = text.find(symbol); at != std::string::npos; at = text.find(symbol, at))
      text.replace(at, symbol.size(), plain);
  }
  return text;
}

std::size_t end_of_id(std::string_view sentence, std::size_t at) {
  const char before = at == 0 ? ' ' : sentence[at - 1];
  const bool is_begin = std::isalnum(static_cast<unsigned char>(before)) == 0 && before != '_';
  if (sentence[at] != '/' || !is_begin) return at;
  constexpr std::size_t kLongest = 1024;  // names of a trace may hold nothing but slashes
  const auto part = sentence.substr(at, kLongest);
  const auto mark = part.find_first_of("@ ");
  if (mark == std::string_view::npos || part[mark] != '@') return at;
  auto end = part.find(')', mark);
  if (end == std::string_view::npos) return at;
  end += at + 1;
  if (end + 1 < sentence.size() && sentence[end] == '#') {
    const auto digits = sentence.find_first_not_of("0123456789", end + 1);
    if (digits != end + 1) end = std::min(digits, sentence.size());
  }
  return end;
}

std::string without_subjects(std::string_view sentence) {
  constexpr std::string_view kDigits = "0123456789";
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::string text;
  for (std::size_t i = 0; i < sentence.size();) {
    const bool is_begin =
        i == 0 ||
        (std::isalnum(static_cast<unsigned char>(sentence[i - 1])) == 0 && sentence[i - 1] != '_');
    if (const auto end = end_of_id(sentence, i); end > i) {
      text += "a callback";
      i = end;
    } else if (is_begin && is_digit(sentence[i])) {
      text += 'N';
      i = std::min(sentence.find_first_not_of(kDigits, i), sentence.size());
    } else {
      text += sentence[i++];
    }
  }
  return text;
}

}  // namespace cie::viewer_export
