#include "writer.hpp"

#include "context_state.hpp"
#include "dds_qos.hpp"
#include "delivery.hpp"
#include "names.hpp"

#include <mutex>
#include <utility>

namespace cie::executor {
namespace {

struct FreeMessage {
  const dds_topic_descriptor* type;
  void operator()(void* message) const noexcept { free_message(message, *type); }
};

}  // namespace

Writer::Writer(std::shared_ptr<ContextState> context, std::optional<NodeId> node,
               const TopicName& topic, const QoS& qos, const dds_topic_descriptor& type,
               const std::string& user_data)
    : context_(std::move(context)), name_(topic.ros) {
  const auto dds_qos = dds::to_dds(qos, name_, user_data);
  const dds_entity_t participant = context_->participant();
  topic_ = dds::Entity{dds_create_topic(participant, &type, topic.dds.c_str(), nullptr, nullptr),
                       "creating the DDS topic", name_};
  writer_ = dds::Entity{dds_create_writer(participant, topic_.get(), dds_qos.get(), nullptr),
                        "creating the DDS writer", name_};
  dds_guid_t guid{};
  dds::check(dds_get_guid(writer_.get(), &guid), "asking for the GUID", name_);
  gid_ = writer_gid(guid.v);
  if (type.m_nkeys == 0) {
    // As long as nobody holds the one instance of a keyless topic, Cyclone makes and frees it with
    // every best-effort write, which wakes its collector thread: three system calls per message
    // (eclipse-cyclonedds/cyclonedds issue 2458). Registering it once holds it.
    const std::unique_ptr<void, FreeMessage> any{allocate_message(type), FreeMessage{&type}};
    dds_instance_handle_t instance = DDS_HANDLE_NIL;
    dds::check(dds_register_instance(writer_.get(), &instance, any.get()),
               "registering the instance", name_);
  }
  if (node) trace_.emplace(*node, name_, gid_);
}

void Writer::publish(const void* message) {
  const std::lock_guard lock{mutex_};
  const std::int64_t timestamp = trace_ ? trace_->publish() : dds_time();
  dds::check(dds_write_ts(writer_.get(), message, timestamp), "publishing a message", name_);
}

std::uint32_t Writer::matched() const {
  dds_publication_matched_status_t status{};
  dds::check(dds_get_publication_matched_status(writer_.get(), &status),
             "asking for the subscriptions", name_);
  return status.current_count;
}

void publish(Writer& writer, const void* message) { writer.publish(message); }
const std::string& topic_of(const Writer& writer) noexcept { return writer.topic(); }
std::uint64_t writer_gid_of(const Writer& writer) noexcept { return writer.gid(); }
std::uint32_t matched_readers(const Writer& writer) { return writer.matched(); }

}  // namespace cie::executor
