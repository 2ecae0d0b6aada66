#include "support/trace_writer.hpp"

namespace cie::test::text {

void Writer::start(std::int64_t time, const Line& line, Callback& callback) {
  CallbackStart event;
  event.callback = CallbackId{callback.id};
  event.seq = line.number<std::uint64_t>("seq", static_cast<std::int64_t>(callback.next));
  callback.next = event.seq + 1;
  event.missed = line.number<std::uint32_t>("missed", 0);
  const auto kind =
      callback.init.kind == CallbackKind::timer ? ReleaseKind::timer : ReleaseKind::data;
  event.release_kind = ReleaseKind::none;
  if (line.value("release", "") == "none") {
    callback.release.reset();
  } else if (line.gives("release")) {
    callback.release = line.number("release", 0);
  }
  if (callback.release) {
    event.release_kind = kind;
    event.release_ns = *callback.release;
    callback.release.reset();
  }
  if (line.gives("from")) {
    const auto from = line.value("from", "");
    const auto colon = from.find(':');
    if (colon == std::string::npos) line.fail("from=P:SEQ");
    const auto& publisher = named(publishers_, line, from.substr(0, colon));
    const auto seq = static_cast<std::uint64_t>(line.parse(from.substr(colon + 1)));
    event.writer_gid = publisher.init.writer_gid;
    event.source_timestamp_realtime_ns = publisher.written.at(seq);
  }
  callback.open.push_back(event.seq);
  ++callback.totals.started;
  add(time, of_line(line, callback.thread, *callback.process), event);
}

void Writer::end(std::int64_t time, const Line& line, Callback& callback) {
  auto& open = callback.open;
  const auto fallback = open.empty() ? callback.next - 1 : open.front();
  const auto seq = line.number<std::uint64_t>("seq", static_cast<std::int64_t>(fallback));
  std::erase(open, seq);
  if (seq >= callback.init.next_seq) ++callback.totals.ended;  // earlier ones are counted
  add(time, of_line(line, callback.thread, *callback.process),
      CallbackEnd{
          .callback = CallbackId{callback.id},
          .seq = seq,
          .status = line.has("exception") ? CallbackStatus::exception : CallbackStatus::ok});
}

void Writer::publish(std::int64_t time, const Line& line) {
  auto& publisher = named(publishers_, line, line.word(2));
  const auto seq = line.number<std::uint64_t>("seq", static_cast<std::int64_t>(publisher.next));
  publisher.next = seq + 1;
  const auto stamp = 1'000'000'000 + time;
  publisher.written[seq] = stamp;
  add(time, of_line(line, nullptr, *publisher.process),
      Publish{.publisher = PublisherId{publisher.id},
              .seq = seq,
              .source_timestamp_realtime_ns = stamp});
}

void Writer::user_event(std::int64_t time, const Line& line) {
  const auto& verb = line.word(1);
  if (verb == "publish") {
    publish(time, line);
    return;
  }
  if (verb == "unsent") {
    auto& publisher = named(publishers_, line, line.word(2));
    publisher.unsent =
        line.number<std::uint64_t>("total", static_cast<std::int64_t>(publisher.unsent + 1));
    add(time, of_line(line, nullptr, *publisher.process),
        PublishFailed{.publisher = PublisherId{publisher.id},
                      .source_timestamp_realtime_ns = publisher.written.rbegin()->second,
                      .total = publisher.unsent});
    return;
  }
  auto& callback = named(callbacks_, line, line.word(2));
  const auto head = of_line(line, callback.thread, *callback.process);
  if (verb == "start") {
    start(time, line, callback);
  } else if (verb == "end") {
    end(time, line, callback);
  } else if (verb == "wakeup") {
    callback.release = time;
    add(time, head,
        ThreadWakeup{.callback = CallbackId{callback.id},
                     .reason = line.has("spurious") ? WakeupReason::spurious : WakeupReason::data});
  } else if (verb == "release") {
    callback.release = time;
    callback.totals.overwritten = line.number<std::uint64_t>(
        "overwritten", static_cast<std::int64_t>(callback.totals.overwritten));
    ++callback.totals.released;
    add(time, main_of(*callback.process),
        CallbackRelease{.callback = CallbackId{callback.id},
                        .release_seq = callback.release_seq++,
                        .overwritten = callback.totals.overwritten});
  } else if (verb == "lost") {
    const auto count = line.number<std::uint32_t>("count", 1);
    callback.totals.lost += count;
    add(time, main_of(*callback.process),
        SampleLost{
            .callback = CallbackId{callback.id}, .count = count, .total = callback.totals.lost});
  } else {
    line.fail("unknown verb " + verb);
  }
}

}  // namespace cie::test::text
