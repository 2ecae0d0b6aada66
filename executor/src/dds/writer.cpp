#include "writer.hpp"

#include "context_state.hpp"
#include "dds_qos.hpp"
#include "delivery.hpp"
#include "message_data.hpp"
#include "serdata_ptr.hpp"

#include <mutex>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>

namespace cie::executor {
namespace {

constexpr const char* kPublishing = "publishing a message";

void check_present(const void* message, const Writer& writer) {
  if (message != nullptr) return;
  throw std::invalid_argument{"there is no message to publish on \"" + writer.topic() +
                              "\": the pointer is null"};
}

}  // namespace

Writer::Writer(std::shared_ptr<ContextState> context, std::optional<NodeId> node,
               const TopicName& topic, const QoS& qos, const dds_topic_descriptor& type,
               const std::string& user_data, std::shared_ptr<const EndpointEvents> events)
    : context_(std::move(context)),
      events_(events != nullptr ? std::move(events) : std::make_shared<const EndpointEvents>()),
      name_(topic.ros),
      topic_(*context_, topic, type) {
  const auto dds_qos = dds::to_dds(qos, name_, user_data);
  const dds_entity_t participant = context_->participant();
  const ListenerPtr listener = writer_listener(*events_);
  writer_ =
      dds::Entity{dds_create_writer(participant, topic_.entity(), dds_qos.get(), listener.get()),
                  "creating the DDS writer", name_};
  dds_guid_t guid{};
  dds::check(dds_get_guid(writer_.get(), &guid), "asking for the GUID", name_);
  gid_ = writer_gid(guid.v);
  if (type.m_nkeys == 0) {
    // As long as nobody holds the one instance of a keyless topic, Cyclone makes and frees it with
    // every best-effort write, which wakes its collector thread: three system calls per message
    // (eclipse-cyclonedds/cyclonedds issue 2458). Registering it once holds it.
    const auto any = own_message(layout()->allocate(), layout());
    dds_instance_handle_t instance = DDS_HANDLE_NIL;
    dds::check(dds_register_instance(writer_.get(), &instance, any.get()),
               "registering the instance", name_);
  }
  if (node) trace_.emplace(*node, name_, gid_, qos.depth());
}

void Writer::announce(const Graph::Member& node) {
  graph_member_ = context_->graph().add_endpoint(node, Graph::Direction::writer, writer_.get());
}

bool Writer::is_sent(dds_return_t code, std::int64_t timestamp) {
  if (code == DDS_RETCODE_TIMEOUT) {
    const std::uint64_t total = ++unsent_;
    if (trace_) trace_->failed(timestamp, total);
    return false;
  }
  dds::check(code, kPublishing, name_);
  return true;
}

bool Writer::publish(const void* message) {
  const std::lock_guard lock{mutex_};
  const std::int64_t timestamp = next_timestamp();
  return is_sent(dds_write_ts(writer_.get(), message, timestamp), timestamp);
}

bool Writer::publish(std::shared_ptr<const void> message) {
  const ddsi_sertype* const type = topic_.pointer_type();
  if (type == nullptr) return publish(message.get());
  const SerdataPtr data{make_message_data(*type, std::move(message))};
  if (data == nullptr) throw std::bad_alloc{};
  const std::lock_guard lock{mutex_};
  const std::int64_t timestamp = next_timestamp();
  data->timestamp.v = timestamp;
  // A reference of its own goes along, whether it succeeds or not.
  if (!is_sent(dds_forwardcdr(writer_.get(), ddsi_serdata_ref(data.get())), timestamp))
    return false;
  // Who has no connection outside the process never needs the bytes, and takes any value.
  if (is_refused(*data)) throw dds::Error{kPublishing, name_, DDS_RETCODE_BAD_PARAMETER};
  return true;
}

std::uint32_t Writer::matched() const {
  dds_publication_matched_status_t status{};
  dds::check(dds_get_publication_matched_status(writer_.get(), &status),
             "asking for the subscriptions", name_);
  return status.current_count;
}

void Writer::assert_liveliness() const {
  dds::check(dds_assert_liveliness(writer_.get()), "asserting the liveliness of the publisher",
             name_);
}

std::shared_ptr<const void> Writer::with_library(std::shared_ptr<const void> message) const {
  if (library_ == nullptr) return message;
  const void* const address = message.get();
  // The library's code frees the message, and so goes after it.
  return {address, [message = std::move(message), library = library_](const void*) mutable {
            message.reset();
            library.reset();
          }};
}

bool publish(Writer& writer, const void* message) { return writer.publish(message); }
bool publish_owned(Writer& writer, void* message) {
  check_present(message, writer);
  return writer.publish(own_message(message, writer.layout()));
}
bool publish_shared(Writer& writer, std::shared_ptr<const void> message) {
  check_present(message.get(), writer);
  return writer.publish(writer.with_library(std::move(message)));
}
const std::string& topic_of(const Writer& writer) noexcept { return writer.topic(); }
std::uint64_t writer_gid_of(const Writer& writer) noexcept { return writer.gid(); }
std::uint32_t matched_readers(const Writer& writer) { return writer.matched(); }
std::uint64_t unsent_messages(const Writer& writer) noexcept { return writer.unsent(); }
void assert_liveliness(const Writer& writer) { writer.assert_liveliness(); }

}  // namespace cie::executor
