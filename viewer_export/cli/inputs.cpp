#include "inputs.hpp"

#include <chrono>
#include <cstdio>

#include <unistd.h>

namespace cie::cli {
namespace {

using Clock = std::chrono::steady_clock;

// Passes everything on and says now and then how far it is.
class Progress final : public analysis::Observer {
 public:
  explicit Progress(analysis::Observer* next) : next_(next) {}
  ~Progress() override {
    if (is_shown_) {
      std::fputs("\r\x1b[K", stderr);
    }
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void on_instance(const analysis::Instance& instance) override {
    if (next_ != nullptr) {
      next_->on_instance(instance);
    }
    constexpr std::uint64_t kStride = 4096;
    if (++instances_ % kStride == 0 && Clock::now() >= next_time_) {
      std::fprintf(stderr, "\rreading: %ju instances", static_cast<std::uintmax_t>(instances_));
      is_shown_ = true;
      next_time_ = Clock::now() + std::chrono::milliseconds(200);
    }
  }
  void on_publication(const analysis::Publication& publication) override {
    if (next_ != nullptr) {
      next_->on_publication(publication);
    }
  }
  void on_sched_slice(const analysis::SchedSlice& slice) override {
    if (next_ != nullptr) {
      next_->on_sched_slice(slice);
    }
  }
  void on_waking(const analysis::Waking& waking) override {
    if (next_ != nullptr) {
      next_->on_waking(waking);
    }
  }

 private:
  analysis::Observer* next_;
  std::uint64_t instances_ = 0;
  bool is_shown_ = false;
  Clock::time_point next_time_ = Clock::now() + std::chrono::milliseconds(500);
};

}  // namespace

ReaderOption::ReaderOption(CommandLine& line) {
  line.option("--reader", "READER", choice_,
              "Who decodes the traces: native (default) or babeltrace2");
  line.option("--metadata", "FILE", metadata_,
              "Metadata of a like recording, for traces whose own is lost");
}

analysis::Reader ReaderOption::value() const {
  check_choice("--reader", choice_, {"native", "babeltrace2"});
  if (choice_ != "native" && !metadata_.empty()) {
    throw UsageError("--metadata is for the native reader");
  }
  return choice_ == "native" ? analysis::Reader::native : analysis::Reader::babeltrace2;
}

std::optional<SchedulingSpec> load_spec(const std::string& file) {
  return file.empty() ? std::nullopt : std::optional(SchedulingSpec::load(file));
}

analysis::AnalysisResult analyze_with_progress(const std::vector<std::filesystem::path>& traces,
                                               const analysis::AnalysisOptions& options,
                                               analysis::Observer* observer) {
  if (::isatty(STDERR_FILENO) == 0) {
    return analysis::analyze(traces, options, observer);
  }
  Progress progress(observer);
  return analysis::analyze(traces, options, &progress);
}

}  // namespace cie::cli
