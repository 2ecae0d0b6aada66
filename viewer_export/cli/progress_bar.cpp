#include "progress_bar.hpp"

#include <cie/tracepoints/text_columns.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

namespace cie::cli {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr Seconds kPatience{0.5};  // before the first line, and before a rate is believed
constexpr std::chrono::milliseconds kPeriod{200};

// "1.25 MB", "716 k instances": three digits.
std::string quantity(double value, std::string_view unit, bool is_symbol) {
  constexpr std::array<std::string_view, 5> kPrefixes{"", "k", "M", "G", "T"};
  std::size_t prefix = 0;
  for (; value >= 999.5 && prefix + 1 < kPrefixes.size(); ++prefix)
    value /= 1000;
  const int decimals = prefix == 0 || value >= 99.95 ? 0 : value >= 9.995 ? 1 : 2;
  const bool has_gap = !is_symbol && prefix > 0 && !unit.empty();
  return fmt::format("{:.{}f} {}{}{}", value, decimals, kPrefixes[prefix], has_gap ? " " : "",
                     unit);
}

std::string time_left(double seconds) {
  const auto whole = static_cast<std::uint64_t>(std::ceil(std::min(seconds, 359'999.0)));
  constexpr std::uint64_t kMinute = 60;
  if (whole < kMinute) return fmt::format("{} s", whole);
  if (whole < kMinute * kMinute)
    return fmt::format("{}:{:02} min", whole / kMinute, whole % kMinute);
  return fmt::format("{}:{:02} h", whole / kMinute / kMinute, whole / kMinute % kMinute);
}

void show(const std::string& text) {
  // Nobody can be told that a terminal is gone.
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace

std::string progress_line(std::string_view what, ProgressUnit unit, std::uint64_t done,
                          std::uint64_t total, Seconds elapsed, std::size_t columns) {
  const bool is_bytes = unit == ProgressUnit::bytes;
  const double rate = elapsed >= kPatience ? static_cast<double>(done) / elapsed.count() : 0;
  std::string facts = quantity(static_cast<double>(done), is_bytes ? "B" : "instances", is_bytes);
  if (rate > 0) {
    facts += fmt::format(", {}/s", quantity(rate, is_bytes ? "B" : "", is_bytes));
    if (total > done) {
      facts += fmt::format(", {} left", time_left(static_cast<double>(total - done) / rate));
    }
  }
  if (total == 0) {
    const auto seconds = fmt::format("{} for {:.0f} s", what, elapsed.count());
    return (done == 0 ? seconds : fmt::format("{} {}", what, facts)).substr(0, columns);
  }
  const double share = std::min(1.0, static_cast<double>(done) / static_cast<double>(total));
  const auto head = fmt::format("{} {:3.0f} % ", what, std::floor(100 * share));
  constexpr std::size_t kBar = 20;
  constexpr std::size_t kBrackets = 3;  // and a space
  std::string bar;
  if (const auto needed = head.size() + facts.size() + kBrackets; needed + 5 <= columns) {
    const auto width = std::min(kBar, columns - needed);
    const auto full = static_cast<std::size_t>(share * static_cast<double>(width));
    bar = '[' + std::string(full, '#') + std::string(width - full, '.') + "] ";
  }
  return (head + bar + facts).substr(0, columns);
}

ProgressBar::ProgressBar(bool is_wanted) : is_drawn_(is_wanted && ::isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() { end(); }

analysis::Progress* ProgressBar::begin(std::string_view what, ProgressUnit unit) {
  end();
  if (!is_drawn_) return nullptr;
  what_ = what;
  unit_ = unit;
  is_over_ = false;
  auto* progress = &progress_.emplace();
  // Signals are for the thread that works.
  sigset_t all{};
  sigset_t before{};
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { draw(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return progress;
}

void ProgressBar::end() {
  if (!thread_.joinable()) return;
  {
    const std::scoped_lock lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void ProgressBar::draw() {
  const auto begin = Clock::now();
  const auto is_over = [this] { return is_over_; };
  std::unique_lock lock(mutex_);
  bool is_shown = false;
  for (auto next = begin + std::chrono::duration_cast<Clock::duration>(kPatience);
       !changed_.wait_until(lock, next, is_over); next += kPeriod) {
    const auto columns = terminal_columns(STDERR_FILENO);
    show("\r" +
         progress_line(what_, unit_, progress_->done.load(std::memory_order_relaxed),
                       progress_->total.load(std::memory_order_relaxed), Clock::now() - begin,
                       columns > 1 ? columns - 1 : columns) +
         "\x1b[K");
    is_shown = true;
  }
  if (is_shown) show("\r\x1b[K");
}

}  // namespace cie::cli
