#include "topic.hpp"

// clang-format off
#include <dds/features.h>
#include <dds/dds.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_protocol.h>
// clang-format on

#include "context_state.hpp"
#include "dds_qos.hpp"
#include "message_data.hpp"

namespace cie::executor {
namespace {

constexpr const char* kCreating = "creating the DDS topic";

// The encoding that ROS 2 knows; Cyclone would offer its successor, too.
void speak_plain_cdr(dds_qos_t* qos) {
  constexpr dds_data_representation_id_t kPlain = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(qos, 1, &kPlain);
}

}  // namespace

Topic::Topic(const ContextState& context, const TopicName& name, const dds_topic_descriptor& type)
    : layout_(std::make_shared<const MessageLayout>(type)) {
  const Context::Options& options = context.options();
  // Cyclone puts only its own samples into shared memory.
  ddsi_sertype* made =
      options.pass_pointers && !options.shared_memory ? make_pointer_type(layout_) : nullptr;
  if (made == nullptr) {
    const dds::QosPtr qos{dds_create_qos()};
    if (dds_stream_minimum_xcdr_version(type.m_ops) == CDR_ENC_VERSION_1)
      speak_plain_cdr(qos.get());
    topic_ = dds::Entity{
        dds_create_topic(context.participant(), &type, name.dds.c_str(), qos.get(), nullptr),
        kCreating, name.ros};
    return;
  }
  // Takes the reference if it succeeds, and puts the type in its place that the topic has: an equal
  // one, if another topic has it already.
  const dds_entity_t topic = dds_create_topic_sertype(context.participant(), name.dds.c_str(),
                                                      &made, nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(made);
  topic_ = dds::Entity{topic, kCreating, name.ros};
  pointer_type_ = made;
}

}  // namespace cie::executor
