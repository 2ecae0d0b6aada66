#pragma once

#include <rcl/types.h>
#include <rcl_yaml_param_parser/parser.h>

// Null in `overrides`: there are none. The caller gives them back to rcl_yaml_node_struct_fini().
rcl_ret_t rcl_arguments_get_param_overrides(const rcl_arguments_t* arguments,
                                            rcl_params_t** overrides);
