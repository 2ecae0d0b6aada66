// The Trace Event Format of chrome://tracing, which many viewers read: complete events ("X") for
// instances and publications, async ones ("b", "e") for what may overlap, flows ("s", "f") for
// messages. Times are microseconds since the first one: since boot they would lose nanoseconds in
// readers that have doubles.
#include <cie/viewer_export/version.hpp>

#include "json/json.hpp"
#include "notes.hpp"
#include "output/nesting.hpp"
#include "viewers.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <variant>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

// The format knows no hosts: their pids and tids are moved apart by more than Linux ever gives.
constexpr std::uint64_t kHostStride = 10'000'000;

class ChromeExport final : public RecordingExport {
 public:
  using RecordingExport::RecordingExport;

  void on_instance(const analysis::Instance& instance) override {
    threads_.insert(thread_of(instance));
    RecordingExport::on_instance(instance);
  }
  void on_publication(const analysis::Publication& publication) override {
    threads_.insert(thread_of(publication));
    RecordingExport::on_publication(publication);
  }

  ViewerCounts write(std::ostream& out, const analysis::AnalysisResult& result) override {
    out_ = &out;
    clock_ = CommonClock(result.report);
    begin_ = run().first_time(clock_).value_or(0);
    *out_ << R"({"displayTimeUnit":"ns","otherData":{"producer":"cie )" << tool_version()
          << fmt::format(R"(","begin_monotonic_ns":"{}"}},"traceEvents":[)", begin_);
    name_threads(result.report);
    run().replay(
        result.report, clock_, [this](const RecordedInstance& record) { draw(record); },
        [this](const RecordedPublication& record) { draw(record); });
    *out_ << "\n]}\n";
    add_to(counts_);
    return counts_;
  }

 private:
  // Begins an event; the caller goes on with a comma and closes it.
  void event(char phase, const ThreadKey& thread, std::string_view category,
             std::string_view name) {
    *out_ << (is_first_ ? "\n" : ",\n")
          << fmt::format(R"({{"ph":"{}","pid":{},"tid":{},"cat":"{}","name":{})", phase,
                         number(thread.pid, thread), number(thread.tid, thread), category,
                         json_string(name));
    is_first_ = false;
  }
  void event_at(char phase, const ThreadKey& thread, std::string_view category,
                std::string_view name, std::int64_t time) {
    event(phase, thread, category, name);
    *out_ << R"(,"ts":)" << microseconds(clock_.of(thread.host, time) - begin_);
  }
  static std::string microseconds(std::int64_t ns) {
    return fmt::format("{}.{:03}", ns / 1000, ns % 1000);
  }
  static std::int64_t number(std::int64_t id, const ThreadKey& thread) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(id) +
                                     at(thread.host) * kHostStride);
  }

  void name_threads(const analysis::Report& report) {
    const ReportNames names(report);
    for (const auto& [thread, name] : names.threads())
      threads_.insert(thread);
    std::optional<std::pair<analysis::HostIndex, std::int64_t>> last;
    for (const auto& thread : threads_) {
      const std::pair process{thread.host, thread.pid};
      if (last != process) {
        auto name = names.process(thread.host, thread.pid);
        if (names.has_several_hosts()) {
          name += fmt::format(" (pid {} on {})", thread.pid, names.host(thread.host, thread.pid));
        }
        if (!name.empty()) name_it("process_name", thread, name);
        last = process;
      }
      const auto name = known_tid(thread.tid) ? names.thread(thread) : "threads not recorded";
      if (!name.empty()) name_it("thread_name", thread, name);
    }
  }
  void name_it(std::string_view what, const ThreadKey& thread, std::string_view name) {
    event('M', thread, "__metadata", what);
    *out_ << R"(,"args":{"name":)" << json_string(name) << "}}";
  }

  void draw(const RecordedInstance& record) {
    const auto& i = record.instance;
    const auto thread = thread_of(i);
    const auto& name = run().callbacks().name(record.name);
    end_process(thread, i.process, i.start.ns);
    draw_wait(record, thread, name);
    ++counts_.instances;
    const auto end = i.end ? std::optional(i.end->ns) : std::nullopt;
    if (!nesting_[thread].enter(i.start.ns, end, {})) {
      draw_overlapping(record, thread, name);
      return;
    }
    // Without an end it is a begin that nothing ends.
    event_at(end ? 'X' : 'B', thread, "callback", name, i.start.ns);
    if (end) *out_ << R"(,"dur":)" << microseconds(*end - i.start.ns);
    *out_ << R"(,"args":{)" << json_of(i) << "}}";
    if (record.takes_seen_message) {
      event_at('f', thread, "message", "message", i.start.ns);
      *out_ << fmt::format(R"(,"id":{},"bp":"e"}})", record.index + 1);
    }
  }

  // Another process has the thread's ids from here on: what the one before left open ends.
  void end_process(const ThreadKey& thread, analysis::ProcessIndex next, std::int64_t time) {
    for (auto left = nesting_[thread].change_process(next); left > 0; --left) {
      event_at('E', thread, "callback", "", time);
      *out_ << "}";
    }
  }

  // What overlaps without nesting cannot be on the thread's own track.
  void draw_overlapping(const RecordedInstance& record, const ThreadKey& thread,
                        const std::string& name) {
    const auto& i = record.instance;
    event_at('b', thread, "overlapping", name, i.start.ns);
    *out_ << fmt::format(R"(,"id":"i{}","args":{{)", record.index) << json_of(i) << "}}";
    if (!i.end) return;
    event_at('e', thread, "overlapping", name, i.end->ns);
    *out_ << fmt::format(R"(,"id":"i{}"}})", record.index);
  }

  void draw_wait(const RecordedInstance& record, const ThreadKey& thread,
                 const std::string& callback) {
    const auto& i = record.instance;
    if (!i.release || i.release->ns < 0 || !(*i.release < i.start)) return;
    const auto name = is_known(i.release_source)
                          ? callback
                          : fmt::format("{} ({})", callback, wait_words(i.release_source));
    event_at('b', thread, "wait", name, i.release->ns);
    *out_ << fmt::format(R"(,"id":"w{}","args":{{"seq":{},"release_source":"{}"}}}})", record.index,
                         i.seq, analysis::label(i.release_source));
    event_at('e', thread, "wait", name, i.start.ns);
    *out_ << fmt::format(R"(,"id":"w{}"}})", record.index);
  }

  // A slice of its own, without length, for the arrows to leave from.
  void draw(const RecordedPublication& record) {
    const auto& p = record.publication;
    const auto thread = thread_of(p);
    end_process(thread, p.process, p.time.ns);
    event_at('X', thread, "publish", "publish " + run().topics().name(record.topic), p.time.ns);
    *out_ << R"(,"dur":0,"args":{)" << json_of(p) << "}}";
    ++counts_.publications;
    for (const auto receiver : record.receivers) {
      event_at('s', thread, "message", "message", p.time.ns);
      *out_ << fmt::format(R"(,"id":{}}})", receiver + 1);
    }
  }

  std::ostream* out_ = nullptr;
  CommonClock clock_;
  std::int64_t begin_ = 0;
  bool is_first_ = true;
  std::set<ThreadKey> threads_;
  std::map<ThreadKey, Nesting<std::monostate>> nesting_;
  ViewerCounts counts_;
};

}  // namespace

std::unique_ptr<ViewerExport> make_chrome_export(const ViewerOptions& options) {
  return std::make_unique<ChromeExport>(options);
}

}  // namespace cie::viewer_export
