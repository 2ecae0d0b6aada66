#include "component_loader.hpp"

#include "base/file.hpp"
#include "base/text.hpp"

#include <algorithm>
#include <exception>
#include <functional>
#include <span>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include <dlfcn.h>
#include <fmt/format.h>

namespace cie::container {
namespace {

constexpr const char* kEntryPoint = "cie_component_library";
constexpr std::size_t kMaxClasses = 10'000;

std::string linker_reason() {
  const char* const reason = dlerror();
  return reason == nullptr ? "the dynamic linker gives no reason" : reason;
}

// The text of the exception that ends `function`, or nothing.
std::string failure_of(const std::function<void()>& function) {
  try {
    function();
    return {};
  } catch (const std::exception& error) {
    const std::string_view text = error.what();
    return std::string{text.empty() ? "an exception without a text" : text};
  } catch (...) {
    return "an exception that is no std::exception";
  }
}

// So that all of a component's parameters can be asked for.
void declare_read_parameters(Node& node, const ComponentOptions& options) {
  for (const auto& [name, value] : options.read_parameters()) {
    if (node.has_parameter(name)) continue;
    node.declare_parameter(name, value,
                           {.description = "read when it was constructed", .is_read_only = true});
  }
}

// What only the component's own constructor can get wrong.
void check_use_of_options(Node& node, const ComponentOptions& options) {
  const auto unread = node.unused_parameter_overrides();
  if (!unread.empty()) {
    throw std::runtime_error{"it has no parameter " + joined(unread) +
                             "; correct the name or remove it"};
  }
  const std::string& name = node.fully_qualified_name();
  if (!name.ends_with("/" + options.name())) {
    throw std::runtime_error{"its node is called \"" + name + "\" instead of \"" + options.name() +
                             "\"; make the node from the options"};
  }
}

// The dynamic linker would wait for a FIFO's writer; what it says of a file that is not there is better.
void refuse_what_is_no_file(const std::string& name) {
  if (name.find('/') == std::string::npos) return;  // the linker looks for it
  try {
    open_to_read(name);
  } catch (const std::system_error& error) {
    if (error.code().category() != std::generic_category())
      throw std::runtime_error{name + ": " + error.what()};
  }
}

}  // namespace

Library::Library(const std::string& name) : name_(name) {
  refuse_what_is_no_file(name);
  handle_ = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle_ == nullptr) throw std::runtime_error{linker_reason()};
}

Library::~Library() { dlclose(handle_); }

const ComponentClass& Library::find_class(const std::string& class_name) const {
  void* const symbol = dlsym(handle_, kEntryPoint);
  if (symbol == nullptr) {
    throw std::runtime_error{"it is no component library: it has no function " +
                             std::string{kEntryPoint} + "()"};
  }
  const auto entry_point = reinterpret_cast<const ComponentLibrary* (*)()>(symbol);
  const ComponentLibrary* const library = entry_point();
  if (library == nullptr) {
    throw std::runtime_error{std::string{kEntryPoint} + "() returned null"};
  }
  if (library->abi != kComponentAbi) {
    throw std::runtime_error{
        fmt::format("it was built for version {} of the component interface, this program has "
                    "version {}: rebuild it",
                    library->abi, kComponentAbi)};
  }
  const std::span classes{library->classes,
                          library->classes == nullptr ? 0 : std::min(library->count, kMaxClasses)};
  std::vector<std::string> known;
  for (const ComponentClass& each : classes) {
    if (each.name == nullptr || each.create == nullptr || each.node == nullptr ||
        each.destroy == nullptr) {
      continue;
    }
    if (each.name == class_name) return each;
    known.emplace_back(each.name);
  }
  throw std::runtime_error{"it has no class \"" + class_name + "\"" +
                           (known.empty() ? "" : "; it has " + joined(known))};
}

LoadedComponent::LoadedComponent(const std::string& library, const std::string& class_name,
                                 const ComponentOptions& options)
    : class_name_(class_name) {
  const std::string failure = failure_of([&] {
    library_ = std::make_unique<Library>(library);
    class_ = &library_->find_class(class_name);
    component_ = {class_->create(options), class_->destroy};
    declare_read_parameters(node(), options);
    check_use_of_options(node(), options);
  });
  if (!failure.empty()) throw std::runtime_error{failure};
}

}  // namespace cie::container
