#include "reader.hpp"

#include "context_state.hpp"
#include "dds_qos.hpp"
#include "message_data.hpp"
#include "serdata_ptr.hpp"
#include "shared_memory.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

// features.h decides the layout of what follows.
// clang-format off
#include <dds/features.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_protocol.h>
// clang-format on

namespace cie::executor {
namespace {

// How many arrivals are remembered for a queue without bound.
constexpr std::uint32_t kUnboundedLogDepth = 4096;

// No deeper than shared memory can keep without loss: what it overwrites then is counted.
QoS kept(QoS qos, const ContextState& context) {
  if (context.options().shared_memory && qos.history() == History::keep_last) {
    qos.keep_last(std::min(qos.depth(), kDeepestQueueInSharedMemory));
  }
  return qos;
}

// In bytes of Cyclone's making.
bool has_cut_text(const MessageLayout& layout, const ddsi_serdata* sample) noexcept {
  if (in_shared_memory(sample) != nullptr) return false;
  ddsrt_iovec_t part{};
  ddsi_serdata* const held = ddsi_serdata_to_ser_ref(sample, 0, ddsi_serdata_size(sample), &part);
  const auto* const bytes = static_cast<const unsigned char*>(part.iov_base);
  std::uint16_t identifier = 0;
  std::memcpy(&identifier, bytes, sizeof identifier);
  const bool is_plain =
      identifier == ddsi_sertype_get_native_enc_identifier(CDR_ENC_VERSION_1, CDR_ENC_FORMAT_PLAIN);
  const bool is_cut =
      is_plain && layout.texts().have_inner_zero(bytes + sizeof identifier + sizeof(std::uint16_t));
  ddsi_serdata_to_ser_unref(held, &part);
  return is_cut;
}

void on_sample_lost(dds_entity_t, const dds_sample_lost_status_t status, void* delivery) noexcept {
  if (status.total_count_change > 0) {
    static_cast<Delivery*>(delivery)->lost(static_cast<std::uint32_t>(status.total_count_change));
  }
}

}  // namespace

Reader::Reader(std::shared_ptr<ContextState> context, const TopicName& topic, const QoS& asked,
               const dds_topic_descriptor& type, const std::string& user_data,
               std::optional<Reply> reply, std::shared_ptr<const EndpointEvents> events)
    : context_(std::move(context)),
      events_(events != nullptr ? std::move(events) : std::make_shared<const EndpointEvents>()),
      topic_(*context_, topic, type),
      is_searched_(topic_.pointer_type() == nullptr && layout()->is_plain() &&
                   layout()->texts().are_possible()) {
  const QoS qos = kept(asked, *context_);
  const bool keeps_all = qos.history() == History::keep_all;
  const bool is_keyed = type.m_nkeys != 0;  // then the depth holds for each key's value
  delivery_ = std::make_shared<Delivery>(keeps_all ? kUnboundedLogDepth : qos.depth(),
                                         keeps_all || is_keyed ? 0 : qos.depth());
  if (reply) delivery_->accept_only(reply->recipient);
  delivery_->on_lost(events_->message_lost);
  delivery_->on_unreadable([warnings = context_->warnings(), name = topic.ros] {
    warnings->tell("a message on \"" + name +
                   "\" has a text with a zero inside, where texts of ours end: it is lost, and so "
                   "are others like it");
  });
  const auto dds_qos = dds::to_dds(qos, topic.ros, user_data);
  const dds_entity_t participant = context_->participant();
  const ListenerPtr listener = reader_listener(*events_);
  dds_lset_sample_lost_arg(listener.get(), on_sample_lost, delivery_.get(), true);
  // The cache belongs to the reader from here on; if there is no reader, it leaks nothing but
  // itself, because Cyclone does not say whether it took it.
  reader_ = dds::Entity{dds_create_reader_rhc(participant, topic_.entity(), dds_qos.get(),
                                              listener.get(), make_recording_cache(delivery_)),
                        "creating the DDS reader", topic.ros};
}

void Reader::announce(const Graph::Member& node) {
  graph_member_ = context_->graph().add_endpoint(node, Graph::Direction::reader, reader_.get());
}

bool Reader::take(MessagePool::Loan& message, MessageInfo& info) {
  for (;;) {
    ddsi_serdata* taken = nullptr;
    dds_sample_info_t sample{};
    QueueCount& count = delivery_->count();
    const std::uint64_t stored = count.begin_take();
    const bool is_empty = dds_takecdr(reader_.get(), &taken, 1, &sample, DDS_ANY_STATE) <= 0;
    const auto outcome = is_empty            ? TakeOutcome::empty
                         : sample.valid_data ? TakeOutcome::sample
                                             : TakeOutcome::other;
    count.end_take(outcome, stored);
    if (is_empty) return false;
    const SerdataPtr data{taken};
    if (outcome == TakeOutcome::other) continue;
    if (auto passed = message_of(*data)) {
      message.refer_to(std::move(passed));
    } else if (is_unreadable(*data) || (is_searched_ && has_cut_text(*layout(), data.get()))) {
      delivery_->unreadable();
      continue;
    } else if (!ddsi_serdata_to_sample(data.get(), message.memory(), nullptr, nullptr)) {
      continue;
    }
    info.source_timestamp_realtime_ns = sample.source_timestamp;
    if (const auto arrival = delivery_->arrivals().find(data.get())) {
      info.arrival_ns = arrival->time_ns;
      info.writer_gid = arrival->writer_gid;
    } else {
      info.arrival_ns = -1;
      info.writer_gid = 0;
    }
    return true;
  }
}

std::uint64_t Reader::close() {
  delivery_->close();
  QueueCount& count = delivery_->count();
  for (;;) {
    ddsi_serdata* taken = nullptr;
    dds_sample_info_t sample{};
    const std::uint64_t stored = count.begin_take();
    const bool is_empty = dds_takecdr(reader_.get(), &taken, 1, &sample, DDS_ANY_STATE) <= 0;
    const SerdataPtr data{taken};
    count.end_take(is_empty            ? TakeOutcome::empty
                   : sample.valid_data ? TakeOutcome::sample
                                       : TakeOutcome::other,
                   stored);
    if (is_empty) return count.overwritten();
  }
}

dds::Entity Reader::new_read_condition() const {
  return {dds_create_readcondition(reader_.get(), DDS_ANY_STATE), "creating the read condition",
          "a reader"};
}

std::uint32_t Reader::matched() const {
  dds_subscription_matched_status_t status{};
  dds::check(dds_get_subscription_matched_status(reader_.get(), &status),
             "asking for the publishers", "a reader");
  return status.current_count;
}

}  // namespace cie::executor
