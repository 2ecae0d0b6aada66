// Names of nodes, topics and types.
#pragma once

#include <string>
#include <string_view>
#include <typeinfo>

namespace cie::executor {

// "/ns/name". Throws std::invalid_argument for a name that is not one of ROS 2.
std::string qualified_node_name(std::string_view name, std::string_view name_space);

// The absolute name of a topic or service as a node of this name means it: "scan", "/scan" or
// "~/scan". Throws std::invalid_argument.
std::string qualified_topic(std::string_view topic, std::string_view qualified_node);

// A topic as traces and messages to users name it, and as it is called in DDS.
struct TopicName {
  std::string ros;
  std::string dds;
};
// Of an absolute topic: "rt" before it.
TopicName message_topic(std::string_view qualified_topic);
// Of an absolute service: "rq<service>Request" and "rr<service>Reply", as in ROS 2.
TopicName request_topic(std::string_view qualified_service);
TopicName reply_topic(std::string_view qualified_service);

// A type's name as it is written in C++.
std::string demangled(const std::type_info& type);

}  // namespace cie::executor
