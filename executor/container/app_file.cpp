#include "app_file.hpp"

#include <cie/executor/context.hpp>

#include "base/yaml_fields.hpp"
#include "yaml_parameters.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace cie::container {
namespace {

using yaml::Fields;
using yaml::Value;

constexpr std::size_t kMaxComponents = 1'000;

constexpr std::array<std::string_view, 11> kKeys{
    "components",    "executor",     "spec",      "on_error",    "domain",        "loopback",
    "discovery_tag", "audit_period", "on_change", "lock_memory", "prefault_stack"};
constexpr std::int64_t kMostPrefault = std::int64_t{1} << 30U;
constexpr std::int64_t kLeastAuditPeriod = 10'000'000;  // ns: more often it would be felt
constexpr std::array<std::string_view, 6> kComponentKeys{"library",   "class",      "name",
                                                         "namespace", "parameters", "remaps"};

std::string needed_text(const Fields& fields, std::string_view key, std::string_view remedy) {
  const Value* const value = fields.find(key);
  if (value == nullptr) {
    fields.map().fail("a component needs \"" + std::string{key} + "\"; " + std::string{remedy});
  }
  const std::string& text = value->text(key);
  if (text.empty()) value->fail("\"" + std::string{key} + "\" is empty; " + std::string{remedy});
  return text;
}

bool read_bool(const Value& value, std::string_view key) {
  const std::string& text = value.text(key);
  if (text != "true" && text != "false") {
    value.fail("\"" + std::string{key} + "\" is \"" + text + "\"; write true or false");
  }
  return text == "true";
}

// A library beside the application's file is meant before one that the dynamic linker would find.
std::string resolve_library(const std::string& library, const std::filesystem::path& folder) {
  const auto beside = folder / library;
  std::error_code error;
  const bool is_path = library.find('/') != std::string::npos;
  return is_path || std::filesystem::exists(beside, error)
             ? std::filesystem::absolute(beside).lexically_normal().string()
             : library;
}

ComponentEntry read_component(const Value& item, const std::filesystem::path& folder) {
  Fields fields{item, "components", kComponentKeys};
  ComponentEntry entry;
  entry.line = item.line();
  entry.name = needed_text(fields, "name", "it becomes the node's");
  fields.set_entry(entry.name);
  entry.library =
      resolve_library(needed_text(fields, "library", "write the shared object it is in"), folder);
  entry.class_name = needed_text(fields, "class", "write the name the library gives it");
  if (const Value* const value = fields.find("namespace")) {
    entry.name_space = value->text("namespace");
  }
  if (const Value* const value = fields.find("parameters")) {
    entry.parameters = read_parameters(*value);
  }
  if (const Value* const value = fields.find("remaps")) {
    for (const auto& [from, to] : value->fields("remaps"))
      entry.remaps.emplace(from, to.text(from));
  }
  return entry;
}

std::vector<ComponentEntry> read_components(const Value& section,
                                            const std::filesystem::path& folder) {
  std::vector<ComponentEntry> components;
  std::map<std::string, int> lines;
  const auto items = section.items("components");
  if (items.empty()) section.fail("\"components\" is empty; list at least one");
  if (items.size() > kMaxComponents) section.fail("more than 1000 components; split the file");
  for (const Value& item : items) {
    components.push_back(read_component(item, folder));
    const auto [first, is_new] =
        lines.emplace(components.back().qualified_name(), components.back().line);
    if (!is_new) {
      item.of_entry(components.back().name)
          .fail(fmt::format("a component \"{}\" stands already at line {}; rename one",
                            first->first, first->second));
    }
  }
  return components;
}

void read_network(const Fields& fields, AppFile& app) {
  if (const auto domain = fields.integer("domain", 0, Context::kMostDomain)) {
    app.domain = static_cast<std::uint32_t>(*domain);
  }
  if (const Value* const value = fields.find("loopback")) {
    app.is_loopback = read_bool(*value, "loopback");
  }
  if (const Value* const value = fields.find("discovery_tag")) {
    app.discovery_tag = value->text("discovery_tag");
  }
}

// How threads are prepared and watched.
void read_care(const Fields& fields, AppFile& app) {
  if (const auto period = fields.integer("audit_period", 0)) {
    if (*period != 0 && *period < kLeastAuditPeriod) {
      fields.find("audit_period")
          ->fail("\"audit_period\" is below 10 ms; write 0 for none, or 10000000 ns and more");
    }
    app.audit_period = std::chrono::nanoseconds{*period};
  }
  if (const Value* const value = fields.find("lock_memory")) {
    const std::string& name = value->text("lock_memory");
    if (name != "no" && name != "on_fault" && name != "all") {
      value->fail("\"lock_memory\" is \"" + name + "\"; write no, on_fault or all");
    }
    if (name == "on_fault") app.lock_memory = LockMemory::on_fault;
    if (name == "all") app.lock_memory = LockMemory::all;
  }
  if (const auto bytes = fields.integer("prefault_stack", 0, kMostPrefault)) {
    app.prefault_stack = static_cast<std::size_t>(*bytes);
  }
  if (const Value* const value = fields.find("on_change")) {
    const std::string& name = value->text("on_change");
    if (name != "report" && name != "apply_again") {
      value->fail("\"on_change\" is \"" + name + "\"; write report or apply_again");
    }
    app.on_change = name == "report" ? OnChange::report : OnChange::apply_again;
  }
}

void read_execution(const Fields& fields, AppFile& app, const std::filesystem::path& folder) {
  if (const Value* const value = fields.find("executor")) {
    const std::string& name = value->text("executor");
    if (std::ranges::find(kExecutorNames, name) == kExecutorNames.end()) {
      value->fail("unknown executor \"" + name +
                  "\"; write isolated, single, multi or events, or one of the first three with "
                  "-waitset");
    }
    app.executor = name;
  }
  if (const Value* const value = fields.find("spec")) app.spec = folder / value->text("spec");
  if (const Value* const value = fields.find("on_error")) {
    const std::string& name = value->text("on_error");
    if (name != "refuse" && name != "warn") {
      value->fail("\"on_error\" is \"" + name + "\"; write refuse or warn");
    }
    app.on_error = name == "warn" ? OnError::warn : OnError::refuse;
  }
}

}  // namespace

std::string ComponentEntry::qualified_name() const {
  std::string full = name_space.starts_with('/') ? name_space : "/" + name_space;
  if (!full.ends_with('/')) full += '/';
  return full + name;
}

AppFile AppFile::parse(std::string_view text, std::string_view name,
                       const std::filesystem::path& folder) {
  const auto document = yaml::parse(text, name, "components: [{library: app, plugin: App}]");
  const Fields fields{Value{*document, name}, "the file", kKeys};
  AppFile app;
  app.file = name;
  read_execution(fields, app, folder);
  read_care(fields, app);
  read_network(fields, app);
  const Value* const components = fields.find("components");
  if (components == nullptr) {
    fields.map().fail("no \"components\"; list what is to run");
  }
  app.components = read_components(*components, folder);
  return app;
}

AppFile AppFile::load(const std::filesystem::path& file) {
  return parse(yaml::read_file(file), file.string(), file.parent_path());
}

}  // namespace cie::container
