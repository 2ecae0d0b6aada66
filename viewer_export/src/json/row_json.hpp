// Rows as JSON: a Writer and a Reader of their fields (cie/analysis/report_fields.hpp).
#pragma once

#include <cie/analysis/report_rows.hpp>
#include <cie/analysis/verdict_fields.hpp>
#include <cie/tracepoints/schema.hpp>

#include "json.hpp"

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace cie::viewer_export {

// What names the processes of rows. Borrowed; without rows nothing that is written has a process.
struct RowContext {
  const analysis::ReportRows* rows = nullptr;
  bool has_several_hosts = false;
};

class RowWriter {
 public:
  RowWriter(Json& json, const RowContext& context) : json_(json), context_(context) {}

  template <typename T>
  void operator()(const char* name, const T& value) {
    json_[name] = json_of(value);
  }
  template <typename T>
  void added(const char* name, const T& value) {
    (*this)(name, value);
  }
  template <typename T>
  void derived(const char* name, const T& value) {
    (*this)(name, value);
  }
  template <typename T>
  void present(const char* name, const std::optional<T>& value) {
    if (value) (*this)(name, *value);
  }
  template <typename Enum>
  void word(const char* name, std::optional<Enum> value) {
    json_[name] = value ? label(*value) : std::string_view();
  }
  // Null if empty.
  void text(const char* name, const std::string& value) {
    json_[name] = value.empty() ? Json(nullptr) : Json(value);
  }
  template <typename Index>
  void number(const char* name, const Index& index) {
    json_[name] = number_of(index);
  }
  template <typename T>
  void pair(const char* name, const T& first, const T& second) {
    json_[name] = Json::array({json_of(first), json_of(second)});
  }
  void pid(const char* name, std::optional<analysis::ProcessIndex> process) {
    json_[name] = process ? Json(context_.rows->process(*process).pid) : Json(nullptr);
  }
  // Pids of several hosts may be the same.
  void host(const char* name, analysis::ProcessIndex process) {
    if (context_.has_several_hosts) json_[name] = context_.rows->process(process).host;
  }

  template <typename T>
  Json json_of(const T& value) const {
    if constexpr (requires(RowWriter & visit) { fields(visit, value); }) {
      Json json;
      RowWriter inner(json, context_);
      fields(inner, value);
      return json;
    } else if constexpr (std::is_enum_v<T>) {
      return label(value);
    } else if constexpr (requires { value.ns; }) {
      return value.ns;  // a point in time, or a duration
    } else {
      return value;
    }
  }
  template <typename T>
  Json json_of(const std::optional<T>& value) const {
    return value ? json_of(*value) : Json(nullptr);
  }
  // Said so: braces around two texts would make an object of them.
  template <typename T>
  Json json_of(const std::vector<T>& values) const {
    Json array = Json::array();
    for (const auto& value : values)
      array.push_back(json_of(value));
    return array;
  }
  static Json json_of(const std::optional<RecordedExit>& exit) {
    if (!exit) return nullptr;
    return exit->code ? Json{{"status", *exit->code}} : Json{{"signal", exit->signal.value_or(0)}};
  }

 private:
  template <typename Index>
  static Json number_of(Index index) {
    return static_cast<std::uint32_t>(index);
  }
  template <typename Index>
  static Json number_of(const std::optional<Index>& index) {
    return index ? number_of(*index) : Json(nullptr);
  }
  template <typename Index>
  static Json number_of(const std::vector<Index>& indices) {
    Json array = Json::array();
    for (const auto index : indices)
      array.push_back(number_of(index));
    return array;
  }

  Json& json_;
  const RowContext& context_;
};

template <typename Row>
Json row_json(const Row& row, const RowContext& context) {
  Json json;
  return RowWriter(json, context).json_of(row);
}

// Reads rows of documents of any version: fields of later ones may be absent. Throws
// Json::exception for fields that are absent or of another type, std::runtime_error for labels that
// nothing has.
class RowReader {
 public:
  explicit RowReader(const Json& json) : json_(json) {}

  template <typename T>
  void operator()(const char* name, T& value) const {
    read(json_.at(name), value);
  }
  template <typename T>
  void added(const char* name, T& value) const {
    if (json_.contains(name)) (*this)(name, value);
  }
  template <typename T>
  void present(const char* name, T& value) const {
    added(name, value);
  }
  template <typename T>
  void derived(const char* /*name*/, const T& /*value*/) const {}
  template <typename Enum>
  void word(const char* name, std::optional<Enum>& value) const {
    value.reset();
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
      json.get_to(value.ns);
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
  static void read(const Json& json, std::vector<T>& values) {
    values.clear();
    for (const auto& element : json)
      read(element, values.emplace_back());
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
