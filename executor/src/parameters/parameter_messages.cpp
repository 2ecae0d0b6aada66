#include "parameter_messages.hpp"

#include <cie/executor/message.hpp>

#include "parameter_kinds.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <set>
#include <tuple>
#include <type_traits>
#include <variant>

#include <rcl_interfaces.h>

namespace cie::executor {
namespace {

// --- sequences --------------------------------------------------------------------------------

// Of a zeroed message: `length` zeroed elements.
template <typename Sequence>
void fill_sequence(Sequence& sequence, std::size_t length) {
  using Element = std::remove_pointer_t<decltype(sequence._buffer)>;
  if (length == 0) return;
  sequence._buffer = static_cast<Element*>(allocate_contents(length * sizeof(Element)));
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(length);
  sequence._release = true;
}

template <typename Sequence>
auto elements(Sequence& sequence) {
  return std::span{sequence._buffer, sequence._length};
}

std::string text_of(const char* text) { return text == nullptr ? "" : text; }

template <typename Sequence>
std::vector<std::string> texts(const Sequence& sequence) {
  std::vector<std::string> texts;
  for (const char* const text : elements(sequence))
    texts.push_back(text_of(text));
  return texts;
}

template <typename Sequence>
void fill_texts(Sequence& sequence, const std::vector<std::string>& texts) {
  fill_sequence(sequence, texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i)
    set_text(sequence._buffer[i], texts[i]);
}

template <typename Sequence, typename T>
void fill_numbers(Sequence& sequence, const std::vector<T>& numbers) {
  fill_sequence(sequence, numbers.size());
  std::ranges::copy(numbers, sequence._buffer);
}

// --- values -----------------------------------------------------------------------------------

using ValueMessage = rcl_interfaces_msg_ParameterValue;

// The fields of the values, in the order of their kinds.
constexpr std::tuple kFields{nullptr,
                             &ValueMessage::bool_value,
                             &ValueMessage::integer_value,
                             &ValueMessage::double_value,
                             &ValueMessage::string_value,
                             &ValueMessage::byte_array_value,
                             &ValueMessage::bool_array_value,
                             &ValueMessage::integer_array_value,
                             &ValueMessage::double_array_value,
                             &ValueMessage::string_array_value};

template <typename Value>
constexpr auto kField = std::get<static_cast<std::size_t>(kKindOf<Value>)>(kFields);

void fill_value(ValueMessage& message, const ParameterValue& value) {
  message.type = static_cast<std::uint8_t>(kind_of(value));
  std::visit(
      [&message]<typename Value>(const Value& of_kind) {
        if constexpr (std::is_same_v<Value, std::monostate>) {
          return;
        } else if constexpr (std::is_same_v<Value, std::string>) {
          set_text(message.*kField<Value>, of_kind);
        } else if constexpr (std::is_same_v<Value, std::vector<std::string>>) {
          fill_texts(message.*kField<Value>, of_kind);
        } else if constexpr (kIsList<Value>) {
          fill_numbers(message.*kField<Value>, of_kind);
        } else {
          message.*kField<Value> = of_kind;
        }
      },
      value);
}

ParameterValue value_of(const ValueMessage& message) {
  return with_type_of(static_cast<ParameterKind>(message.type),
                      [&message]<typename Value>(Value) -> ParameterValue {
                        if constexpr (std::is_same_v<Value, std::monostate>) {
                          return {};
                        } else if constexpr (std::is_same_v<Value, std::string>) {
                          return text_of(message.*kField<Value>);
                        } else if constexpr (std::is_same_v<Value, std::vector<std::string>>) {
                          return texts(message.*kField<Value>);
                        } else if constexpr (kIsList<Value>) {
                          const auto values = elements(message.*kField<Value>);
                          return Value(values.begin(), values.end());
                        } else {
                          return Value{message.*kField<Value>};
                        }
                      });
}

template <typename Sequence>
std::vector<Parameter> parameters_of(const Sequence& sequence) {
  std::vector<Parameter> parameters;
  for (const auto& each : elements(sequence))
    parameters.push_back({text_of(each.name), value_of(each.value)});
  return parameters;
}

template <typename Sequence>
void fill_parameters(Sequence& sequence, const std::vector<Parameter>& parameters) {
  fill_sequence(sequence, parameters.size());
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    set_text(sequence._buffer[i].name, parameters[i].name);
    fill_value(sequence._buffer[i].value, parameters[i].value);
  }
}

// --- services ---------------------------------------------------------------------------------

// What `read` says of each name; as in rclcpp nothing at all if one of them is not declared.
template <typename Read>
auto of_all(const std::vector<std::string>& names, Read read) {
  std::vector<decltype(read(names.front()))> all;
  try {
    for (const std::string& name : names)
      all.push_back(read(name));
  } catch (const ParameterError&) {
    all.clear();
  }
  return all;
}

SetParametersResult set(ParameterStore& store, const std::vector<Parameter>& parameters) {
  try {
    return store.set(parameters);
  } catch (const std::exception& error) {  // a callback's
    return {.is_successful = false, .reason = error.what()};
  } catch (...) {
    return {.is_successful = false, .reason = "a callback threw what is no std::exception"};
  }
}

void fill_result(rcl_interfaces_msg_SetParametersResult& message,
                 const SetParametersResult& result) {
  message.successful = result.is_successful;
  set_text(message.reason, result.reason);
}

void get_parameters(ParameterStore& store, const void* request, void* response) {
  const auto found =
      of_all(texts(static_cast<const rcl_interfaces_srv_GetParameters_Request*>(request)->names),
             [&store](const std::string& name) { return store.get(name); });
  auto& values = static_cast<rcl_interfaces_srv_GetParameters_Response*>(response)->values;
  fill_sequence(values, found.size());
  for (std::size_t i = 0; i < found.size(); ++i)
    fill_value(values._buffer[i], found[i]);
}

void get_parameter_types(ParameterStore& store, const void* request, void* response) {
  const auto types = of_all(
      texts(static_cast<const rcl_interfaces_srv_GetParameterTypes_Request*>(request)->names),
      [&store](const std::string& name) {
        return static_cast<std::uint8_t>(kind_of(store.get(name)));
      });
  fill_numbers(static_cast<rcl_interfaces_srv_GetParameterTypes_Response*>(response)->types, types);
}

void set_parameters(ParameterStore& store, const void* request, void* response) {
  const auto parameters = parameters_of(
      static_cast<const rcl_interfaces_srv_SetParameters_Request*>(request)->parameters);
  auto& results = static_cast<rcl_interfaces_srv_SetParameters_Response*>(response)->results;
  fill_sequence(results, parameters.size());
  for (std::size_t i = 0; i < parameters.size(); ++i)
    fill_result(results._buffer[i], set(store, {parameters[i]}));
}

void set_parameters_atomically(ParameterStore& store, const void* request, void* response) {
  const auto parameters = parameters_of(
      static_cast<const rcl_interfaces_srv_SetParametersAtomically_Request*>(request)->parameters);
  fill_result(static_cast<rcl_interfaces_srv_SetParametersAtomically_Response*>(response)->result,
              set(store, parameters));
}

struct Described {
  std::string name;
  ParameterKind kind;
  ParameterDescriptor descriptor;
};

void fill_descriptor(rcl_interfaces_msg_ParameterDescriptor& message, const Described& parameter) {
  const ParameterDescriptor& descriptor = parameter.descriptor;
  set_text(message.name, parameter.name);
  message.type = static_cast<std::uint8_t>(parameter.kind);
  set_text(message.description, descriptor.description);
  set_text(message.additional_constraints, descriptor.additional_constraints);
  message.read_only = descriptor.is_read_only;
  message.dynamic_typing = descriptor.is_dynamically_typed;
  if (const auto& range = descriptor.integer_range) {
    fill_sequence(message.integer_range, 1);
    *message.integer_range._buffer = {
        .from_value = range->from, .to_value = range->to, .step = range->step};
  }
  if (const auto& range = descriptor.floating_point_range) {
    fill_sequence(message.floating_point_range, 1);
    *message.floating_point_range._buffer = {
        .from_value = range->from, .to_value = range->to, .step = range->step};
  }
}

void describe_parameters(ParameterStore& store, const void* request, void* response) {
  const auto described = of_all(
      texts(static_cast<const rcl_interfaces_srv_DescribeParameters_Request*>(request)->names),
      [&store](const std::string& name) {
        return Described{name, kind_of(store.get(name)), store.describe(name)};
      });
  auto& descriptors =
      static_cast<rcl_interfaces_srv_DescribeParameters_Response*>(response)->descriptors;
  fill_sequence(descriptors, described.size());
  for (std::size_t i = 0; i < described.size(); ++i)
    fill_descriptor(descriptors._buffer[i], described[i]);
}

void list_parameters(ParameterStore& store, const void* request, void* response) {
  const auto& asked = *static_cast<const rcl_interfaces_srv_ListParameters_Request*>(request);
  const auto names = store.list(texts(asked.prefixes), asked.depth);
  std::set<std::string> prefixes;  // of the names: what stands before their last dot
  for (const std::string& name : names) {
    if (const auto dot = name.rfind('.'); dot != std::string::npos) {
      prefixes.insert(name.substr(0, dot));
    }
  }
  auto& result = static_cast<rcl_interfaces_srv_ListParameters_Response*>(response)->result;
  fill_texts(result.names, names);
  fill_texts(result.prefixes, {prefixes.begin(), prefixes.end()});
}

// The types, under the names they have on the wire.
const dds_topic_descriptor_t kTypes[] = {
    with_wire_name(rcl_interfaces_srv_GetParameters_Request_desc,
                   "rcl_interfaces::srv::dds_::GetParameters_Request_"),
    with_wire_name(rcl_interfaces_srv_GetParameters_Response_desc,
                   "rcl_interfaces::srv::dds_::GetParameters_Response_"),
    with_wire_name(rcl_interfaces_srv_GetParameterTypes_Request_desc,
                   "rcl_interfaces::srv::dds_::GetParameterTypes_Request_"),
    with_wire_name(rcl_interfaces_srv_GetParameterTypes_Response_desc,
                   "rcl_interfaces::srv::dds_::GetParameterTypes_Response_"),
    with_wire_name(rcl_interfaces_srv_SetParameters_Request_desc,
                   "rcl_interfaces::srv::dds_::SetParameters_Request_"),
    with_wire_name(rcl_interfaces_srv_SetParameters_Response_desc,
                   "rcl_interfaces::srv::dds_::SetParameters_Response_"),
    with_wire_name(rcl_interfaces_srv_SetParametersAtomically_Request_desc,
                   "rcl_interfaces::srv::dds_::SetParametersAtomically_Request_"),
    with_wire_name(rcl_interfaces_srv_SetParametersAtomically_Response_desc,
                   "rcl_interfaces::srv::dds_::SetParametersAtomically_Response_"),
    with_wire_name(rcl_interfaces_srv_DescribeParameters_Request_desc,
                   "rcl_interfaces::srv::dds_::DescribeParameters_Request_"),
    with_wire_name(rcl_interfaces_srv_DescribeParameters_Response_desc,
                   "rcl_interfaces::srv::dds_::DescribeParameters_Response_"),
    with_wire_name(rcl_interfaces_srv_ListParameters_Request_desc,
                   "rcl_interfaces::srv::dds_::ListParameters_Request_"),
    with_wire_name(rcl_interfaces_srv_ListParameters_Response_desc,
                   "rcl_interfaces::srv::dds_::ListParameters_Response_"),
};
const dds_topic_descriptor_t kEventType = with_wire_name(
    rcl_interfaces_msg_ParameterEvent_desc, "rcl_interfaces::msg::dds_::ParameterEvent_");

const std::array<ParameterService, 6> kServices{{
    {"get_parameters", &kTypes[0], &kTypes[1], get_parameters},
    {"get_parameter_types", &kTypes[2], &kTypes[3], get_parameter_types},
    {"set_parameters", &kTypes[4], &kTypes[5], set_parameters},
    {"set_parameters_atomically", &kTypes[6], &kTypes[7], set_parameters_atomically},
    {"describe_parameters", &kTypes[8], &kTypes[9], describe_parameters},
    {"list_parameters", &kTypes[10], &kTypes[11], list_parameters},
}};

}  // namespace

std::span<const ParameterService> parameter_services() noexcept { return kServices; }

const dds_topic_descriptor_t& parameter_event_type() noexcept { return kEventType; }

void fill_parameter_event(void* message, std::string_view node, ParameterStore::Change change,
                          const std::vector<Parameter>& parameters) {
  auto& event = *static_cast<rcl_interfaces_msg_ParameterEvent*>(message);
  using std::chrono::nanoseconds;
  using std::chrono::seconds;
  const nanoseconds now = std::chrono::system_clock::now().time_since_epoch();
  const auto whole = std::chrono::duration_cast<seconds>(now);
  event.stamp.sec = static_cast<std::int32_t>(whole.count());
  event.stamp.nanosec = static_cast<std::uint32_t>((now - whole).count());
  set_text(event.node, node);
  switch (change) {
    case ParameterStore::Change::declared:
      return fill_parameters(event.new_parameters, parameters);
    case ParameterStore::Change::set:
      return fill_parameters(event.changed_parameters, parameters);
    case ParameterStore::Change::undeclared:
      return fill_parameters(event.deleted_parameters, parameters);
  }
}

}  // namespace cie::executor
