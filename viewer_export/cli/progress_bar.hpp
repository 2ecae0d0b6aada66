// One line on a terminal that says how far a long command is.
#pragma once

#include <cie/analysis/progress.hpp>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

namespace cie::cli {

enum class ProgressUnit : std::uint8_t { bytes, instances };

// What is done, how far it is, how fast, and how long it will take: at most `columns` wide, and
// ASCII. Without a total neither share nor time left.
std::string progress_line(std::string_view what, ProgressUnit unit, std::uint64_t done,
                          std::uint64_t total, std::chrono::duration<double> elapsed,
                          std::size_t columns);

// Draws on standard error from a thread of its own, so that whoever works only counts. Nothing is
// drawn for what is over within half a second, and nothing is left of it.
class ProgressBar {
 public:
  // Draws if `is_wanted` and standard error is a terminal.
  explicit ProgressBar(bool is_wanted);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  // `what` is done from here on; what was before is over. Where to count, which is valid until
  // end(); null if nothing is drawn.
  analysis::Progress* begin(std::string_view what, ProgressUnit unit);
  // Nothing is being done; the line is gone. Does nothing without a begin().
  void end();

 private:
  void draw();

  bool is_drawn_;
  std::string what_;
  ProgressUnit unit_ = ProgressUnit::bytes;
  std::optional<analysis::Progress> progress_;
  std::mutex mutex_;  // guards is_over_
  std::condition_variable changed_;
  bool is_over_ = false;
  std::thread thread_;
};

}  // namespace cie::cli
