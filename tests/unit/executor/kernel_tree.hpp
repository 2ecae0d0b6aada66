// A /proc and a /sys of a test's own.
#pragma once

#include "kernel_view.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

namespace cie::executor {

class KernelTree : public testing::Test {
 public:
  KernelTree(const KernelTree&) = delete;
  KernelTree& operator=(const KernelTree&) = delete;

 protected:
  KernelTree() {
    std::string name = testing::TempDir() + "cie-kernel-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error{"no temporary folder"};
    root_ = name;
    kernel_ = KernelView{root_};
  }
  ~KernelTree() override {
    std::error_code error;
    remove_all(root_, error);
  }
  void write(const std::string& file, const std::string& text) const {
    create_directories((root_ / file).parent_path());
    std::ofstream{root_ / file} << text;
  }
  const KernelView& kernel() const { return kernel_; }

 private:
  std::filesystem::path root_;
  KernelView kernel_;
};

}  // namespace cie::executor
