// Sorting of rows that are large: each is moved once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <numeric>
#include <utility>
#include <vector>

namespace cie::analysis {

// As std::ranges::stable_sort() does. Leaves no room for more rows than there are.
template <typename Row, typename Less = std::ranges::less, typename Projection = std::identity>
void sort_rows(std::vector<Row>& rows, Less comes_before = {}, Projection projection = {}) {
  if (std::ranges::is_sorted(rows, comes_before, projection)) {
    rows.shrink_to_fit();
    return;
  }
  std::vector<std::uint32_t> order(rows.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(order, comes_before, [&](std::uint32_t place) -> decltype(auto) {
    return std::invoke(projection, rows[place]);
  });
  std::vector<Row> sorted;
  sorted.reserve(rows.size());
  for (const auto place : order)
    sorted.push_back(std::move(rows[place]));
  rows = std::move(sorted);
}

}  // namespace cie::analysis
