#include "synthetic_trace.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

namespace bench {
namespace {

constexpr std::uint32_t kPid = 4001;
constexpr std::uint64_t kBegin = 1'000'000'000'000;
constexpr std::uint64_t kRound = 50'000;  // of one application
constexpr std::uint64_t kLeastPeriod = 1'000'000;
constexpr std::int64_t kRealtime = 1'700'000'000'000'000'000;

enum class Id : std::uint16_t {
  run_begin,
  run_end,
  node_init,
  group_init,
  callback_init,
  callback_fini,
  publisher_init,
  publisher_fini,
  thread_init,
  thread_fini,
  callback_release,
  thread_wakeup,
  callback_start,
  callback_end,
  publish
};

constexpr std::string_view kMetadata = R"(/* CTF 1.8 */
typealias integer { size = 8; align = 8; signed = false; } := uint8_t;
typealias integer { size = 16; align = 8; signed = false; } := uint16_t;
typealias integer { size = 32; align = 8; signed = false; } := uint32_t;
typealias integer { size = 64; align = 8; signed = false; } := uint64_t;
typealias integer { size = 32; align = 8; signed = true; } := int32_t;
typealias integer { size = 64; align = 8; signed = true; } := int64_t;
trace { major = 1; minor = 8; uuid = "5a17c0de-0b07-4b1d-9abc-0123456789ab"; byte_order = le;
  packet.header := struct { uint32_t magic; uint8_t uuid[16]; uint32_t stream_id;
    uint64_t stream_instance_id; }; };
env { hostname = "bench"; domain = "ust"; tracer_name = "lttng-ust"; tracer_major = 2;
  tracer_minor = 13; tracer_buffering_scheme = "uid"; architecture_bit_width = 64; };
clock { name = "monotonic"; uuid = "11111111-2222-3333-4444-555555555555"; freq = 1000000000;
  offset = 1700000000000000000; };
typealias integer { size = 32; align = 8; signed = false; map = clock.monotonic.value; }
  := uint32_clock_monotonic_t;
typealias integer { size = 64; align = 8; signed = false; map = clock.monotonic.value; }
  := uint64_clock_monotonic_t;
struct packet_context { uint64_clock_monotonic_t timestamp_begin;
  uint64_clock_monotonic_t timestamp_end; uint64_t content_size; uint64_t packet_size;
  uint64_t packet_seq_num; uint64_t events_discarded; uint32_t cpu_id; };
struct event_header_large { enum : uint16_t { compact = 0 ... 65534, extended = 65535 } id;
  variant <id> { struct { uint32_clock_monotonic_t timestamp; } compact;
    struct { uint32_t id; uint64_clock_monotonic_t timestamp; } extended; } v; } align(8);
stream { id = 0; event.header := struct event_header_large;
  packet.context := struct packet_context;
  event.context := struct { int32_t _vpid; int32_t _vtid; }; };
)";

struct Class {
  const char* name;
  const char* fields;
};
constexpr Class kClasses[]{
    {"run_begin",
     "uint32_t _contract_version; string _tool_version; string _executor; string _boot_id; "
     "string _host; uint32_t _pid; uint64_t _pid_ns; int64_t _process_start_ns; "
     "int64_t _monotonic_ns; int64_t _realtime_ns; uint32_t _online_cpus; string _spec_sha256; "
     "enum : uint8_t { start, announce } _moment;"},
    {"run_end",
     "uint32_t _callbacks; uint32_t _threads; uint32_t _groups; uint32_t _publishers; "
     "int32_t _status;"},
    {"node_init", "uint32_t _node_id; string _name;"},
    {"group_init",
     "uint32_t _group_id; uint32_t _node_id; "
     "enum : uint8_t { mutually_exclusive, reentrant } _type;"},
    {"callback_init",
     "uint32_t _callback_id; uint32_t _group_id; uint32_t _node_id; "
     "enum : uint8_t { timer, subscription, service, client, waitable } _kind; "
     "string _logical_id; string _source; string _symbol; uint64_t _period_ns; "
     "uint32_t _queue_depth; uint64_t _deadline_ns; uint64_t _next_seq;"},
    {"callback_fini",
     "uint32_t _callback_id; uint64_t _started; uint64_t _ended; uint64_t _released; "
     "uint64_t _overwritten; uint64_t _lost;"},
    {"publisher_init",
     "uint32_t _publisher_id; uint32_t _node_id; string _topic; uint64_t _writer_gid; "
     "uint64_t _next_seq;"},
    {"publisher_fini", "uint32_t _publisher_id; uint64_t _published;"},
    {"thread_init",
     "uint32_t _tid; enum : uint8_t { callback, pool, dispatcher, worker } _role; "
     "uint32_t _callback_id; uint32_t _group_id; string _name; int64_t _start_ns;"},
    {"thread_fini", "uint32_t _tid; uint32_t _read_backs;"},
    {"callback_release", "uint32_t _callback_id; uint64_t _release_seq; uint64_t _overwritten;"},
    {"thread_wakeup",
     "uint32_t _callback_id; enum : uint8_t { timer, data, guard, spurious } _reason;"},
    {"callback_start",
     "uint32_t _callback_id; uint64_t _seq; enum : uint8_t { timer, data, none } _release_kind; "
     "int64_t _release_ns; uint32_t _missed; int64_t _source_timestamp_realtime_ns; "
     "uint64_t _writer_gid;"},
    {"callback_end",
     "uint32_t _callback_id; uint64_t _seq; enum : uint8_t { ok, exception } _status;"},
    {"publish", "uint32_t _publisher_id; uint64_t _seq; int64_t _source_timestamp_realtime_ns;"}};

std::string metadata_text() {
  std::string text(kMetadata);
  std::size_t id = 0;
  for (const auto& one : kClasses) {
    text += "event { name = \"cie:" + std::string(one.name) + "\"; id = " + std::to_string(id++) +
            "; stream_id = 0; fields := struct { " + one.fields + " }; };\n";
  }
  return text;
}

class Bytes {
 public:
  template <typename T>
  Bytes& add(T value) {
    const auto at = bytes_.size();
    bytes_.resize(at + sizeof value);
    std::memcpy(bytes_.data() + at, &value, sizeof value);
    return *this;
  }
  Bytes& text(const std::string& value) {
    bytes_.insert(bytes_.end(), value.c_str(), value.c_str() + value.size() + 1);
    return *this;
  }
  std::vector<char>& get() { return bytes_; }

 private:
  std::vector<char> bytes_;
};

// One CPU's file. Packets are padded to their size, as a tracer's are.
class Stream {
 public:
  Stream(const std::filesystem::path& file, std::uint32_t cpu, std::uint32_t packet_bytes)
      : file_(file, std::ios::binary), cpu_(cpu), packet_bytes_(packet_bytes) {
    begin(kBegin);
  }

  // The event's payload is added to what this returns.
  Bytes& event(Id id, std::uint64_t time, std::uint32_t tid) {
    constexpr std::size_t kLargest = 512;
    if (packet_.get().size() + kLargest > packet_bytes_) {
      end(last_);
      begin(time);
    }
    if (time - last_ < (std::uint64_t{1} << 32U)) {
      packet_.add(static_cast<std::uint16_t>(id)).add(static_cast<std::uint32_t>(time));
    } else {
      packet_.add(std::uint16_t{0xffff}).add(static_cast<std::uint32_t>(id)).add(time);
    }
    last_ = time;
    ++events_;
    return packet_.add(kPid).add(tid);
  }
  std::uint64_t finish(std::uint64_t time) {
    end(time);
    return events_;
  }

 private:
  static constexpr std::size_t kContentAt = 48;

  void begin(std::uint64_t time) {
    packet_.get().clear();
    packet_.add(std::uint32_t{0xC1FC1FC1});
    for (const int byte : {0x5a, 0x17, 0xc0, 0xde, 0x0b, 0x07, 0x4b, 0x1d, 0x9a, 0xbc, 0x01, 0x23,
                           0x45, 0x67, 0x89, 0xab}) {
      packet_.add(static_cast<std::uint8_t>(byte));
    }
    packet_.add(std::uint32_t{0}).add(std::uint64_t{cpu_});
    packet_.add(time).add(std::uint64_t{0}).add(std::uint64_t{0}).add(std::uint64_t{0});
    packet_.add(sequence_++).add(std::uint64_t{0}).add(cpu_);
    last_ = time;
  }
  void end(std::uint64_t time) {
    auto& bytes = packet_.get();
    const std::uint64_t content = bytes.size() * 8;
    const std::uint64_t size = std::uint64_t{packet_bytes_} * 8;
    std::memcpy(bytes.data() + kContentAt - 8, &time, sizeof time);
    std::memcpy(bytes.data() + kContentAt, &content, sizeof content);
    std::memcpy(bytes.data() + kContentAt + 8, &size, sizeof size);
    bytes.resize(packet_bytes_);
    file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

  std::ofstream file_;
  std::uint32_t cpu_;
  std::uint32_t packet_bytes_;
  Bytes packet_;
  std::uint64_t sequence_ = 0;
  std::uint64_t last_ = 0;
  std::uint64_t events_ = 0;
};

// Timer, publisher, subscription.
class Application {
 public:
  Application(Stream& stream, std::uint32_t number, std::uint64_t period)
      : stream_(stream), number_(number), period_(period) {}

  std::uint32_t timer() const { return 2 * number_; }
  std::uint32_t subscription() const { return 2 * number_ + 1; }
  std::uint32_t tid(std::uint32_t callback) const { return kPid + 1 + callback; }

  void announce(std::uint64_t time) {
    const auto topic = "/topic" + std::to_string(number_);
    const auto node = "/node" + std::to_string(number_);
    stream_.event(Id::node_init, time, kPid).add(number_).text(node);
    for (const auto callback : {timer(), subscription()}) {
      const bool is_timer = callback == timer();
      stream_.event(Id::group_init, time, kPid).add(callback).add(number_).add(std::uint8_t{0});
      stream_.event(Id::callback_init, time, kPid)
          .add(callback)
          .add(callback)
          .add(number_)
          .add(static_cast<std::uint8_t>(is_timer ? 0 : 1))
          .text(node + (is_timer ? "@Timer(" + std::to_string(period_) + ")"
                                 : "@Subscription(" + topic + ")"))
          .text(is_timer ? "" : topic)
          .text("run")
          .add(std::uint64_t{is_timer ? period_ : 0})
          .add(std::uint32_t{1})
          .add(std::uint64_t{0})
          .add(std::uint64_t{0});
      stream_.event(Id::thread_init, time, tid(callback))
          .add(tid(callback))
          .add(std::uint8_t{0})
          .add(callback)
          .add(callback)
          .text("cb" + std::to_string(callback))
          .add(static_cast<std::int64_t>(time));
    }
    stream_.event(Id::publisher_init, time, kPid)
        .add(number_)
        .add(number_)
        .text(topic)
        .add(gid())
        .add(std::uint64_t{0});
  }

  void round(std::uint64_t number, std::uint64_t time) {
    const auto expiry = static_cast<std::int64_t>(time);
    // Differs between CPUs and rounds, so that streams interleave.
    auto at = time + 1000 + (number * 7919 + number_ * 104729) % 5000;
    const auto next = [&at](std::uint64_t step) { return at += step; };
    const auto sent = kRealtime + static_cast<std::int64_t>(at);
    stream_.event(Id::thread_wakeup, next(300), tid(timer())).add(timer()).add(std::uint8_t{0});
    start(timer(), number, next(400), 0, expiry, 0, 0);
    stream_.event(Id::publish, next(9'000), tid(timer())).add(number_).add(number).add(sent);
    const auto arrival = next(900);
    stream_.event(Id::callback_release, arrival, tid(timer()))
        .add(subscription())
        .add(number)
        .add(std::uint64_t{0});
    end(timer(), number, next(700));
    stream_.event(Id::thread_wakeup, next(2'000), tid(subscription()))
        .add(subscription())
        .add(std::uint8_t{1});
    start(subscription(), number, next(400), 1, static_cast<std::int64_t>(arrival), sent, gid());
    end(subscription(), number, next(20'000));
  }

  void finish(std::uint64_t rounds, std::uint64_t time) {
    for (const auto callback : {timer(), subscription()}) {
      const auto released = callback == timer() ? 0 : rounds;
      stream_.event(Id::callback_fini, time, kPid)
          .add(callback)
          .add(rounds)
          .add(rounds)
          .add(released)
          .add(std::uint64_t{0})
          .add(std::uint64_t{0});
      stream_.event(Id::thread_fini, time, tid(callback)).add(tid(callback)).add(std::uint32_t{0});
    }
    stream_.event(Id::publisher_fini, time, kPid).add(number_).add(rounds);
  }

 private:
  std::uint64_t gid() const { return 0xabc0000 + number_; }
  void start(std::uint32_t callback, std::uint64_t number, std::uint64_t time, std::uint8_t kind,
             std::int64_t release, std::int64_t source, std::uint64_t writer) {
    stream_.event(Id::callback_start, time, tid(callback))
        .add(callback)
        .add(number)
        .add(kind)
        .add(release)
        .add(std::uint32_t{0})
        .add(source)
        .add(writer);
  }
  void end(std::uint32_t callback, std::uint64_t number, std::uint64_t time) {
    stream_.event(Id::callback_end, time, tid(callback))
        .add(callback)
        .add(number)
        .add(std::uint8_t{0});
  }

  Stream& stream_;
  std::uint32_t number_;
  std::uint64_t period_;
};

}  // namespace

std::uint64_t write_trace(const std::filesystem::path& directory, const TraceSize& size) {
  std::filesystem::create_directories(directory);
  std::ofstream(directory / "metadata") << metadata_text();
  const auto applications = size.streams * size.applications;
  const auto rounds = size.events / 8 / applications;
  const auto period = std::max(kLeastPeriod, size.applications * kRound);
  std::uint64_t events = 0;
  for (std::uint32_t cpu = 0; cpu < size.streams; ++cpu) {
    Stream stream(directory / ("channel0_" + std::to_string(cpu)), cpu, size.packet_bytes);
    if (cpu == 0) {
      stream.event(Id::run_begin, kBegin + 1, kPid)
          .add(std::uint32_t{1})
          .text("bench")
          .text("isolated")
          .text("11111111-2222-3333-4444-555555555555")
          .text("bench")
          .add(kPid)
          .add(std::uint64_t{1})
          .add(static_cast<std::int64_t>(kBegin))
          .add(static_cast<std::int64_t>(kBegin))
          .add(kRealtime)
          .add(size.streams)
          .text("")
          .add(std::uint8_t{0});
    }
    std::vector<Application> parts;
    for (std::uint32_t i = 0; i < size.applications; ++i) {
      parts.push_back(Application(stream, cpu * size.applications + i, period));
      parts.back().announce(kBegin + 2);
    }
    for (std::uint64_t round = 0; round < rounds; ++round) {
      auto time = kBegin + (round + 1) * period;
      for (auto& part : parts) {
        part.round(round, time);
        time += kRound;
      }
    }
    const auto end = kBegin + (rounds + 2) * period;
    for (auto& part : parts)
      part.finish(rounds, end);
    if (cpu == 0) {
      stream.event(Id::run_end, end + 1, kPid)
          .add(2 * applications)
          .add(2 * applications)
          .add(2 * applications)
          .add(applications)
          .add(std::int32_t{0});
    }
    events += stream.finish(end + 2);
  }
  return events;
}

}  // namespace bench
