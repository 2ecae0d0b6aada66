#include "provider_events.hpp"
#include "vocabulary.hpp"

namespace cie::analysis {
namespace {

void run_begin(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kRunBegin;
  body.emplace<RunBegin>() = {
      .contract_version = p.number<std::uint32_t>(kEvent["contract_version"]),
      .tool_version = p.text(kEvent["tool_version"]),
      .executor = p.text(kEvent["executor"]),
      .boot_id = p.text(kEvent["boot_id"]),
      .host = p.text(kEvent["host"]),
      .pid = p.number<std::uint32_t>(kEvent["pid"]),
      .pid_ns = p.number<std::uint64_t>(kEvent["pid_ns"]),
      .process_start_ns = p.number<std::int64_t>(kEvent["process_start_ns"]),
      .monotonic_ns = p.number<std::int64_t>(kEvent["monotonic_ns"]),
      .realtime_ns = p.number<std::int64_t>(kEvent["realtime_ns"]),
      .online_cpus = p.number<std::uint32_t>(kEvent["online_cpus"]),
      .spec_sha256 = p.text(kEvent["spec_sha256"]),
      .moment = p.label<RunMoment>(kEvent["moment"]),
      .monotonic_offset_ns = p.number<std::int64_t>(kEvent["monotonic_offset_ns"])};
}

void run_end(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kRunEnd;
  body.emplace<RunEnd>() = {.callbacks = p.number<std::uint32_t>(kEvent["callbacks"]),
                            .threads = p.number<std::uint32_t>(kEvent["threads"]),
                            .groups = p.number<std::uint32_t>(kEvent["groups"]),
                            .publishers = p.number<std::uint32_t>(kEvent["publishers"]),
                            .status = p.number<std::int32_t>(kEvent["status"])};
}

void node_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kNodeInit;
  body.emplace<NodeInit>() = {.node = p.id<NodeId>(kEvent["node_id"]),
                              .name = p.text(kEvent["name"])};
}

void group_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kGroupInit;
  body.emplace<GroupInit>() = {.group = p.id<GroupId>(kEvent["group_id"]),
                               .node = p.id<NodeId>(kEvent["node_id"]),
                               .type = p.label<GroupType>(kEvent["type"])};
}

void callback_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kCallbackInit;
  auto& event = body.emplace<CallbackInit>();
  event = {.callback = p.id<CallbackId>(kEvent["callback_id"]),
           .group = p.id<GroupId>(kEvent["group_id"]),
           .node = p.id<NodeId>(kEvent["node_id"]),
           .kind = p.label<CallbackKind>(kEvent["kind"]),
           .logical_id = p.text(kEvent["logical_id"]),
           .source = p.text(kEvent["source"]),
           .symbol = p.text(kEvent["symbol"]),
           .period_ns = p.number<std::uint64_t>(kEvent["period_ns"]),
           .queue_depth = p.number<std::uint32_t>(kEvent["queue_depth"]),
           .deadline_ns = p.number<std::uint64_t>(kEvent["deadline_ns"]),
           .next_seq = p.number<std::uint64_t>(kEvent["next_seq"])};
  // A timer has none. In copies that babeltrace2 2.0 made it is what an event before had.
  if (event.kind == CallbackKind::timer) event.source = {};
}

void callback_fini(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kCallbackFini;
  body.emplace<CallbackFini>() = {.callback = p.id<CallbackId>(kEvent["callback_id"]),
                                  .started = p.number<std::uint64_t>(kEvent["started"]),
                                  .ended = p.number<std::uint64_t>(kEvent["ended"]),
                                  .released = p.number<std::uint64_t>(kEvent["released"]),
                                  .overwritten = p.number<std::uint64_t>(kEvent["overwritten"]),
                                  .lost = p.number<std::uint64_t>(kEvent["lost"])};
}

void publisher_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kPublisherInit;
  body.emplace<PublisherInit>() = {.publisher = p.id<PublisherId>(kEvent["publisher_id"]),
                                   .node = p.id<NodeId>(kEvent["node_id"]),
                                   .topic = p.text(kEvent["topic"]),
                                   .writer_gid = p.number<std::uint64_t>(kEvent["writer_gid"]),
                                   .next_seq = p.number<std::uint64_t>(kEvent["next_seq"])};
}

void publisher_fini(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kPublisherFini;
  body.emplace<PublisherFini>() = {.publisher = p.id<PublisherId>(kEvent["publisher_id"]),
                                   .published = p.number<std::uint64_t>(kEvent["published"])};
}

void thread_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kThreadInit;
  body.emplace<ThreadInit>() = {.tid = p.number<std::uint32_t>(kEvent["tid"]),
                                .role = p.label<ThreadRole>(kEvent["role"]),
                                .callback = p.id<CallbackId>(kEvent["callback_id"]),
                                .group = p.id<GroupId>(kEvent["group_id"]),
                                .name = p.text(kEvent["name"]),
                                .start_ns = p.number<std::int64_t>(kEvent["start_ns"])};
}

void thread_fini(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kThreadFini;
  body.emplace<ThreadFini>() = {.tid = p.number<std::uint32_t>(kEvent["tid"]),
                                .read_backs = p.number<std::uint32_t>(kEvent["read_backs"])};
}

void thread_sched(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kThreadSched;
  body.emplace<ThreadSched>() = {.tid = p.number<std::uint32_t>(kEvent["tid"]),
                                 .moment = p.label<SchedMoment>(kEvent["moment"]),
                                 .n = p.number<std::uint32_t>(kEvent["n"]),
                                 .policy = p.number<std::int32_t>(kEvent["policy"]),
                                 .flags = p.number<std::uint64_t>(kEvent["flags"]),
                                 .nice = p.number<std::int32_t>(kEvent["nice"]),
                                 .priority = p.number<std::uint32_t>(kEvent["priority"]),
                                 .runtime_ns = p.number<std::uint64_t>(kEvent["runtime_ns"]),
                                 .deadline_ns = p.number<std::uint64_t>(kEvent["deadline_ns"]),
                                 .period_ns = p.number<std::uint64_t>(kEvent["period_ns"]),
                                 .cpus = p.integers(kEvent["cpus"]),
                                 .error = p.number<std::int32_t>(kEvent["error"]),
                                 .slice_ns = p.optional<std::uint64_t>(kEvent["slice_ns"]),
                                 .util_min = p.optional<std::uint32_t>(kEvent["util_min"]),
                                 .util_max = p.optional<std::uint32_t>(kEvent["util_max"]),
                                 .change = p.number<std::uint32_t>(kEvent["change"])};
}

void callback_release(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kCallbackRelease;
  body.emplace<CallbackRelease>() = {.callback = p.id<CallbackId>(kEvent["callback_id"]),
                                     .release_seq = p.number<std::uint64_t>(kEvent["release_seq"]),
                                     .overwritten = p.number<std::uint64_t>(kEvent["overwritten"])};
}

void thread_wakeup(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kThreadWakeup;
  body.emplace<ThreadWakeup>() = {.callback = p.id<CallbackId>(kEvent["callback_id"]),
                                  .reason = p.label<WakeupReason>(kEvent["reason"])};
}

void callback_start(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kCallbackStart;
  body.emplace<CallbackStart>() = {.callback = p.id<CallbackId>(kEvent["callback_id"]),
                                   .seq = p.number<std::uint64_t>(kEvent["seq"]),
                                   .release_kind = p.label<ReleaseKind>(kEvent["release_kind"]),
                                   .release_ns = p.number<std::int64_t>(kEvent["release_ns"], -1),
                                   .missed = p.number<std::uint32_t>(kEvent["missed"]),
                                   .source_timestamp_realtime_ns = p.number<std::int64_t>(
                                       kEvent["source_timestamp_realtime_ns"]),
                                   .writer_gid = p.number<std::uint64_t>(kEvent["writer_gid"])};
}

void callback_end(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kCallbackEnd;
  body.emplace<CallbackEnd>() = {.callback = p.id<CallbackId>(kEvent["callback_id"]),
                                 .seq = p.number<std::uint64_t>(kEvent["seq"]),
                                 .status = p.label<CallbackStatus>(kEvent["status"])};
}

void publish(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kPublish;
  body.emplace<Publish>() = {.publisher = p.id<PublisherId>(kEvent["publisher_id"]),
                             .seq = p.number<std::uint64_t>(kEvent["seq"]),
                             .source_timestamp_realtime_ns =
                                 p.number<std::int64_t>(kEvent["source_timestamp_realtime_ns"])};
}

void publish_failed(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kPublishFailed;
  body.emplace<PublishFailed>() = {.publisher = p.id<PublisherId>(kEvent["publisher_id"]),
                                   .source_timestamp_realtime_ns = p.number<std::int64_t>(
                                       kEvent["source_timestamp_realtime_ns"]),
                                   .total = p.number<std::uint64_t>(kEvent["total"])};
}

void sample_lost(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kSampleLost;
  body.emplace<SampleLost>() = {.callback = p.id<CallbackId>(kEvent["callback_id"]),
                                .count = p.number<std::uint32_t>(kEvent["count"]),
                                .total = p.number<std::uint64_t>(kEvent["total"])};
}

void clock_sync(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto kEvent = provider::kClockSync;
  body.emplace<ClockSync>() = {.monotonic_ns = p.number<std::int64_t>(kEvent["monotonic_ns"]),
                               .realtime_ns = p.number<std::int64_t>(kEvent["realtime_ns"])};
}

// All fields of the event, in the provider's order.
Translation translation(const ProviderEvent& event, Translate translate,
                        bool starts_callback = false) {
  Translation result{event.name,     {}, translate, /*kind=*/0, /*has_thread_name=*/false,
                     starts_callback};
  for (const auto& field : event.fields) {
    auto& request = result.fields.emplace_back(field.name, field.labels);
    request.is_needed = field.is_needed;
  }
  return result;
}

}  // namespace

const std::vector<Translation>& cie_vocabulary() {
  static const std::vector<Translation> table{
      translation(provider::kRunBegin, run_begin),
      translation(provider::kRunEnd, run_end),
      translation(provider::kNodeInit, node_init),
      translation(provider::kGroupInit, group_init),
      translation(provider::kCallbackInit, callback_init),
      translation(provider::kCallbackFini, callback_fini),
      translation(provider::kPublisherInit, publisher_init),
      translation(provider::kPublisherFini, publisher_fini),
      translation(provider::kThreadInit, thread_init),
      translation(provider::kThreadFini, thread_fini),
      translation(provider::kThreadSched, thread_sched),
      translation(provider::kCallbackRelease, callback_release),
      translation(provider::kThreadWakeup, thread_wakeup),
      translation(provider::kCallbackStart, callback_start, /*starts_callback=*/true),
      translation(provider::kCallbackEnd, callback_end),
      translation(provider::kPublish, publish),
      translation(provider::kPublishFailed, publish_failed),
      translation(provider::kSampleLost, sample_lost),
      translation(provider::kClockSync, clock_sync)};
  return table;
}

}  // namespace cie::analysis
