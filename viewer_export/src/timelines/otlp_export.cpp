// OpenTelemetry's file format: a TracesData message in JSON per line, at most some hundred spans
// each. An instance is a span, a publication a producer's span inside it; the instance that took
// the message is a consumer's span below that one, and linked to it. So a trace is a chain from its
// first instance on. Ids are digests of what they stand for: one recording gives the same ones
// always, also in parts.
#include <cie/tracepoints/sha256.hpp>
#include <cie/viewer_export/version.hpp>

#include "json/json.hpp"
#include "notes.hpp"
#include "output/nesting.hpp"
#include "viewers.hpp"

#include <compare>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

constexpr std::size_t kSpansPerLine = 512;

// Hexadecimal, as the format has ids in JSON.
struct Context {
  std::string trace;  // 32 digits
  std::string span;   // 16 digits; empty: it is not in the file
};

// The first `digits` of a digest; all zeros would mean "none".
std::string id_of(std::string_view what, std::size_t digits) {
  auto text = sha256_hex(what).substr(0, digits);
  if (text.find_first_not_of('0') == std::string::npos) text.back() = '1';
  return text;
}

enum class SpanKind : std::uint8_t { internal = 1, producer = 4, consumer = 5 };

// Attributes, as the format has them in JSON: 64-bit integers are strings.
class Attributes {
 public:
  void add(std::string_view key, std::string_view value) { add(key, "string", json_string(value)); }
  void add(std::string_view key, std::int64_t value) {
    add(key, "int", fmt::format("\"{}\"", value));
  }
  void add(std::string_view key, std::uint64_t value) {
    if (value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
      add(key, std::string_view(fmt::format("{}", value)));  // the format's integers are signed
    } else {
      add(key, static_cast<std::int64_t>(value));
    }
  }
  const std::string& text() const noexcept { return text_; }

 private:
  void add(std::string_view key, std::string_view type, const std::string& value) {
    fmt::format_to(std::back_inserter(text_), R"({}{{"key":"{}","value":{{"{}Value":{}}}}})",
                   text_.empty() ? "" : ",", key, type, value);
  }
  std::string text_;
};

template <typename T>
void add_notes(Attributes& attributes, const T& told) {
  visit_notes(told, [&attributes](Note note, const auto& value) {
    attributes.add(fmt::format("cie.{}", label(note)), plain(value));
  });
}

class OtlpExport final : public RecordingExport {
 public:
  using RecordingExport::RecordingExport;

  ViewerCounts write(std::ostream& out, const analysis::AnalysisResult& result) override {
    out_ = &out;
    const ReportNames names(result.report);
    names_ = &names;
    clock_ = CommonClock(result.report);
    run().replay(
        result.report, clock_, [this](const RecordedInstance& record) { draw(record); },
        [this](const RecordedPublication& record) { draw(record); });
    for (auto& [process, batch] : batches_)
      flush(process, batch);
    add_to(counts_);
    return counts_;
  }

 private:
  struct Process {
    analysis::HostIndex host{};
    std::int64_t pid = 0;
    analysis::ProcessIndex index{};  // of programs that have one pid each has its own
    // NOLINTNEXTLINE(modernize-use-nullptr): see time.hpp
    friend auto operator<=>(const Process&, const Process&) = default;
  };
  struct Batch {
    std::string spans;
    std::size_t count = 0;
  };
  struct Delivery {
    Context publication;
    std::uint32_t topic = 0;
  };

  void draw(const RecordedInstance& record) {
    const auto& i = record.instance;
    const auto& name = run().callbacks().name(record.name);
    std::optional<Delivery> taken;
    if (auto found = in_flight_.extract(record.index); !found.empty()) taken = found.mapped();
    const auto identity = fmt::format("instance\n{}\n{}\n{}\n{}\n{}\n{}", name, i.pid, i.tid, i.seq,
                                      i.start.ns, names_->host(i.host, i.pid));
    const Context own{.trace = taken ? taken->publication.trace : id_of("trace\n" + identity, 32),
                      .span = id_of(identity, 16)};
    auto& nesting = nesting_[thread_of(i)];
    nesting.change_process(i.process);
    if (!i.end) {
      nesting.enter(i.start.ns, std::nullopt, {.trace = own.trace, .span = {}});
      ++counts_.unfinished;  // the format demands an end, and we make none up
      return;
    }
    nesting.enter(i.start.ns, i.end->ns, own);
    Attributes attributes;
    add_thread(attributes, thread_of(i));
    add_notes(attributes, i);
    if (i.writer_gid != 0) {
      attributes.add("messaging.system", std::string_view("dds"));
      attributes.add("messaging.operation.type", std::string_view("process"));
    }
    if (taken) {
      attributes.add("messaging.destination.name", run().topics().name(taken->topic));
    }
    const auto parent = taken ? taken->publication.span : std::string();
    std::string rest;
    if (taken) {
      rest += fmt::format(R"(,"links":[{{"traceId":"{}","spanId":"{}"}}])",
                          taken->publication.trace, taken->publication.span);
    }
    if (i.status == CallbackStatus::exception) rest += R"(,"status":{"code":2})";
    add_span({i.host, i.pid, i.process}, own, parent, name,
             i.writer_gid != 0 ? SpanKind::consumer : SpanKind::internal, i.start.ns, i.end->ns,
             attributes, rest);
    ++counts_.instances;
  }

  void draw(const RecordedPublication& record) {
    const auto& p = record.publication;
    const auto thread = thread_of(p);
    const auto& topic = run().topics().name(record.topic);
    const auto identity =
        fmt::format("publication\n{}\n{}\n{}\n{}\n{}\n{}\n{}", topic, p.pid, p.tid, p.publisher_id,
                    p.seq, p.time.ns, names_->host(p.host, p.pid));
    auto& nesting = nesting_[thread];
    nesting.change_process(p.process);
    const auto* around = nesting.around(p.time.ns);
    const Context own{.trace = around != nullptr ? around->trace : id_of("trace\n" + identity, 32),
                      .span = id_of(identity, 16)};
    Attributes attributes;
    add_thread(attributes, thread);
    add_notes(attributes, p);
    attributes.add("messaging.system", std::string_view("dds"));
    attributes.add("messaging.operation.type", std::string_view("send"));
    attributes.add("messaging.destination.name", topic);
    add_span({p.host, p.pid, p.process}, own, around != nullptr ? around->span : std::string(),
             "publish " + topic, SpanKind::producer, p.time.ns, p.time.ns, attributes, {});
    ++counts_.publications;
    for (const auto receiver : record.receivers)
      in_flight_[receiver] = {.publication = own, .topic = record.topic};
  }

  void add_thread(Attributes& attributes, const ThreadKey& thread) const {
    if (const auto tid = known_tid(thread.tid)) attributes.add("thread.id", *tid);
    if (const auto name = names_->thread(thread); !name.empty())
      attributes.add("thread.name", std::string_view(name));
  }

  void add_span(const Process& process, const Context& own, const std::string& parent,
                const std::string& name, SpanKind kind, std::int64_t start, std::int64_t end,
                const Attributes& attributes, const std::string& rest) {
    auto& batch = batches_[process];
    fmt::format_to(
        std::back_inserter(batch.spans),
        R"({}{{"traceId":"{}","spanId":"{}"{},"name":{},"kind":{},"startTimeUnixNano":"{}","endTimeUnixNano":"{}","attributes":[{}]{}}})",
        batch.count == 0 ? "" : ",", own.trace, own.span,
        parent.empty() ? "" : fmt::format(R"(,"parentSpanId":"{}")", parent), json_string(name),
        static_cast<int>(kind), clock_.realtime_or_own(process.host, start),
        clock_.realtime_or_own(process.host, end), attributes.text(), rest);
    if (++batch.count >= kSpansPerLine) flush(process, batch);
  }

  void flush(const Process& process, Batch& batch) {
    if (batch.count == 0) return;
    const auto& [host, pid, index] = process;
    Attributes resource;
    const auto name = names_->process(index);
    resource.add("service.name", name.empty() ? fmt::format("pid {}", pid) : name);
    resource.add("process.pid", pid);
    resource.add("host.name", names_->host(host, pid));
    resource.add("cie.clock",
                 std::string_view(clock_.realtime_offset() ? "realtime" : "monotonic"));
    *out_ << R"({"resourceSpans":[{"resource":{"attributes":[)" << resource.text()
          << R"(]},"scopeSpans":[{"scope":{"name":"cie","version":")" << tool_version()
          << R"("},"spans":[)" << batch.spans << "]}]}]}\n";
    batch = {};
  }

  std::ostream* out_ = nullptr;
  const ReportNames* names_ = nullptr;
  CommonClock clock_;
  std::map<Process, Batch> batches_;
  std::map<ThreadKey, Nesting<Context>> nesting_;
  std::unordered_map<std::uint64_t, Delivery> in_flight_;  // by index of the instance to come
  ViewerCounts counts_;
};

}  // namespace

std::unique_ptr<ViewerExport> make_otlp_export(const ViewerOptions& options) {
  return std::make_unique<OtlpExport>(options);
}

}  // namespace cie::viewer_export
