// The names that callbacks keep over runs.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace cie {

// "/node@Timer(100000000)": the fully qualified node, the kind, and what tells callbacks of a kind
// apart, which is the period in nanoseconds, the topic, the service, or a name of its own.
std::string logical_id(std::string_view qualified_node, CallbackKind kind, std::string_view what);
// Where the kind alone says too little: "/node@LivelinessChanged(/topic)" of a waitable.
std::string logical_id(std::string_view qualified_node, std::string_view kind,
                       std::string_view what);

// An id taken apart again. Views into the id.
struct LogicalId {
  std::string_view node;    // "/node"; "?" where a trace does not say which
  std::string_view kind;    // "Timer"
  std::string_view what;    // "100000000"
  std::string_view number;  // "2" of "/node@Timer(100000000)#2"; empty for the first of its name

  // Empty for what logical_id() does not make, with a number behind it or without.
  static std::optional<LogicalId> parse(std::string_view id) noexcept;

  // Of texts that need not be whole ids, too: those of a spec, of existing executors and of traces.
  // "/node" of "/node@Timer(10)#2"; without "@" all of it.
  static std::string_view node_of(std::string_view id) noexcept;
  // "Waitable" of "/node@Waitable(x)" and of "/node@Waitable"; without "@" as much of all of it.
  static std::string_view kind_of(std::string_view id) noexcept;
  // "/node@Timer(10)" of "/node@Timer(10)#2".
  static std::string_view without_number(std::string_view id) noexcept;
};

}  // namespace cie
