#pragma once

#include <cstddef>
#include <cstdint>

struct rcl_variant_t {
  bool* bool_value;
  std::int64_t* integer_value;
  double* double_value;
  char* string_value;
};
struct rcl_node_params_t {
  char** parameter_names;
  rcl_variant_t* parameter_values;
  std::size_t num_params;
};
struct rcl_params_t {
  char** node_names;
  rcl_node_params_t* params;
  std::size_t num_nodes;
};

void rcl_yaml_node_struct_fini(rcl_params_t* parameters);
