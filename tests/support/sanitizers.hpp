// CIE_ADDRESS_SANITIZER, CIE_THREAD_SANITIZER: what this test is compiled with.
#pragma once

#include "../../tracepoints/base/sanitizers.hpp"
