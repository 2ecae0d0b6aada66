// Rows as JSON: a Writer and a Reader of their fields (cie/analysis/report_fields.hpp), and
// of those of a snapshot (live/snapshot_fields.hpp).
#pragma once

#include <cie/analysis/rare.hpp>
#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/verdict_fields.hpp>
#include <cie/tracepoints/schema.hpp>
#include <cie/viewer_export/sentences.hpp>

#include "json.hpp"
#include "json_text.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace cie::viewer_export {

// What names the processes of rows. Borrowed; without rows nothing that is written has a process.
struct RowContext {
  const analysis::ReportRows* rows = nullptr;
  bool has_several_hosts = false;
  bool has_details = true;
};

class RowWriter {
 public:
  RowWriter(JsonText& json, const RowContext& context) : json_(json), context_(context) {}

  template <typename T>
  void operator()(const char* name, const T& value) {
    json_.key(name);
    write(value);
  }
  template <typename T>
  void added(const char* name, const T& value) {
    (*this)(name, value);
  }
  template <typename T>
  void first(const char* name, const std::vector<T>& rows, std::size_t most) {
    json_.key(name);
    write_array(std::span(rows).first(std::min(rows.size(), most)),
                [this](const T& row) { write(row); });
  }
  template <typename T>
  void derived(const char* name, const T& value) {
    (*this)(name, value);
  }
  template <typename Optional>
  void present(const char* name, const Optional& value) {
    if (value) (*this)(name, *value);
  }
  template <typename T>
  void detail(const char* name, const T& value) {
    if (context_.has_details) (*this)(name, value);
  }
  template <typename VisitIts>
  void object(const char* name, const VisitIts& visit_its) {
    json_.key(name);
    json_.object([&] { visit_its(*this); });
  }
  template <typename Enum>
  void word(const char* name, std::optional<Enum> value) {
    (*this)(name, value ? label(*value) : std::string_view());
  }
  // Null if empty.
  void text(const char* name, const std::string& value) {
    (*this)(name, value.empty() ? std::nullopt : std::optional<std::string_view>(value));
  }
  template <typename Index>
  void number(const char* name, const Index& index) {
    json_.key(name);
    write_number(index);
  }
  // The sentence, and what it was made of: a code and arguments by name, those of notes in it likewise.
  void sentence(const char* name, const analysis::Note& value) {
    (*this)(name, viewer_export::sentence(value));
    write_parts(value);
  }
  template <typename T>
  void pair(const char* name, const T& first, const T& second) {
    json_.key(name);
    write_array(std::initializer_list<std::reference_wrapper<const T>>{first, second},
                [this](const T& value) { write(value); });
  }
  void pid(const char* name, std::optional<analysis::ProcessIndex> process) {
    json_.key(name);
    process ? write(context_.rows->process(*process).pid) : json_.null();
  }
  // Pids of several hosts may be the same.
  void host(const char* name, analysis::ProcessIndex process) {
    if (context_.has_several_hosts) (*this)(name, context_.rows->process(process).host);
  }

 private:
  void write_parts(const analysis::Note& value) {
    (*this)("code", value.code);
    json_.key("arguments");
    json_.object([&] {
      for (const auto& argument : value.arguments) {
        json_.key(argument.name);
        std::visit([this](const auto& its) { write_argument(its); }, argument.value);
      }
    });
  }
  template <typename T>
  void write_argument(const T& value) {
    write(value);
  }
  void write_argument(const analysis::NamedCallback& callback) { write(callback.id); }
  void write_argument(const analysis::NamedFile& file) { write(file.path); }
  void write_argument(const analysis::Note& value) {
    if (value.empty()) {
      json_.null();
    } else {
      json_.object([&] { write_parts(value); });
    }
  }
  template <typename T>
  void write(const T& value) {
    if constexpr (requires(RowWriter & visit) { fields(visit, value); }) {
      json_.object([&] { fields(*this, value); });
    } else if constexpr (std::is_enum_v<T>) {
      json_.value(label(value));
    } else if constexpr (requires { value.ns; }) {
      json_.value(value.ns);  // a point in time, or a duration
    } else {
      json_.value(value);
    }
  }
  template <typename T>
  void write(const std::optional<T>& value) {
    value ? write(*value) : json_.null();
  }
  template <typename T>
  void write(const analysis::Rare<T>& value) {
    value ? write(*value) : json_.null();
  }
  template <typename T>
  void write(const std::vector<T>& values) {
    write_array(values, [this](const T& value) { write(value); });
  }
  template <typename T, std::size_t count>
  void write(const std::array<T, count>& values) {
    write_array(values, [this](const T& value) { write(value); });
  }
  void write(const RecordedExit& exit) {
    json_.object([&] {
      exit.code ? (*this)("status", *exit.code) : (*this)("signal", exit.signal.value_or(0));
    });
  }
  template <typename Index>
  void write_number(Index index) {
    json_.value(static_cast<std::uint32_t>(index));
  }
  template <typename Index>
  void write_number(const std::optional<Index>& index) {
    index ? write_number(*index) : json_.null();
  }
  template <typename Index>
  void write_number(const std::vector<Index>& indices) {
    write_array(indices, [this](Index index) { write_number(index); });
  }
  template <typename Values, typename Write>
  void write_array(const Values& values, const Write& write_one) {
    json_.array([&] {
      for (const auto& value : values) {
        json_.element();
        write_one(value);
      }
    });
  }

  JsonText& json_;
  const RowContext& context_;
};

// A number of a document that its field cannot hold.
class ImpossibleNumber : public std::runtime_error {
 public:
  // `place`: of its field, "trace.hosts[1]".
  ImpossibleNumber(const std::string& place, const std::string& what)
      : std::runtime_error(place + ' ' + what), place_(place), what_(what) {}
  // The same, of a row that is there.
  ImpossibleNumber within(const std::string& row) const {
    return {row + (place_.empty() || place_.front() == '[' ? "" : ".") + place_, what_};
  }

 private:
  std::string place_;
  std::string what_;
};

// What `read` throws has its place in the row.
template <typename Read>
void read_within(const std::string& row, const Read& read) {
  try {
    read();
  } catch (const ImpossibleNumber& number) {
    throw number.within(row);
  }
}

// Reads rows of documents of any version: fields of later ones may be absent. Throws
// Json::exception for fields that are absent or of another type, ImpossibleNumber, and
// std::runtime_error for labels that nothing has.
class RowReader {
 public:
  explicit RowReader(const Json& json) : json_(json) {}

  template <typename T>
  void operator()(const char* name, T& value) const {
    read_within(name, [&] { read(json_.at(name), value); });
  }
  template <typename T>
  void added(const char* name, T& value) const {
    if (json_.contains(name)) (*this)(name, value);
  }
  template <typename T>
  void first(const char* name, T& rows, std::size_t /*most*/) const {
    added(name, rows);
  }
  template <typename T>
  void present(const char* name, T& value) const {
    added(name, value);
  }
  template <typename T>
  void derived(const char* /*name*/, const T& /*value*/) const {}
  template <typename T>
  void detail(const char* name, T& value) const {
    added(name, value);
  }
  template <typename VisitIts>
  void object(const char* name, const VisitIts& visit_its) const {
    RowReader inner(json_.at(name));
    read_within(name, [&] { visit_its(inner); });
  }
  void sentence(const char* name, analysis::Note& value) const {
    std::string text;
    (*this)(name, text);
    value = text.empty() ? analysis::Note{} : analysis::free_text(std::move(text));
  }
  template <typename Enum>
  void word(const char* name, std::optional<Enum>& value) const {
    value.reset();
    // NOLINTNEXTLINE(readability-container-size-empty): empty() is of arrays and objects
    if (json_.at(name) != "") read(json_.at(name), value);
  }
  // Of the document's rows: later versions have them.
  template <typename Index>
  void number(const char* /*name*/, Index& /*index*/) const {}
  template <typename Process>
  void pid(const char* /*name*/, const Process& /*process*/) const {}
  template <typename Process>
  void host(const char* /*name*/, const Process& /*process*/) const {}

 private:
  template <typename T>
  static void read(const Json& json, T& value) {
    if constexpr (requires(RowReader & visit) { fields(visit, value); }) {
      RowReader inner(json);
      fields(inner, value);
    } else if constexpr (std::is_enum_v<T>) {
      value = labelled<T>(json.get<std::string>());
    } else if constexpr (requires { value.ns; }) {
      value.ns = integer<decltype(value.ns)>(json);
    } else if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
      value = integer<T>(json);
    } else {
      json.get_to(value);
    }
  }
  template <typename T>
  static void read(const Json& json, std::optional<T>& value) {
    value.reset();
    if (json.is_null()) return;
    T known{};
    read(json, known);
    value = std::move(known);
  }
  template <typename T>
  static void read(const Json& json, analysis::Rare<T>& value) {
    value.reset();
    if (!json.is_null()) read(json, value.emplace());
  }
  template <typename T>
  static void read(const Json& json, std::vector<T>& values) {
    values.clear();
    for (const auto& element : json) {
      const auto place = '[' + std::to_string(values.size()) + ']';
      read_within(place, [&] { read(element, values.emplace_back()); });
    }
  }
  // The library converts any number to any other one.
  template <typename T>
  static T integer(const Json& json) {
    if (!json.is_number()) return json.get<T>();  // throws
    constexpr auto kLeast = std::numeric_limits<T>::min();
    constexpr auto kMost = std::numeric_limits<T>::max();
    const bool is_it = json.is_number_unsigned()  ? std::in_range<T>(json.get<std::uint64_t>())
                       : json.is_number_integer() ? std::in_range<T>(json.get<std::int64_t>())
                                                  : false;
    if (is_it) return json.get<T>();
    throw ImpossibleNumber({}, "is " + json.dump() + " and not an integer from " +
                                   std::to_string(kLeast) + " to " + std::to_string(kMost));
  }
  // Enumerations count from 0 and have a label for each enumerator, and no other.
  template <typename Enum>
  static Enum labelled(const std::string& text) {
    for (std::uint8_t i = 0; i < 64 && !text.empty(); ++i) {
      if (const auto value = static_cast<Enum>(i); label(value) == text) return value;
    }
    throw std::runtime_error("what is \"" + text + "\"?");
  }

  const Json& json_;
};

}  // namespace cie::viewer_export
