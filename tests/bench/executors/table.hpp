// What the experiment shows: a table while it runs, a file of all numbers, and how the isolated
// executor stands to the others.
#pragma once

#include "measurement.hpp"

#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

namespace bench {

struct Row {
  Workload workload;
  Measurement measured;
};

void print_head();
void print(const Row& row);

// Rows as comma-separated values, one by one, so that nothing is lost when the run is cut short.
class CsvFile {
 public:
  // Throws std::runtime_error when the file cannot be written.
  explicit CsvFile(const std::string& path);
  void write(const Row& row);

 private:
  std::ofstream file_;
};

// System calls and context switches of `isolated` as multiples of the others', for each number of
// pairs. Nothing where `isolated` was not measured.
void print_ratios(const std::vector<Row>& rows);

}  // namespace bench
