#include <cie/executor/component.hpp>

#include <charconv>
#include <stdexcept>
#include <utility>

namespace cie {
namespace {

[[noreturn]] void fail(std::string_view name, const std::string& text, std::string_view wanted) {
  throw std::invalid_argument{"parameter \"" + std::string{name} + "\" is \"" + text +
                              "\"; write " + std::string{wanted}};
}

template <typename Number>
bool parse(const std::string& text, Number& number) {
  const char* const end = text.data() + text.size();
  const auto [parsed, error] = std::from_chars(text.data(), end, number);
  return error == std::errc{} && parsed == end;
}

void convert(std::string_view, const std::string& text, std::string& value) { value = text; }

void convert(std::string_view name, const std::string& text, bool& value) {
  if (text != "true" && text != "false") fail(name, text, "true or false");
  value = text == "true";
}

void convert(std::string_view name, const std::string& text, std::int64_t& value) {
  if (!parse(text, value)) fail(name, text, "a whole number of 64 bits");
}

void convert(std::string_view name, const std::string& text, double& value) {
  if (!parse(text, value)) fail(name, text, "a number");
}

template <typename T>
void convert(std::string_view name, const ParameterText& parameter, T& value) {
  if (parameter.is_list) fail(name, "a list", "a single value");
  convert(name, parameter.texts.front(), value);
}

template <typename T>
void convert(std::string_view name, const ParameterText& parameter, std::vector<T>& values) {
  if (!parameter.is_list) fail(name, parameter.texts.front(), "a list");
  for (const std::string& text : parameter.texts)
    convert(name, text, values.emplace_back());
}

}  // namespace

ComponentOptions::ComponentOptions(const Context& context, std::string name, std::string name_space,
                                   Parameters parameters, Remaps remaps)
    : context_(&context),
      name_(std::move(name)),
      name_space_(std::move(name_space)),
      parameters_(std::move(parameters)),
      remaps_(std::move(remaps)) {}

Node::Node(const ComponentOptions& options)
    : Node(options.context(), options.name(), options.name_space(), options.remaps()) {}

const ParameterText* ComponentOptions::find(std::string_view name) const {
  read_.emplace(name);
  const auto parameter = parameters_.find(name);
  return parameter == parameters_.end() ? nullptr : &parameter->second;
}

template <ParameterType T>
T ComponentOptions::parameter(std::string_view name, const std::type_identity_t<T>& absent) const {
  const ParameterText* const parameter = find(name);
  if (parameter == nullptr) return absent;
  T value{};
  convert(name, *parameter, value);
  return value;
}

template bool ComponentOptions::parameter<bool>(std::string_view, const bool&) const;
template std::int64_t ComponentOptions::parameter<std::int64_t>(std::string_view,
                                                                const std::int64_t&) const;
template double ComponentOptions::parameter<double>(std::string_view, const double&) const;
template std::string ComponentOptions::parameter<std::string>(std::string_view,
                                                              const std::string&) const;
template std::vector<std::int64_t> ComponentOptions::parameter<std::vector<std::int64_t>>(
    std::string_view, const std::vector<std::int64_t>&) const;
template std::vector<double> ComponentOptions::parameter<std::vector<double>>(
    std::string_view, const std::vector<double>&) const;
template std::vector<std::string> ComponentOptions::parameter<std::vector<std::string>>(
    std::string_view, const std::vector<std::string>&) const;

std::vector<std::string> ComponentOptions::unread_parameters() const {
  std::vector<std::string> unread;
  for (const auto& [name, value] : parameters_) {
    if (!read_.contains(name)) unread.push_back(name);
  }
  return unread;
}

}  // namespace cie
