// Says that it was built for an interface of the future.
#include <cie/executor/component.hpp>

namespace {
constexpr cie::ComponentLibrary kLibrary{
    .abi = cie::kComponentAbi + 1, .count = 0, .classes = nullptr};
}

extern "C" const cie::ComponentLibrary* cie_component_library() { return &kLibrary; }
