// Values of parameters that the command line gives, over those of the application's file.
#pragma once

#include "app_file.hpp"

#include <filesystem>
#include <string>

namespace cie::container {

// "/demo/talker:period_ms:=50". Throws std::invalid_argument if it is not of this form, or if no
// component of the application is called so.
void override_parameter(AppFile& app, const std::string& assignment);

// A file as ROS 2 has them: "/demo/talker: {ros__parameters: {period_ms: 50}}". Nodes that are not
// in the application are passed over. Throws SpecError.
void override_parameters(AppFile& app, const std::filesystem::path& file);

}  // namespace cie::container
