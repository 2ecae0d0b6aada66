#pragma once

#include <cstddef>

using rcl_event_callback_t = void (*)(const void* user_data, std::size_t count);
