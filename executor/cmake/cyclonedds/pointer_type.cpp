// What message_data.cpp needs: types and samples of one's own have these operations and no others, and a sample that
// arrives is a chain of fragments.
#include <cstddef>
#include <cstdint>

// clang-format off
#include <dds/features.h>
#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_protocol.h>
#include <dds/ddsi/q_radmin.h>
// clang-format on

#include "same.hpp"

#ifdef DDS_HAS_SHM
constexpr std::size_t kOfSharedMemory = 2;
#else
constexpr std::size_t kOfSharedMemory = 0;
#endif

int main() {
  static_assert(sizeof(ddsi_serdata_ops) == (15 + kOfSharedMemory) * sizeof(void*),
                "as many operations as were known");
  ddsi_serdata_ops data{};
  same<bool(const ddsi_serdata*, const ddsi_serdata*)>(data.eqkey);
  same<std::uint32_t(const ddsi_serdata*)>(data.get_size);
  same<ddsi_serdata*(const ddsi_sertype*, ddsi_serdata_kind, const nn_rdata*, std::size_t)>(
      data.from_ser);
  same<ddsi_serdata*(const ddsi_sertype*, ddsi_serdata_kind, ddsrt_msg_iovlen_t,
                     const ddsrt_iovec_t*, std::size_t)>(data.from_ser_iov);
  same<ddsi_serdata*(const ddsi_sertype*, const ddsi_keyhash*)>(data.from_keyhash);
  same<ddsi_serdata*(const ddsi_sertype*, ddsi_serdata_kind, const void*)>(data.from_sample);
  same<void(const ddsi_serdata*, std::size_t, std::size_t, void*)>(data.to_ser);
  same<ddsi_serdata*(const ddsi_serdata*, std::size_t, std::size_t, ddsrt_iovec_t*)>(
      data.to_ser_ref);
  same<void(ddsi_serdata*, const ddsrt_iovec_t*)>(data.to_ser_unref);
  same<bool(const ddsi_serdata*, void*, void**, void*)>(data.to_sample);
  same<ddsi_serdata*(const ddsi_serdata*)>(data.to_untyped);
  same<bool(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*)>(
      data.untyped_to_sample);
  same<void(ddsi_serdata*)>(data.free);
  same<std::size_t(const ddsi_sertype*, const ddsi_serdata*, char*, std::size_t)>(data.print);
  same<void(const ddsi_serdata*, ddsi_keyhash*, bool)>(data.get_keyhash);

  static_assert(sizeof(ddsi_sertype_ops) == 14 * sizeof(void*), "as many operations as were known");
  ddsi_sertype_ops type{};
  type.version = ddsi_sertype_v0;
  same<void(ddsi_sertype*)>(type.free);
  same<void(const ddsi_sertype*, void*, std::size_t)>(type.zero_samples);
  same<void(void**, const ddsi_sertype*, void*, std::size_t, std::size_t)>(type.realloc_samples);
  same<void(const ddsi_sertype*, void**, std::size_t, dds_free_op_t)>(type.free_samples);
  same<bool(const ddsi_sertype*, const ddsi_sertype*)>(type.equal);
  same<std::uint32_t(const ddsi_sertype*)>(type.hash);

  same<void(ddsi_serdata*, const ddsi_sertype*, ddsi_serdata_kind)>(ddsi_serdata_init);
  same<void(ddsi_sertype*, const char*, const ddsi_sertype_ops*, const ddsi_serdata_ops*, bool)>(
      ddsi_sertype_init);
  same<void(ddsi_sertype*)>(ddsi_sertype_fini);

  ddsi_sertype made_type{};
  made_type.allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  ddsi_serdata sample{};
  sample.type = &made_type;
  sample.kind = SDK_DATA;
  sample.hash = made_type.serdata_basehash;
  sample.timestamp.v = 0;
  same<nn_rdata>(nn_rdata{}.nextfrag);
  const nn_rdata fragment{};
  const unsigned char* const payload =
      NN_RMSG_PAYLOADOFF(fragment.rmsg, NN_RDATA_PAYLOAD_OFF(&fragment));
  return payload == nullptr || fragment.min == fragment.maxp1;
}
