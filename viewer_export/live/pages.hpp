// The pages of the full-screen view and what keys do there; knows no terminal.
#pragma once

#include "choice.hpp"
#include "frame.hpp"
#include "history.hpp"
#include "names.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace cie::live {

enum class Key : std::uint8_t {
  up,
  down,
  page_up,
  page_down,
  home,
  end,
  enter,
  back,  // Escape, or backspace outside a filter
  backspace,
  character  // see Pages::press()
};

struct Size {
  std::size_t rows = 24;
  std::size_t columns = 80;
  friend bool operator==(const Size&, const Size&) = default;
};

// A column of the callbacks' table.
struct NumberColumn {
  enum class Group : std::uint8_t { none, window, total };
  std::string_view title;
  std::optional<SortKey> key;  // empty: nobody sorts by it
  std::size_t width = 0;
  int rank = 0;  // 1 is needed most
  Group group{};
  std::function<Span(const CallbackView&)> cell;
};

class Pages {
 public:
  // `history` is borrowed.
  // `style`: of names.
  Pages(const History& history, SortKey sort, std::string filter,
        const viewer_export::TextStyle& style = {});

  // `character` counts for Key::character alone. False: the user wants to end.
  bool press(Key key, char character = '\0');
  // Shown where there is nothing more urgent.
  void set_note(const std::string& note);
  // The source is gone; `failure` is empty if the session ended by itself.
  void source_ended(const std::string& failure);

  Frame draw(Size size);

 private:
  enum class Page : std::uint8_t { callbacks, instances, threads, verdicts, help };
  // A table: the titles and as many rows of it as fit around the selected one.
  struct Table {
    std::optional<Line> group{};  // above the titles
    Line title;
    std::vector<Line> rows;
  };

  const History& shown() const { return paused_ ? *paused_ : history_; }
  bool press_in_filter(Key key, char character);
  bool press_letter(char letter);
  void move(std::ptrdiff_t distance);
  void open(Page page);
  void enter();
  const CallbackView* opened() const;
  Names names() const { return {shown().latest(), style_}; }
  Line status() const;
  Line keys() const;
  Line selected_name() const;
  std::vector<NumberColumn> number_columns(std::size_t columns) const;
  Table callbacks(std::size_t columns);
  Table instances(std::size_t columns) const;
  Table threads(std::size_t columns) const;
  Table verdicts(std::size_t columns) const;
  static Table help();
  Table page(std::size_t columns);

  const History& history_;
  std::optional<History> paused_;
  Page page_ = Page::callbacks;
  SortKey sort_;
  std::string filter_;
  viewer_export::TextStyle style_;
  bool is_filtering_ = false;
  bool is_over_ = false;
  std::string failure_;
  std::string note_;
  std::size_t selected_ = 0;
  std::size_t rows_ = 0;                   // of the table, when it was drawn last
  std::size_t visible_ = 1;                // of them
  std::optional<std::uint32_t> callback_;  // whose instances are shown
  std::vector<std::uint32_t> order_;       // of the callbacks drawn last
};

}  // namespace cie::live
