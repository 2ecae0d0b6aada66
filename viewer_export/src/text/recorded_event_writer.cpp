#include <cie/viewer_export/recorded_event_writer.hpp>

#include "json/json.hpp"
#include "tables/csv.hpp"
#include "words/text_layout.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

using analysis::FieldValue;
using Kind = FieldValue::Kind;

template <typename... Values>
void append_formatted(std::string& to, fmt::format_string<Values...> format, Values&&... values) {
  fmt::format_to(std::back_inserter(to), format, std::forward<Values>(values)...);
}

bool is_printable(std::string_view text) {
  return std::ranges::all_of(text,
                             [](char c) { return c >= ' ' && c <= '~' && c != '"' && c != '\\'; });
}

// In quotes, on one line, nothing that moves a cursor.
void append_quoted(std::string& to, std::string_view text) {
  to += '"';
  if (is_printable(text)) {
    to += text;
  } else {
    std::string escaped;
    for (const char c : text) {
      if (c == '"' || c == '\\') escaped += '\\';
      escaped += c;
    }
    to += printable(escaped);
  }
  to += '"';
}

void append_number(std::string& to, const FieldValue& value) {
  if (value.kind == Kind::natural) {
    append_formatted(to, "{}", static_cast<std::uint64_t>(value.number));
  } else {
    append_formatted(to, "{}", value.number);
  }
}

// One above int64 is a natural number that has a text.
void append_label(std::string& to, const FieldValue& value) {
  if (value.text.empty()) {
    append_number(to, value);
    return;
  }
  append_quoted(to, value.text);
  to += " (";
  append_number(to, value);
  to += ')';
}

double real_of(const FieldValue& value) { return std::bit_cast<double>(value.number); }

// Goes over values in their order. A format says how names, brackets and values look.
template <typename Format>
void append_values(std::string& to, std::span<const FieldValue> values, const Format& format) {
  std::vector<Kind> around{Kind::structure};
  bool is_first = true;
  format.open(to, Kind::structure);
  for (const auto& value : values) {
    if (value.kind == Kind::end) {
      format.close(to, around.back(), is_first);
      around.pop_back();
      is_first = false;
      continue;
    }
    if (!is_first) format.between(to);
    if (around.back() == Kind::structure) format.name(to, value.name);
    is_first = value.kind == Kind::structure || value.kind == Kind::list;
    if (is_first) {
      around.push_back(value.kind);
      format.open(to, value.kind);
    } else {
      format.value(to, value);
    }
  }
  format.close(to, Kind::structure, is_first);
}

struct TextFields {
  static void open(std::string& to, Kind kind) { to += kind == Kind::list ? "[" : "{ "; }
  static void close(std::string& to, Kind kind, bool is_empty) {
    to += kind == Kind::list ? "]" : is_empty ? "}" : " }";
  }
  static void between(std::string& to) { to += ", "; }
  static void name(std::string& to, std::string_view name) {
    to += is_printable(name) ? name : printable(name);
    to += " = ";
  }
  static void value(std::string& to, const FieldValue& value) {
    switch (value.kind) {
      case Kind::boolean:
        to += value.number != 0 ? "true" : "false";
        break;
      case Kind::label:
        append_label(to, value);
        break;
      case Kind::real:
        append_formatted(to, "{}", real_of(value));
        break;
      case Kind::text:
        append_quoted(to, value.text);
        break;
      case Kind::opaque:
        to += '?';
        break;
      default:
        if (!value.text.empty()) {
          append_label(to, value);
        } else if (value.is_hexadecimal) {
          append_formatted(to, "{:#x}", static_cast<std::uint64_t>(value.number));
        } else {
          append_number(to, value);
        }
    }
  }
};

struct JsonFields {
  static void open(std::string& to, Kind kind) { to += kind == Kind::list ? '[' : '{'; }
  static void close(std::string& to, Kind kind, bool /*is_empty*/) {
    to += kind == Kind::list ? ']' : '}';
  }
  static void between(std::string& to) { to += ','; }
  static void name(std::string& to, std::string_view name) {
    append_json_string(to, name);
    to += ':';
  }
  static void value(std::string& to, const FieldValue& value) {
    switch (value.kind) {
      case Kind::boolean:
        to += value.number != 0 ? "true" : "false";
        break;
      case Kind::label:
        // By its number where it has no name.
        if (!value.text.empty()) {
          append_json_string(to, value.text);
        } else {
          append_number(to, value);
        }
        break;
      case Kind::real:
        // JSON has neither infinities nor what is no number.
        if (std::isfinite(real_of(value))) {
          append_formatted(to, "{}", real_of(value));
        } else {
          append_formatted(to, "\"{}\"", real_of(value));
        }
        break;
      case Kind::text:
        append_json_string(to, value.text);
        break;
      case Kind::opaque:
        to += "null";
        break;
      default:
        if (!value.text.empty()) {
          append_json_string(to, value.text);
        } else {
          append_number(to, value);
        }
    }
  }
};

template <typename T>
std::string or_empty(const std::optional<T>& value, std::string_view otherwise = {}) {
  return value ? fmt::format("{}", *value) : std::string(otherwise);
}

std::string json_fields(std::span<const FieldValue> values) {
  std::string text;
  append_values(text, values, JsonFields{});
  return text;
}

}  // namespace

RecordedEventWriter::RecordedEventWriter(std::ostream& out, EventFormat format)
    : out_(out), format_(format) {
  if (format_ == EventFormat::csv) out_ << "time_ns,host,cpu,pid,tid,name,context,fields\n";
}

void RecordedEventWriter::add_text(const analysis::RecordedEvent& event) {
  append_formatted(line_, "{} ", event.time.ns);
  if (!event.host.empty()) line_ += printable(event.host) + ' ';
  line_ += is_printable(event.name) ? event.name : printable(event.name);
  line_ += ": ";
  if (event.cpu) append_formatted(line_, "{{ cpu_id = {} }}, ", *event.cpu);
  if (!event.context.empty()) {
    append_values(line_, event.context, TextFields{});
    line_ += ", ";
  }
  append_values(line_, event.fields, TextFields{});
}

void RecordedEventWriter::add_json(const analysis::RecordedEvent& event) {
  append_formatted(line_, R"({{"time_ns":{},"host":)", event.time.ns);
  append_json_string(line_, event.host);
  append_formatted(line_, R"(,"cpu":{},"pid":{},"tid":{},"name":)", or_empty(event.cpu, "null"),
                   or_empty(event.pid, "null"), or_empty(event.tid, "null"));
  append_json_string(line_, event.name);
  line_ += R"(,"context":)";
  append_values(line_, event.context, JsonFields{});
  line_ += R"(,"fields":)";
  append_values(line_, event.fields, JsonFields{});
  line_ += '}';
}

void RecordedEventWriter::add_csv(const analysis::RecordedEvent& event) {
  append_formatted(line_, "{},{},{},{},{},{},{},{}", event.time.ns, csv_field(event.host),
                   or_empty(event.cpu), or_empty(event.pid), or_empty(event.tid),
                   csv_field(event.name), csv_field(json_fields(event.context)),
                   csv_field(json_fields(event.fields)));
}

void RecordedEventWriter::write(const analysis::RecordedEvent& event) {
  line_.clear();
  switch (format_) {
    case EventFormat::text:
      add_text(event);
      break;
    case EventFormat::json:
      add_json(event);
      break;
    case EventFormat::csv:
      add_csv(event);
      break;
  }
  line_ += '\n';
  out_.write(line_.data(), static_cast<std::streamsize>(line_.size()));
}

void EventCounter::write(std::ostream& out, EventFormat format) const {
  std::vector<Count> counts;
  std::uint64_t total = 0;
  for (const auto& count : counts_) {
    if (count.events > 0) counts.push_back(count);
    total += count.events;
  }
  std::ranges::sort(counts, {}, [](const Count& count) {
    return std::tuple(~count.events, std::string_view(count.name));
  });
  const auto width = std::to_string(total).size();
  if (format == EventFormat::csv) out << "name,events\n";
  for (const auto& [name, events] : counts) {
    switch (format) {
      case EventFormat::text:
        out << fmt::format("{:>{}}  {}\n", events, width, printable(name));
        break;
      case EventFormat::json:
        out << fmt::format(R"({{"name":{},"events":{}}})", json_string(name), events) << '\n';
        break;
      case EventFormat::csv:
        out << fmt::format("{},{}\n", csv_field(name), events);
        break;
    }
  }
  if (format == EventFormat::text) out << fmt::format("{}  in all\n", total);
}

}  // namespace cie::viewer_export
