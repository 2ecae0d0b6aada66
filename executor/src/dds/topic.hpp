// A topic of DDS with the type of its messages.
#pragma once

#include "dds_entity.hpp"
#include "message_layout.hpp"
#include "names.hpp"

struct ddsi_sertype;

namespace cie::executor {

class ContextState;

// Owns the topic. Its messages go by pointer within the process if the Context and the type allow
// it, else Cyclone DDS serialises them.
class Topic {
 public:
  // Throws dds::Error.
  Topic(const ContextState& context, const TopicName& name, const dds_topic_descriptor& type);

  dds_entity_t entity() const noexcept { return topic_.get(); }
  const LayoutPtr& layout() const noexcept { return layout_; }
  // Of messages that go by pointer; else null. Lives as long as this.
  const ddsi_sertype* pointer_type() const noexcept { return pointer_type_; }

 private:
  LayoutPtr layout_;
  const ddsi_sertype* pointer_type_ = nullptr;
  dds::Entity topic_;
};

}  // namespace cie::executor
