// What delivery.cpp needs: a reader's sample cache has these operations and no others, and Cyclone's own can be made.
#include <cstdint>

// clang-format off
#include <dds/features.h>
#include <dds/dds.h>
#include <dds/ddsc/dds_rhc.h>
#include <dds/ddsi/ddsi_rhc.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_bswap.h>
#include <dds/ddsi/q_protocol.h>
// clang-format on

#include "same.hpp"

extern "C" dds_rhc* dds_rhc_default_new(dds_reader* reader, const ddsi_sertype* type);

using ReadOrTake = std::int32_t(dds_rhc*, bool, void**, dds_sample_info_t*, std::uint32_t,
                                std::uint32_t, dds_instance_handle_t, dds_readcond*);
using ReadOrTakeCdr = std::int32_t(dds_rhc*, bool, ddsi_serdata**, dds_sample_info_t*,
                                   std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t,
                                   dds_instance_handle_t);

int main() {
  static_assert(sizeof(dds_rhc_ops) == 13 * sizeof(void*), "as many operations as were known");
  const dds_rhc_ops cache{};
  same<bool(ddsi_rhc*, const ddsi_writer_info*, ddsi_serdata*, ddsi_tkmap_instance*)>(
      cache.rhc_ops.store);
  same<void(ddsi_rhc*, const ddsi_writer_info*)>(cache.rhc_ops.unregister_wr);
  same<void(ddsi_rhc*, std::uint64_t)>(cache.rhc_ops.relinquish_ownership);
  same<void(ddsi_rhc*, const dds_qos*)>(cache.rhc_ops.set_qos);
  same<void(ddsi_rhc*)>(cache.rhc_ops.free);
  same<ReadOrTake>(cache.read);
  same<ReadOrTake>(cache.take);
  same<ReadOrTakeCdr>(cache.readcdr);
  same<ReadOrTakeCdr>(cache.takecdr);
  same<bool(dds_rhc*, dds_readcond*)>(cache.add_readcondition);
  same<void(dds_rhc*, dds_readcond*)>(cache.remove_readcondition);
  same<std::uint32_t(dds_rhc*)>(cache.lock_samples);
  same<dds_return_t(dds_rhc*, dds_reader*, const ddsi_sertype*, ddsi_tkmap*)>(cache.associate);

  const dds_rhc made{.common = {.ops = &cache}};
  const ddsi_writer_info writer{};
  const ddsi_guid_t guid = nn_hton_guid(writer.guid);
  static_assert(sizeof guid == 16);
  return made.common.ops == nullptr || dds_rhc_default_new(nullptr, nullptr) == nullptr ||
         ddsi_sertype_get_native_enc_identifier(CDR_ENC_VERSION_1, CDR_ENC_FORMAT_PLAIN) == 0;
}
