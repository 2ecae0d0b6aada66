#include "provider_events.hpp"
#include "vocabulary.hpp"

namespace cie::analysis {
namespace {

void run_begin(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kRunBegin;
  body.emplace<RunBegin>() = {
      .contract_version = p.number<std::uint32_t>(event["contract_version"]),
      .tool_version = p.text(event["tool_version"]),
      .executor = p.text(event["executor"]),
      .boot_id = p.text(event["boot_id"]),
      .host = p.text(event["host"]),
      .pid = p.number<std::uint32_t>(event["pid"]),
      .pid_ns = p.number<std::uint64_t>(event["pid_ns"]),
      .process_start_ns = p.number<std::int64_t>(event["process_start_ns"]),
      .monotonic_ns = p.number<std::int64_t>(event["monotonic_ns"]),
      .realtime_ns = p.number<std::int64_t>(event["realtime_ns"]),
      .online_cpus = p.number<std::uint32_t>(event["online_cpus"]),
      .spec_sha256 = p.text(event["spec_sha256"]),
      .moment = p.label<RunMoment>(event["moment"])};
}

void run_end(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kRunEnd;
  body.emplace<RunEnd>() = {.callbacks = p.number<std::uint32_t>(event["callbacks"]),
                            .threads = p.number<std::uint32_t>(event["threads"]),
                            .groups = p.number<std::uint32_t>(event["groups"]),
                            .publishers = p.number<std::uint32_t>(event["publishers"]),
                            .status = p.number<std::int32_t>(event["status"])};
}

void node_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kNodeInit;
  body.emplace<NodeInit>() = {.node = p.id<NodeId>(event["node_id"]),
                              .name = p.text(event["name"])};
}

void group_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kGroupInit;
  body.emplace<GroupInit>() = {.group = p.id<GroupId>(event["group_id"]),
                               .node = p.id<NodeId>(event["node_id"]),
                               .type = p.label<GroupType>(event["type"])};
}

void callback_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kCallbackInit;
  body.emplace<CallbackInit>() = {.callback = p.id<CallbackId>(event["callback_id"]),
                                  .group = p.id<GroupId>(event["group_id"]),
                                  .node = p.id<NodeId>(event["node_id"]),
                                  .kind = p.label<CallbackKind>(event["kind"]),
                                  .logical_id = p.text(event["logical_id"]),
                                  .source = p.text(event["source"]),
                                  .symbol = p.text(event["symbol"]),
                                  .period_ns = p.number<std::uint64_t>(event["period_ns"]),
                                  .queue_depth = p.number<std::uint32_t>(event["queue_depth"]),
                                  .deadline_ns = p.number<std::uint64_t>(event["deadline_ns"]),
                                  .next_seq = p.number<std::uint64_t>(event["next_seq"])};
}

void callback_fini(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kCallbackFini;
  body.emplace<CallbackFini>() = {.callback = p.id<CallbackId>(event["callback_id"]),
                                  .started = p.number<std::uint64_t>(event["started"]),
                                  .ended = p.number<std::uint64_t>(event["ended"]),
                                  .released = p.number<std::uint64_t>(event["released"]),
                                  .overwritten = p.number<std::uint64_t>(event["overwritten"]),
                                  .lost = p.number<std::uint64_t>(event["lost"])};
}

void publisher_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kPublisherInit;
  body.emplace<PublisherInit>() = {.publisher = p.id<PublisherId>(event["publisher_id"]),
                                   .node = p.id<NodeId>(event["node_id"]),
                                   .topic = p.text(event["topic"]),
                                   .writer_gid = p.number<std::uint64_t>(event["writer_gid"]),
                                   .next_seq = p.number<std::uint64_t>(event["next_seq"])};
}

void publisher_fini(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kPublisherFini;
  body.emplace<PublisherFini>() = {.publisher = p.id<PublisherId>(event["publisher_id"]),
                                   .published = p.number<std::uint64_t>(event["published"])};
}

void thread_init(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kThreadInit;
  body.emplace<ThreadInit>() = {.tid = p.number<std::uint32_t>(event["tid"]),
                                .role = p.label<ThreadRole>(event["role"]),
                                .callback = p.id<CallbackId>(event["callback_id"]),
                                .group = p.id<GroupId>(event["group_id"]),
                                .name = p.text(event["name"]),
                                .start_ns = p.number<std::int64_t>(event["start_ns"])};
}

void thread_fini(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kThreadFini;
  body.emplace<ThreadFini>() = {.tid = p.number<std::uint32_t>(event["tid"]),
                                .read_backs = p.number<std::uint32_t>(event["read_backs"])};
}

void thread_sched(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kThreadSched;
  body.emplace<ThreadSched>() = {.tid = p.number<std::uint32_t>(event["tid"]),
                                 .moment = p.label<SchedMoment>(event["moment"]),
                                 .n = p.number<std::uint32_t>(event["n"]),
                                 .policy = p.number<std::int32_t>(event["policy"]),
                                 .flags = p.number<std::uint64_t>(event["flags"]),
                                 .nice = p.number<std::int32_t>(event["nice"]),
                                 .priority = p.number<std::uint32_t>(event["priority"]),
                                 .runtime_ns = p.number<std::uint64_t>(event["runtime_ns"]),
                                 .deadline_ns = p.number<std::uint64_t>(event["deadline_ns"]),
                                 .period_ns = p.number<std::uint64_t>(event["period_ns"]),
                                 .cpus = p.integers(event["cpus"]),
                                 .error = p.number<std::int32_t>(event["error"]),
                                 .slice_ns = p.optional<std::uint64_t>(event["slice_ns"]),
                                 .util_min = p.optional<std::uint32_t>(event["util_min"]),
                                 .util_max = p.optional<std::uint32_t>(event["util_max"]),
                                 .change = p.number<std::uint32_t>(event["change"])};
}

void callback_release(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kCallbackRelease;
  body.emplace<CallbackRelease>() = {.callback = p.id<CallbackId>(event["callback_id"]),
                                     .release_seq = p.number<std::uint64_t>(event["release_seq"]),
                                     .overwritten = p.number<std::uint64_t>(event["overwritten"])};
}

void thread_wakeup(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kThreadWakeup;
  body.emplace<ThreadWakeup>() = {.callback = p.id<CallbackId>(event["callback_id"]),
                                  .reason = p.label<WakeupReason>(event["reason"])};
}

void callback_start(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kCallbackStart;
  body.emplace<CallbackStart>() = {
      .callback = p.id<CallbackId>(event["callback_id"]),
      .seq = p.number<std::uint64_t>(event["seq"]),
      .release_kind = p.label<ReleaseKind>(event["release_kind"]),
      .release_ns = p.number<std::int64_t>(event["release_ns"], -1),
      .missed = p.number<std::uint32_t>(event["missed"]),
      .source_timestamp_realtime_ns = p.number<std::int64_t>(event["source_timestamp_realtime_ns"]),
      .writer_gid = p.number<std::uint64_t>(event["writer_gid"])};
}

void callback_end(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kCallbackEnd;
  body.emplace<CallbackEnd>() = {.callback = p.id<CallbackId>(event["callback_id"]),
                                 .seq = p.number<std::uint64_t>(event["seq"]),
                                 .status = p.label<CallbackStatus>(event["status"])};
}

void publish(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kPublish;
  body.emplace<Publish>() = {.publisher = p.id<PublisherId>(event["publisher_id"]),
                             .seq = p.number<std::uint64_t>(event["seq"]),
                             .source_timestamp_realtime_ns =
                                 p.number<std::int64_t>(event["source_timestamp_realtime_ns"])};
}

void sample_lost(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kSampleLost;
  body.emplace<SampleLost>() = {.callback = p.id<CallbackId>(event["callback_id"]),
                                .count = p.number<std::uint32_t>(event["count"]),
                                .total = p.number<std::uint64_t>(event["total"])};
}

void clock_sync(const Payload& p, VocabularyState&, EventBody& body) {
  constexpr auto event = provider::kClockSync;
  body.emplace<ClockSync>() = {.monotonic_ns = p.number<std::int64_t>(event["monotonic_ns"]),
                               .realtime_ns = p.number<std::int64_t>(event["realtime_ns"])};
}

// All fields of the event, in the provider's order.
Translation translation(const ProviderEvent& event, Translate translate,
                        bool starts_callback = false) {
  Translation result{event.name,     {}, translate, /*kind=*/0, /*has_thread_name=*/false,
                     starts_callback};
  for (const auto& field : event.fields)
    result.fields.emplace_back(field.name, field.labels);
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
      translation(provider::kSampleLost, sample_lost),
      translation(provider::kClockSync, clock_sync)};
  return table;
}

}  // namespace cie::analysis
