// MCAP with JSON messages, for Foxglove, Lichtblick and PlotJuggler: a channel per callback and one
// per topic, so that response times are curves without any set-up.
#include <cie/tracepoints/utf8.hpp>
#include <cie/viewer_export/version.hpp>

#include "json/json.hpp"
#include "mcap_writer.hpp"
#include "notes.hpp"
#include "viewers.hpp"

#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

constexpr std::string_view kInstanceSchema = R"({"type":"object","properties":{
"logical_id":{"type":"string"},"host":{"type":"string"},"pid":{"type":"integer"},"tid":{"type":"integer"},
"release_ns":{"type":"integer"},"start_ns":{"type":"integer"},"end_ns":{"type":"integer"},
"duration_ns":{"type":"integer"},"seq":{"type":"integer"},"release_source":{"type":"string"},
"response_time_ns":{"type":"integer"},"response_time_lower_ns":{"type":"integer"},
"response_time_upper_ns":{"type":"integer"},"start_latency_ns":{"type":"integer"},
"missed":{"type":"integer"},"status":{"type":"string"},"state":{"type":"string"},
"cpu_start":{"type":"integer"},"cpu_end":{"type":"integer"},"execution_ns":{"type":"integer"},
"preempted_ns":{"type":"integer"},"blocked_ns":{"type":"integer"},
"wake_delay_ns":{"type":"integer"}}})";

constexpr std::string_view kPublicationSchema = R"({"type":"object","properties":{
"topic":{"type":"string"},"host":{"type":"string"},"pid":{"type":"integer"},"tid":{"type":"integer"},
"time_ns":{"type":"integer"},"seq":{"type":"integer"},"publisher_id":{"type":"integer"},
"writer_gid":{"type":"string"},"source_timestamp_realtime_ns":{"type":"string"},
"receivers":{"type":"integer"}}})";

class McapExport final : public RecordingExport {
 public:
  using RecordingExport::RecordingExport;

  ViewerCounts write(std::ostream& out, const analysis::AnalysisResult& result) override {
    clock_ = CommonClock(result.report);
    const ReportNames names(result.report);
    names_ = &names;
    McapWriter writer(out, fmt::format("cie {}", tool_version()));
    writer_ = &writer;
    instance_schema_ = writer.add_schema("cie.Instance", "jsonschema", kInstanceSchema);
    publication_schema_ = writer.add_schema("cie.Publication", "jsonschema", kPublicationSchema);
    callback_channels_.resize(run().callbacks().size());
    topic_channels_.resize(run().topics().size());
    run().replay(
        result.report, clock_, [this](const RecordedInstance& record) { draw(record); },
        [this](const RecordedPublication& record) { draw(record); });
    writer.finish();
    add_to(counts_);
    return counts_;
  }

 private:
  using Channels = std::vector<std::optional<std::uint16_t>>;  // by number of the name

  // The channel of a name; where the format has no more, the last one is for all that come.
  std::uint16_t channel(Channels& channels, std::uint32_t number, std::uint16_t schema,
                        std::string_view prefix, const std::string& name) {
    auto& channel = channels[number];
    if (!channel) {
      const bool is_full = writer_->channels() + 2 >= McapWriter::kMostChannels;
      auto& shared = schema == instance_schema_ ? other_callbacks_ : other_topics_;
      if (!is_full) {
        channel = writer_->add_channel(schema, std::string(prefix) + valid_utf8(name), "json");
      } else {
        if (!shared) shared = writer_->add_channel(schema, prefix, "json");
        channel = shared;
      }
    }
    return *channel;
  }

  // Where there are several: pids may be the same.
  std::string host_member(const ThreadKey& thread) const {
    if (!names_->has_several_hosts()) return {};
    return R"(,"host":)" + json_string(names_->host(thread.host, thread.pid));
  }

  static std::string tid_member(std::int64_t tid) {
    return known_tid(tid) ? fmt::format(R"(,"tid":{})", tid) : std::string();
  }

  void draw(const RecordedInstance& record) {
    const auto& i = record.instance;
    const auto& name = run().callbacks().name(record.name);
    auto text = fmt::format(R"({{"logical_id":{}{},"pid":{}{})", json_string(name),
                            host_member(thread_of(i)), i.pid, tid_member(i.tid));
    const auto out = std::back_inserter(text);
    if (i.release) fmt::format_to(out, R"(,"release_ns":{})", i.release->ns);
    fmt::format_to(out, R"(,"start_ns":{})", i.start.ns);
    if (i.end) {
      fmt::format_to(out, R"(,"end_ns":{},"duration_ns":{})", i.end->ns, (*i.end - i.start).ns);
    }
    text += "," + json_of(i) + "}";
    const auto to = channel(callback_channels_, record.name, instance_schema_, "/callbacks", name);
    writer_->add_message(
        to, static_cast<std::uint32_t>(i.seq), clock_.realtime_or_own(i.host, i.start.ns),
        clock_.realtime_or_own(i.host, i.release ? i.release->ns : i.start.ns), text);
    ++counts_.instances;
  }

  void draw(const RecordedPublication& record) {
    const auto& p = record.publication;
    const auto& topic = run().topics().name(record.topic);
    // Who took what an unknown publisher wrote nobody knows.
    const auto receivers = p.writer_gid != 0
                               ? fmt::format(R"(,"receivers":{})", record.receivers.size())
                               : std::string();
    const auto text = fmt::format(R"({{"topic":{}{},"pid":{}{},"time_ns":{},{}{}}})",
                                  json_string(topic), host_member(thread_of(p)), p.pid,
                                  tid_member(p.tid), p.time.ns, json_of(p), receivers);
    const auto to =
        channel(topic_channels_, record.topic, publication_schema_, "/publications", topic);
    const auto time = clock_.realtime_or_own(p.host, p.time.ns);
    writer_->add_message(to, static_cast<std::uint32_t>(p.seq), time, time, text);
    ++counts_.publications;
  }

  McapWriter* writer_ = nullptr;
  const ReportNames* names_ = nullptr;  // while write() runs
  CommonClock clock_;
  std::uint16_t instance_schema_ = 0;
  std::uint16_t publication_schema_ = 0;
  Channels callback_channels_;
  Channels topic_channels_;
  std::optional<std::uint16_t> other_callbacks_;
  std::optional<std::uint16_t> other_topics_;
  ViewerCounts counts_;
};

}  // namespace

std::unique_ptr<ViewerExport> make_mcap_export(const ViewerOptions& options) {
  return std::make_unique<McapExport>(options);
}

}  // namespace cie::viewer_export
