// What shows the snapshots of `cie live`, as its options ask.
#pragma once

#include "history.hpp"
#include "live_options.hpp"
#include "live_server.hpp"
#include "pages.hpp"
#include "screen.hpp"

#include <optional>
#include <string>

namespace cie::cli {

class LiveViews {
 public:
  // `options` and `history` are borrowed. Throws std::runtime_error if a view cannot be set up.
  LiveViews(const LiveOptions& options, const live::History& history);
  ~LiveViews();
  LiveViews(const LiveViews&) = delete;
  LiveViews& operator=(const LiveViews&) = delete;

  // A snapshot was added to the history.
  void show();
  // Handles the user's keys and the passing of time. False: the user wants to end.
  bool update();
  // Nothing more will come; `failure` is empty if the session ended by itself.
  void source_ended(const std::string& failure);
  // The user may still look at what was seen last.
  bool stays_after_the_end() const noexcept;
  // Where keys come from, to poll for; -1: there are none.
  int input_descriptor() const noexcept;

 private:
  void show_text() const;
  void show_json() const;

  const LiveOptions& options_;
  const live::History& history_;
  live::Pages pages_;
  std::optional<live::LiveServer> server_;
  std::optional<live::Screen> screen_;
  live::Size size_;  // that was drawn for last
  bool is_over_ = false;
};

}  // namespace cie::cli
