// A /proc and a /sys of a test's own.
#pragma once

#include <cie/scheduling/kernel_view.hpp>

#include "support/temporary_directory.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

namespace cie::scheduling {

class KernelTree : public testing::Test {
 public:
  KernelTree(const KernelTree&) = delete;
  KernelTree& operator=(const KernelTree&) = delete;

 protected:
  KernelTree() = default;
  void write(const std::string& file, const std::string& text) const {
    create_directories((directory_.path() / file).parent_path());
    std::ofstream{directory_.path() / file} << text;
  }
  const KernelView& kernel() const { return kernel_; }

 private:
  test::TemporaryDirectory directory_;
  KernelView kernel_{directory_.path()};
};

}  // namespace cie::scheduling
