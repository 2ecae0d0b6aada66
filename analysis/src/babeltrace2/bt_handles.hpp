// Owned references of libbabeltrace2: one move-only type per kind of object.
#pragma once

#include <memory>

#include <babeltrace2/babeltrace.h>

namespace cie::analysis::bt {

template <typename T, void (*Put)(const T*)>
struct PutRef {
  void operator()(const T* object) const noexcept { Put(object); }
};

using Graph = std::unique_ptr<const bt_graph, PutRef<bt_graph, bt_graph_put_ref>>;
using Plugin = std::unique_ptr<const bt_plugin, PutRef<bt_plugin, bt_plugin_put_ref>>;
using Value = std::unique_ptr<const bt_value, PutRef<bt_value, bt_value_put_ref>>;
using TraceRef = std::unique_ptr<const bt_trace, PutRef<bt_trace, bt_trace_put_ref>>;
using Message = std::unique_ptr<const bt_message, PutRef<bt_message, bt_message_put_ref>>;
using QueryExecutor =
    std::unique_ptr<const bt_query_executor, PutRef<bt_query_executor, bt_query_executor_put_ref>>;
using MessageIterator = std::unique_ptr<const bt_message_iterator,
                                        PutRef<bt_message_iterator, bt_message_iterator_put_ref>>;

}  // namespace cie::analysis::bt
