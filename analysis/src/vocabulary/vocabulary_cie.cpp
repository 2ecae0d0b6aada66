#include "vocabulary.hpp"

namespace cie::analysis {
namespace {

void run_begin(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<RunBegin>() = {.contract_version = p.number<std::uint32_t>(0),
                              .tool_version = p.text(1),
                              .executor = p.text(2),
                              .boot_id = p.text(3),
                              .host = p.text(4),
                              .pid = p.number<std::uint32_t>(5),
                              .pid_ns = p.number<std::uint64_t>(6),
                              .process_start_ns = p.number<std::int64_t>(7),
                              .monotonic_ns = p.number<std::int64_t>(8),
                              .realtime_ns = p.number<std::int64_t>(9),
                              .online_cpus = p.number<std::uint32_t>(10),
                              .spec_sha256 = p.text(11),
                              .moment = p.label<RunMoment>(12)};
}

void run_end(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<RunEnd>() = {.callbacks = p.number<std::uint32_t>(0),
                            .threads = p.number<std::uint32_t>(1),
                            .groups = p.number<std::uint32_t>(2),
                            .publishers = p.number<std::uint32_t>(3),
                            .status = p.number<std::int32_t>(4)};
}

void node_init(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<NodeInit>() = {.node = p.id<NodeId>(0), .name = p.text(1)};
}

void group_init(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<GroupInit>() = {
      .group = p.id<GroupId>(0), .node = p.id<NodeId>(1), .type = p.label<GroupType>(2)};
}

void callback_init(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<CallbackInit>() = {.callback = p.id<CallbackId>(0),
                                  .group = p.id<GroupId>(1),
                                  .node = p.id<NodeId>(2),
                                  .kind = p.label<CallbackKind>(3),
                                  .logical_id = p.text(4),
                                  .source = p.text(5),
                                  .symbol = p.text(6),
                                  .period_ns = p.number<std::uint64_t>(7),
                                  .queue_depth = p.number<std::uint32_t>(8),
                                  .deadline_ns = p.number<std::uint64_t>(9),
                                  .next_seq = p.number<std::uint64_t>(10)};
}

void callback_fini(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<CallbackFini>() = {.callback = p.id<CallbackId>(0),
                                  .started = p.number<std::uint64_t>(1),
                                  .ended = p.number<std::uint64_t>(2),
                                  .released = p.number<std::uint64_t>(3),
                                  .overwritten = p.number<std::uint64_t>(4),
                                  .lost = p.number<std::uint64_t>(5)};
}

void publisher_init(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<PublisherInit>() = {.publisher = p.id<PublisherId>(0),
                                   .node = p.id<NodeId>(1),
                                   .topic = p.text(2),
                                   .writer_gid = p.number<std::uint64_t>(3),
                                   .next_seq = p.number<std::uint64_t>(4)};
}

void publisher_fini(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<PublisherFini>() = {.publisher = p.id<PublisherId>(0),
                                   .published = p.number<std::uint64_t>(1)};
}

void thread_init(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<ThreadInit>() = {.tid = p.number<std::uint32_t>(0),
                                .role = p.label<ThreadRole>(1),
                                .callback = p.id<CallbackId>(2),
                                .group = p.id<GroupId>(3),
                                .name = p.text(4),
                                .start_ns = p.number<std::int64_t>(5)};
}

void thread_fini(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<ThreadFini>() = {.tid = p.number<std::uint32_t>(0),
                                .read_backs = p.number<std::uint32_t>(1)};
}

void thread_sched(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<ThreadSched>() = {.tid = p.number<std::uint32_t>(0),
                                 .moment = p.label<SchedMoment>(1),
                                 .n = p.number<std::uint32_t>(2),
                                 .policy = p.number<std::int32_t>(3),
                                 .flags = p.number<std::uint64_t>(4),
                                 .nice = p.number<std::int32_t>(5),
                                 .priority = p.number<std::uint32_t>(6),
                                 .runtime_ns = p.number<std::uint64_t>(7),
                                 .deadline_ns = p.number<std::uint64_t>(8),
                                 .period_ns = p.number<std::uint64_t>(9),
                                 .cpus = p.integers(10),
                                 .error = p.number<std::int32_t>(11),
                                 .slice_ns = p.optional<std::uint64_t>(12),
                                 .util_min = p.optional<std::uint32_t>(13),
                                 .util_max = p.optional<std::uint32_t>(14),
                                 .change = p.number<std::uint32_t>(15)};
}

void callback_release(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<CallbackRelease>() = {.callback = p.id<CallbackId>(0),
                                     .release_seq = p.number<std::uint64_t>(1),
                                     .overwritten = p.number<std::uint64_t>(2)};
}

void thread_wakeup(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<ThreadWakeup>() = {.callback = p.id<CallbackId>(0),
                                  .reason = p.label<WakeupReason>(1)};
}

void callback_start(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<CallbackStart>() = {.callback = p.id<CallbackId>(0),
                                   .seq = p.number<std::uint64_t>(1),
                                   .release_kind = p.label<ReleaseKind>(2),
                                   .release_ns = p.number<std::int64_t>(3, -1),
                                   .missed = p.number<std::uint32_t>(4),
                                   .source_timestamp_realtime_ns = p.number<std::int64_t>(5),
                                   .writer_gid = p.number<std::uint64_t>(6)};
}

void callback_end(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<CallbackEnd>() = {.callback = p.id<CallbackId>(0),
                                 .seq = p.number<std::uint64_t>(1),
                                 .status = p.label<CallbackStatus>(2)};
}

void publish(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<Publish>() = {.publisher = p.id<PublisherId>(0),
                             .seq = p.number<std::uint64_t>(1),
                             .source_timestamp_realtime_ns = p.number<std::int64_t>(2)};
}

void sample_lost(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<SampleLost>() = {.callback = p.id<CallbackId>(0),
                                .count = p.number<std::uint32_t>(1),
                                .total = p.number<std::uint64_t>(2)};
}

void clock_sync(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<ClockSync>() = {.monotonic_ns = p.number<std::int64_t>(0),
                               .realtime_ns = p.number<std::int64_t>(1)};
}

}  // namespace

const std::vector<Translation>& cie_vocabulary() {
  static const std::vector<Translation> table{
      {"cie:run_begin",
       {"contract_version", "tool_version", "executor", "boot_id", "host", "pid", "pid_ns",
        "process_start_ns", "monotonic_ns", "realtime_ns", "online_cpus", "spec_sha256",
        labelled<RunMoment>("moment")},
       run_begin},
      {"cie:run_end", {"callbacks", "threads", "groups", "publishers", "status"}, run_end},
      {"cie:node_init", {"node_id", "name"}, node_init},
      {"cie:group_init", {"group_id", "node_id", labelled<GroupType>("type")}, group_init},
      {"cie:callback_init",
       {"callback_id", "group_id", "node_id", labelled<CallbackKind>("kind"), "logical_id",
        "source", "symbol", "period_ns", "queue_depth", "deadline_ns", "next_seq"},
       callback_init},
      {"cie:callback_fini",
       {"callback_id", "started", "ended", "released", "overwritten", "lost"},
       callback_fini},
      {"cie:publisher_init",
       {"publisher_id", "node_id", "topic", "writer_gid", "next_seq"},
       publisher_init},
      {"cie:publisher_fini", {"publisher_id", "published"}, publisher_fini},
      {"cie:thread_init",
       {"tid", labelled<ThreadRole>("role"), "callback_id", "group_id", "name", "start_ns"},
       thread_init},
      {"cie:thread_fini", {"tid", "read_backs"}, thread_fini},
      {"cie:thread_sched",
       {"tid", labelled<SchedMoment>("moment"), "n", "policy", "flags", "nice", "priority",
        "runtime_ns", "deadline_ns", "period_ns", "cpus", "error", "slice_ns", "util_min",
        "util_max", "change"},
       thread_sched},
      {"cie:callback_release", {"callback_id", "release_seq", "overwritten"}, callback_release},
      {"cie:thread_wakeup", {"callback_id", labelled<WakeupReason>("reason")}, thread_wakeup},
      {"cie:callback_start",
       {"callback_id", "seq", labelled<ReleaseKind>("release_kind"), "release_ns", "missed",
        "source_timestamp_realtime_ns", "writer_gid"},
       callback_start,
       /*kind=*/0,
       /*has_thread_name=*/false,
       /*starts_callback=*/true},
      {"cie:callback_end",
       {"callback_id", "seq", labelled<CallbackStatus>("status")},
       callback_end},
      {"cie:publish", {"publisher_id", "seq", "source_timestamp_realtime_ns"}, publish},
      {"cie:sample_lost", {"callback_id", "count", "total"}, sample_lost},
      {"cie:clock_sync", {"monotonic_ns", "realtime_ns"}, clock_sync}};
  return table;
}

}  // namespace cie::analysis
