#include "ros2_profile.hpp"

#include <cie/tracepoints/ros2_profile.hpp>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

#include <dlfcn.h>

namespace cie::trace {

std::atomic<const Ros2Profile*> detail::ros2_profile{nullptr};

#ifdef CIE_WITH_LTTNG

namespace {

// What a library with LTTng's provider `ros2` defines; ROS 2's own does.
constexpr const char* kProviderOfRos2 = "lttng_ust_tracepoint_provider_ros2";

[[noreturn]] void refuse(const std::string& why) {
  throw std::runtime_error(std::string(kProfileVariable) + '=' + std::string(kRos2Profile) + ": " +
                           why);
}

// Beside this library, wherever it was installed.
std::string path_of_library() {
  Dl_info self{};
  if (dladdr(&detail::ros2_profile, &self) == 0 || self.dli_fname == nullptr) {
    return CIE_ROS2_PROFILE_LIBRARY;
  }
  return std::filesystem::path(self.dli_fname).replace_filename(CIE_ROS2_PROFILE_LIBRARY).string();
}

}  // namespace

void load_profile() {
  const char* const wanted = secure_getenv(kProfileVariable);
  if (wanted == nullptr || *wanted == '\0' || ros2_profile() != nullptr) {
    return;
  }
  if (wanted != kRos2Profile) {
    throw std::runtime_error(std::string(kProfileVariable) + '=' + wanted +
                             ": there is no such profile; there is \"" + std::string(kRos2Profile) +
                             '"');
  }
  // LTTng tells tracepoints apart by name: of two of one name only one would be recorded, or both
  // for each call.
  if (dlsym(RTLD_DEFAULT, kProviderOfRos2) != nullptr) {
    refuse("this process has ROS 2's own tracepoints already; run it without the profile");
  }
  const std::string path = path_of_library();
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (library == nullptr) {
    refuse(dlerror());
  }
  const void* const profile = dlsym(library, kRos2ProfileSymbol);
  if (profile == nullptr) {
    refuse("\"" + path + "\" is not this version's");
  }
  detail::ros2_profile.store(static_cast<const Ros2Profile*>(profile), std::memory_order_release);
}

#else

void load_profile() {}

#endif

}  // namespace cie::trace
