// The names that callbacks keep over runs.
#pragma once

#include <cie/tracepoints/schema.hpp>

#include <string>
#include <string_view>

namespace cie {

// "/node@Timer(100000000)": the fully qualified node, the kind, and what tells callbacks of a kind
// apart, which is the period in nanoseconds, the topic, the service, or a name of its own.
std::string logical_id(std::string_view qualified_node, CallbackKind kind, std::string_view what);
// Where the kind alone says too little: "/node@LivelinessChanged(/topic)" of a waitable.
std::string logical_id(std::string_view qualified_node, std::string_view kind,
                       std::string_view what);

}  // namespace cie
