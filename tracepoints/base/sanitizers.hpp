// Which sanitizer a source is compiled with, whoever compiles it.
#pragma once

#ifdef __SANITIZE_ADDRESS__  // g++
#define CIE_ADDRESS_SANITIZER
#endif
#ifdef __SANITIZE_THREAD__
#define CIE_THREAD_SANITIZER
#endif
#ifdef __clang__
#if __has_feature(address_sanitizer)
#define CIE_ADDRESS_SANITIZER
#endif
#if __has_feature(thread_sanitizer)
#define CIE_THREAD_SANITIZER
#endif
#endif
