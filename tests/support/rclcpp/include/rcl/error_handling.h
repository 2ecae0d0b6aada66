#pragma once

inline void rcl_reset_error() {}
