// What a shared object offers so that `cie run` can load nodes from it.
//
//   class Talker {
//    public:
//     explicit Talker(const cie::ComponentOptions& options)
//         : node_(options) { … }
//     cie::Node& node() { return node_; }
//    …
//   };
//   constexpr cie::ComponentClass kClasses[] = {cie::component_class<Talker>("demo::Talker")};
//   constexpr cie::ComponentLibrary kLibrary{.count = std::size(kClasses), .classes = kClasses};
//   extern "C" const cie::ComponentLibrary* cie_component_library() { return &kLibrary; }
#pragma once

#include <cie/executor/context.hpp>
#include <cie/executor/node.hpp>
#include <cie/executor/parameters.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace cie {

// What a component is constructed with. Valid, and to be used by one thread, only during the
// constructor.
class ComponentOptions {
 public:
  using Parameters = ParameterOverrides;

  ComponentOptions(const Context& context, std::string name, std::string name_space,
                   Parameters parameters, Remaps remaps = {});

  const Context& context() const noexcept { return *context_; }
  const std::string& name() const noexcept { return name_; }
  const std::string& name_space() const noexcept { return name_space_; }
  const Remaps& remaps() const noexcept { return remaps_; }

  // Values for parameters, which the node takes over: see Node::declare_parameter.
  const Parameters& parameters() const noexcept { return parameters_; }

  // For what is needed before there is a node: the parameter's value, or `absent` if the file does
  // not give it. `cie run` declares it afterwards as a read-only parameter of the node, unless the
  // component did. Throws std::invalid_argument naming the parameter when its text is no T (bool:
  // true or false; numbers: decimal).
  template <ParameterType T>
  T parameter(std::string_view name, const std::type_identity_t<T>& absent) const {
    return std::get<T>(read(name, ParameterValue{absent}));
  }
  // What was read by parameter().
  const std::map<std::string, ParameterValue, std::less<>>& read_parameters() const noexcept {
    return read_;
  }

 private:
  ParameterValue read(std::string_view name, ParameterValue absent) const;

  const Context* context_;
  std::string name_;
  std::string name_space_;
  Parameters parameters_;
  Remaps remaps_;
  mutable std::map<std::string, ParameterValue, std::less<>> read_;
};

// Grows by one whenever a component built before cannot be used any more.
inline constexpr std::uint32_t kComponentAbi = 1;

struct ComponentClass {
  const char* name = nullptr;                          // as `class` in the application's file
  void* (*create)(const ComponentOptions&) = nullptr;  // may throw
  Node& (*node)(void* component) = nullptr;
  void (*destroy)(void* component) noexcept = nullptr;
};

// What `cie_component_library()` returns; static, and so valid while the shared object is loaded.
struct ComponentLibrary {
  std::uint32_t abi = kComponentAbi;  // stays first in every version
  std::size_t count = 0;
  const ComponentClass* classes = nullptr;
};

// A component makes its node from the options, under the name and namespace they give, and owns it.
// Its callbacks no longer run when it is destroyed.
template <typename T>
concept Component = std::constructible_from<T, const ComponentOptions&> && requires(T& component) {
  { component.node() } -> std::same_as<Node&>;
};

template <Component T>
constexpr ComponentClass component_class(const char* name) {
  return {.name = name,
          .create = [](const ComponentOptions& options) -> void* { return new T(options); },
          .node = [](void* component) -> Node& { return static_cast<T*>(component)->node(); },
          .destroy = [](void* component) noexcept { delete static_cast<T*>(component); }};
}

}  // namespace cie
