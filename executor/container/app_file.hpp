// The application file of `cie run`: which components run, under which executor and spec.
#pragma once

#include <cie/executor/component.hpp>
#include <cie/executor/executor.hpp>
#include <cie/tracepoints/schema.hpp>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::container {

struct ComponentEntry {
  int line = 0;         // 1-based, for messages
  std::string library;  // a path if it has a slash, else a name for the dynamic linker
  std::string class_name;
  std::string name;  // of the node
  std::string name_space = "/";
  ComponentOptions::Parameters parameters;
  std::map<std::string, std::string> overridden;  // parameters not of the file, by who gave them
  Remaps remaps;

  // "/ns/name", which names the component within its container.
  std::string qualified_name() const;
};

struct AppFile {
  std::string file;                   // its name, for messages
  std::string executor = "isolated";  // one of kExecutorNames
  OnError on_error = OnError::refuse;
  std::optional<std::filesystem::path> spec;
  std::chrono::nanoseconds audit_period = ExecutorOptions{}.audit_period;
  OnChange on_change = OnChange::report;
  LockMemory lock_memory = LockMemory::no;
  std::size_t prefault_stack = 0;
  // What the file says of the network; the rest comes from the environment.
  std::optional<std::uint32_t> domain;
  std::optional<bool> is_loopback;
  std::optional<std::string> discovery_tag;
  std::vector<ComponentEntry> components;

  // Throws SpecError naming file, line and entry: unknown keys, values that do not fit, two
  // components of one name. Paths are relative to the file's folder.
  static AppFile load(const std::filesystem::path& file);
  // The same over text; `folder` is what paths are relative to.
  static AppFile parse(std::string_view text, std::string_view name,
                       const std::filesystem::path& folder);
};

}  // namespace cie::container
