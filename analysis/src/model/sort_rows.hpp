// Sorting of rows that are large: each is moved once.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace cie::analysis {

// Stable. Leaves no room for more rows than there are.
template <typename Row, typename Less>
void sort_rows(std::vector<Row>& rows, const Less& comes_before) {
  std::vector<std::uint32_t> order(rows.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::stable_sort(
      order, [&](std::uint32_t a, std::uint32_t b) { return comes_before(rows[a], rows[b]); });
  std::vector<Row> sorted;
  sorted.reserve(rows.size());
  for (const auto place : order)
    sorted.push_back(std::move(rows[place]));
  rows = std::move(sorted);
}

}  // namespace cie::analysis
