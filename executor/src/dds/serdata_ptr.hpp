// Ownership of one reference to a sample of Cyclone DDS.
#pragma once

#include <memory>

// features.h decides the layout of the structures of the other.
// clang-format off
#include <dds/features.h>
#include <dds/ddsi/ddsi_serdata.h>
// clang-format on

namespace cie::executor {

struct UnrefSerdata {
  void operator()(ddsi_serdata* data) const noexcept { ddsi_serdata_unref(data); }
};
using SerdataPtr = std::unique_ptr<ddsi_serdata, UnrefSerdata>;

}  // namespace cie::executor
