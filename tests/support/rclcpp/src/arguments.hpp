// What follows --ros-args.
#pragma once

#include <string>
#include <vector>

struct rcl_arguments_impl_t {
  struct Override {
    std::string node;  // "/**": all
    std::string name;
    std::string value;
  };
  std::vector<Override> overrides{};
};
