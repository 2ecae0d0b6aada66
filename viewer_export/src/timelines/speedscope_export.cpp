// https://www.speedscope.app's own format, "evented": a profile per thread, in which callbacks open
// and close like functions. For flame graphs of threads that nest callbacks, and for the sums.
#include <cie/viewer_export/version.hpp>

#include "common_clock.hpp"
#include "json/json.hpp"
#include "output/external_sorter.hpp"
#include "output/name_table.hpp"
#include "viewers.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>

namespace cie::viewer_export {
namespace {

constexpr std::int64_t kStillOpen = std::numeric_limits<std::int64_t>::max();

struct Span {
  ThreadKey thread;
  std::int64_t start = 0;
  std::int64_t end = 0;  // kStillOpen: open
  std::uint32_t frame = 0;
  analysis::ProcessIndex process{};
};

struct Extent {
  std::int64_t first = kStillOpen;
  std::int64_t last = 0;
};

// Thread by thread; outer spans before those they contain.
struct ByThread {
  bool operator()(const Span& a, const Span& b) const {
    return std::tuple(a.thread, a.start, -a.end, a.frame) <
           std::tuple(b.thread, b.start, -b.end, b.frame);
  }
};

class SpeedscopeExport final : public ViewerExport {
 public:
  explicit SpeedscopeExport(const ViewerOptions& options)
      : spans_(options.records_in_memory, options.spill_directory) {}

  void on_instance(const analysis::Instance& instance) override {
    if (instance.start.ns < 0 || (instance.end && *instance.end < instance.start)) {
      ++counts_.skipped;
      return;
    }
    std::string name(instance.logical_id);
    if (!instance.end) name += " (never ended)";
    spans_.add({.thread = thread_of(instance),
                .start = instance.start.ns,
                .end = instance.end ? instance.end->ns : kStillOpen,
                .frame = frames_.number(name),
                .process = instance.process});
    auto& [first, last] = extents_[instance.host];
    first = std::min(first, instance.start.ns);
    last = std::max(last, instance.end ? instance.end->ns : instance.start.ns);
  }

  void show_progress(analysis::Progress* progress) override { progress_ = progress; }

  ViewerCounts write(std::ostream& out, const analysis::AnalysisResult& result) override {
    out_ = &out;
    const ReportNames names(result.report);
    clock_ = CommonClock(result.report);
    for (const auto& [host, extent] : extents_) {
      first_ = std::min(first_, clock_.of(host, extent.first));
      last_ = std::max(last_, clock_.of(host, extent.last));
    }
    const auto end = result.report.trace.end;
    if (end) last_ = std::max(last_, clock_.of_summary(*end));
    first_ = std::min(first_, last_);
    out << R"({"$schema":"https://www.speedscope.app/file-format-schema.json","exporter":"cie )"
        << tool_version() << R"(","activeProfileIndex":0,"shared":{"frames":[)";
    for (std::uint32_t frame = 0; frame < frames_.size(); ++frame) {
      out << (frame == 0 ? "" : ",") << R"({"name":)" << json_string(frames_.name(frame)) << "}";
    }
    out << R"(]},"profiles":[)";
    if (progress_ != nullptr) progress_->total = spans_.size();
    spans_.drain([&](const Span& span) {
      if (progress_ != nullptr) progress_->add(1);
      if (thread_ != span.thread) {
        end_thread();
        begin_thread(span.thread, names);
      }
      draw(span);
    });
    end_thread();
    out << "\n]}\n";
    return counts_;
  }

 private:
  void begin_thread(const ThreadKey& thread, const ReportNames& names) {
    auto name = names.thread(thread);
    name += (name.empty() ? "" : ", ") + ids_of(thread);
    if (names.has_several_hosts()) name += ", " + names.host(thread.host, thread.pid);
    *out_
        << (thread_ ? "," : "")
        << fmt::format(
               "\n"
               R"({{"type":"evented","unit":"nanoseconds","startValue":0,"endValue":{},"name":{},"events":[)",
               last_ - first_, json_string(name));
    thread_ = thread;
    is_first_event_ = true;
  }

  void end_thread() {
    if (!thread_) return;
    close_until(kStillOpen);
    *out_ << "]}";
  }

  // Closes what ends at `time` or before. What never ends is closed with the recording.
  void close_until(std::int64_t time) {
    while (!open_.empty() && open_.back().end <= time)
      close(open_.back().end);
  }
  // Another process has the thread's ids from here on: what the one before left open ends.
  void close_others(const Span& next) {
    while (!open_.empty() && open_.back().process != next.process)
      close(next.start);
  }
  void close(std::int64_t time) {
    event('C', open_.back().frame, time);
    open_.pop_back();
  }

  void draw(const Span& span) {
    close_until(span.start);
    close_others(span);
    if (!open_.empty() && open_.back().end < span.end) {
      ++counts_.skipped;  // overlaps without nesting: the format has no place for it
      return;
    }
    event('O', span.frame, span.start);
    open_.push_back(span);
    ++counts_.instances;
  }

  void event(char type, std::uint32_t frame, std::int64_t time) {
    const auto at = time == kStillOpen ? last_ : clock_.of(thread_->host, time);
    *out_ << fmt::format(
        "{}\n"
        R"({{"type":"{}","frame":{},"at":{}}})",
        is_first_event_ ? "" : ",", type, frame, at - first_);
    is_first_event_ = false;
  }

  analysis::Progress* progress_ = nullptr;
  NameTable frames_;
  ExternalSorter<Span, ByThread> spans_;
  std::map<analysis::HostIndex, Extent> extents_;  // by each host's own clock
  CommonClock clock_;
  std::int64_t first_ = kStillOpen;  // by that one
  std::int64_t last_ = 0;
  std::ostream* out_ = nullptr;
  std::optional<ThreadKey> thread_;
  std::vector<Span> open_;  // outermost first
  bool is_first_event_ = true;
  ViewerCounts counts_;
};

}  // namespace

std::unique_ptr<ViewerExport> make_speedscope_export(const ViewerOptions& options) {
  return std::make_unique<SpeedscopeExport>(options);
}

}  // namespace cie::viewer_export
