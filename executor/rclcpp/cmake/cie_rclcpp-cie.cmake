# Of cie, which is no ROS package, what the exported target links.
include(CMakeFindDependencyMacro)
find_dependency(cie COMPONENTS scheduling)
