#include "message_data.hpp"

#include "cdr_bytes.hpp"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <new>
#include <span>
#include <string_view>
#include <utility>

// features.h decides the layout of the structures below.
// clang-format off
#include <dds/features.h>
#include <dds/dds.h>
#include <dds/ddsi/ddsi_cdrstream.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_protocol.h>
#include <dds/ddsi/q_radmin.h>
// clang-format on

namespace cie::executor {

namespace {

struct PointerType final : ddsi_sertype {
  LayoutPtr layout;
};

// One sample. What it points to and its bytes never change once they are there.
struct MessageData final : ddsi_serdata {
  std::shared_ptr<const void> message;
  std::atomic<unsigned char*> bytes{nullptr};
  std::atomic<bool> is_refused{false};
  bool is_from_elsewhere = false;  // its bytes are
};

const MessageLayout& layout_of(const ddsi_sertype* type) noexcept {
  return *static_cast<const PointerType*>(type)->layout;
}

// Whoever comes first makes the bytes: the writing thread as a rule. Two at once make them twice.
CdrBytes bytes_of(const ddsi_serdata* sample) noexcept {
  // Cyclone asks for the bytes of a const sample; making them does not change what it is.
  auto& data = const_cast<MessageData&>(*static_cast<const MessageData*>(sample));
  if (auto* const memory = data.bytes.load(std::memory_order_acquire)) return CdrBytes{memory};
  CdrBytesPtr made;
  if (data.message != nullptr) made = cdr_of(layout_of(data.type), data.message.get());
  if (made == nullptr) {
    data.is_refused = data.message != nullptr;
    made = cdr_of_nothing();
  }
  unsigned char* expected = nullptr;
  if (data.bytes.compare_exchange_strong(expected, made.get(), std::memory_order_acq_rel)) {
    return CdrBytes{made.release()};
  }
  return CdrBytes{expected};
}

MessageData* make_data(const ddsi_sertype* type, ddsi_serdata_kind kind) noexcept {
  auto* const data = new (std::nothrow) MessageData;
  if (data == nullptr) return nullptr;
  ddsi_serdata_init(data, type, kind);
  data->hash = type->serdata_basehash;
  return data;
}

bool equal_keys(const ddsi_serdata*, const ddsi_serdata*) noexcept { return true; }  // no keys

std::uint32_t get_size(const ddsi_serdata* sample) noexcept { return bytes_of(sample).size(); }

// From what came over the network: `memory` has room as CdrBytes::complete() wants it. Nothing is
// read of it before it has been checked.
ddsi_serdata* from_bytes(const ddsi_sertype* type, ddsi_serdata_kind kind, CdrBytesPtr memory,
                         std::uint32_t size) noexcept {
  const CdrBytes bytes{memory.get()};
  std::uint16_t identifier = 0;
  std::memcpy(&identifier, bytes.encoding(), sizeof identifier);
  if (identifier != CDR_LE && identifier != CDR_BE) return nullptr;
  const bool is_foreign = !CDR_ENC_IS_NATIVE(identifier);
  std::uint32_t end = 0;
  if (kind == SDK_DATA &&
      dds_stream_normalize_data(reinterpret_cast<char*>(bytes.message()), &end,
                                size - CdrBytes::kEncoding, is_foreign, CDR_ENC_VERSION_1,
                                layout_of(type).operations().data()) == nullptr) {
    return nullptr;
  }
  MessageData* const data = make_data(type, kind);
  if (data == nullptr) return nullptr;
  data->is_from_elsewhere = kind == SDK_DATA;
  bytes.complete(end);
  data->bytes.store(memory.release(), std::memory_order_release);
  return data;
}

ddsi_serdata* from_network(const ddsi_sertype* type, ddsi_serdata_kind kind,
                           const nn_rdata* fragment, std::size_t size) noexcept {
  CdrBytesPtr memory = room_for_cdr(size);
  if (memory == nullptr) return nullptr;
  unsigned char* const target = CdrBytes{memory.get()}.encoding();
  std::uint32_t end = 0;  // of what is there; fragments may overlap, but leave no gap
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= end) continue;
    if (fragment->min > end || fragment->maxp1 > size) return nullptr;
    const unsigned char* const payload =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    std::memcpy(target + end, payload + (end - fragment->min), fragment->maxp1 - end);
    end = fragment->maxp1;
  }
  if (end != size) return nullptr;
  return from_bytes(type, kind, std::move(memory), static_cast<std::uint32_t>(size));
}

ddsi_serdata* from_parts(const ddsi_sertype* type, ddsi_serdata_kind kind, ddsrt_msg_iovlen_t count,
                         const ddsrt_iovec_t* parts, std::size_t size) noexcept {
  CdrBytesPtr memory = room_for_cdr(size);
  if (memory == nullptr) return nullptr;
  unsigned char* target = CdrBytes{memory.get()}.encoding();
  std::size_t room = size;
  for (const ddsrt_iovec_t& part : std::span{parts, count}) {
    const std::size_t copied = std::min<std::size_t>(part.iov_len, room);
    std::memcpy(target, part.iov_base, copied);
    target += copied;
    room -= copied;
  }
  if (room != 0) return nullptr;
  return from_bytes(type, kind, std::move(memory), static_cast<std::uint32_t>(size));
}

ddsi_serdata* from_key_hash(const ddsi_sertype* type, const ddsi_keyhash*) noexcept {
  return make_data(type, SDK_KEY);
}

// What dds_write() and dds_register_instance() make: the message stays the caller's.
ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind,
                          const void* sample) noexcept {
  CdrBytesPtr memory;
  if (kind == SDK_DATA) {
    memory = cdr_of(layout_of(type), sample);
    if (memory == nullptr) return nullptr;
  }
  MessageData* const data = make_data(type, kind);
  if (data != nullptr) data->bytes.store(memory.release(), std::memory_order_release);
  return data;
}

void to_ser(const ddsi_serdata* sample, std::size_t offset, std::size_t size,
            void* buffer) noexcept {
  std::memcpy(buffer, bytes_of(sample).encoding() + offset, size);
}

ddsi_serdata* to_ser_ref(const ddsi_serdata* sample, std::size_t offset, std::size_t size,
                         ddsrt_iovec_t* part) noexcept {
  part->iov_base = bytes_of(sample).encoding() + offset;
  part->iov_len = size;
  return ddsi_serdata_ref(sample);
}

void to_ser_unref(ddsi_serdata* sample, const ddsrt_iovec_t*) noexcept {
  ddsi_serdata_unref(sample);
}

bool to_sample(const ddsi_serdata* sample, void* message, void** memory, void*) noexcept {
  if (memory != nullptr) return false;  // nobody has asked for contents outside the heap yet
  if (sample->kind != SDK_DATA) return true;
  const CdrBytes bytes = bytes_of(sample);
  dds_istream_t stream;
  dds_istream_init(&stream, bytes.size() - CdrBytes::kEncoding, bytes.message(), CDR_ENC_VERSION_1);
  dds_stream_read(&stream, static_cast<char*>(message),
                  layout_of(sample->type).operations().data());
  return true;
}

ddsi_serdata* to_untyped(const ddsi_serdata* sample) noexcept {
  MessageData* const data = make_data(sample->type, SDK_KEY);
  if (data == nullptr) return nullptr;
  data->type = nullptr;
  data->timestamp.v = std::numeric_limits<std::int64_t>::min();
  return data;
}

bool untyped_to_sample(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) noexcept {
  return true;  // there is no key to fill in
}

void free_data(ddsi_serdata* sample) noexcept {
  const std::unique_ptr<MessageData> data{static_cast<MessageData*>(sample)};
  dds_free(data->bytes.load(std::memory_order_acquire));
}

std::size_t print(const ddsi_sertype* type, const ddsi_serdata*, char* text,
                  std::size_t size) noexcept {
  const int length = std::snprintf(text, size, "(%s)", type == nullptr ? "" : type->type_name);
  return length < 0 ? 0 : static_cast<std::size_t>(length);
}

void get_key_hash(const ddsi_serdata*, ddsi_keyhash* hash, bool) noexcept {
  std::ranges::fill(hash->value, static_cast<unsigned char>(0));
}

constexpr ddsi_serdata_ops kDataOperations{
    .eqkey = equal_keys,
    .get_size = get_size,
    .from_ser = from_network,
    .from_ser_iov = from_parts,
    .from_keyhash = from_key_hash,
    .from_sample = from_sample,
    .to_ser = to_ser,
    .to_ser_ref = to_ser_ref,
    .to_ser_unref = to_ser_unref,
    .to_sample = to_sample,
    .to_untyped = to_untyped,
    .untyped_to_sample = untyped_to_sample,
    .free = free_data,
    .print = print,
    .get_keyhash = get_key_hash,
#ifdef DDS_HAS_SHM
    // A Context with shared memory uses Cyclone's own serialisation.
    .get_sample_size = nullptr,
    .from_iox_buffer = nullptr,
#endif
};

void free_type(ddsi_sertype* type) noexcept {
  const std::unique_ptr<PointerType> owned{static_cast<PointerType*>(type)};
  ddsi_sertype_fini(type);
}

void zero_samples(const ddsi_sertype* type, void* samples, std::size_t count) noexcept {
  std::memset(samples, 0, layout_of(type).size() * count);
}

void realloc_samples(void** pointers, const ddsi_sertype* type, void* old, std::size_t old_count,
                     std::size_t count) noexcept {
  const std::size_t size = layout_of(type).size();
  auto* const memory = static_cast<char*>(dds_realloc(old, size * count));
  if (count > old_count) std::memset(memory + size * old_count, 0, size * (count - old_count));
  for (std::size_t i = 0; i < count; ++i)
    pointers[i] = memory + size * i;
}

void free_samples(const ddsi_sertype* type, void** pointers, std::size_t count,
                  dds_free_op_t what) noexcept {
  if (count == 0) return;
  for (std::size_t i = 0; i < count; ++i)
    dds_stream_free_sample(pointers[i], layout_of(type).operations().data());
  if ((what & DDS_FREE_ALL_BIT) != 0) dds_free(pointers[0]);
}

// Cyclone has compared name and operations already.
bool equal_types(const ddsi_sertype* a, const ddsi_sertype* b) noexcept {
  return layout_of(a).size() == layout_of(b).size() &&
         layout_of(a).operations() == layout_of(b).operations();
}

std::uint32_t hash_type(const ddsi_sertype* type) noexcept {
  const auto& operations = layout_of(type).operations();
  const std::string_view text{reinterpret_cast<const char*>(operations.data()),
                              operations.size() * sizeof operations[0]};
  return static_cast<std::uint32_t>(std::hash<std::string_view>{}(text));
}

constexpr ddsi_sertype_ops kTypeOperations{
    .version = ddsi_sertype_v0,
    .arg = nullptr,
    .free = free_type,
    .zero_samples = zero_samples,
    .realloc_samples = realloc_samples,
    .free_samples = free_samples,
    .equal = equal_types,
    .hash = hash_type,
    // Without type information types are the same when their names are, as in ROS 2.
    .type_id = nullptr,
    .type_map = nullptr,
    .type_info = nullptr,
    .derive_sertype = nullptr,
    .get_serialized_size = nullptr,
    .serialize_into = nullptr,
};

}  // namespace

ddsi_sertype* make_pointer_type(LayoutPtr layout) {
  if (!layout->is_plain()) return nullptr;
  auto type = std::make_unique<PointerType>();
  ddsi_sertype_init(type.get(), layout->type_name().c_str(), &kTypeOperations, &kDataOperations,
                    true);
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  type->layout = std::move(layout);
  return type.release();
}

ddsi_serdata* make_message_data(const ddsi_sertype& type,
                                std::shared_ptr<const void> message) noexcept {
  MessageData* const data = make_data(&type, SDK_DATA);
  if (data == nullptr) return nullptr;
  data->message = std::move(message);
  return data;
}

std::shared_ptr<const void> message_of(const ddsi_serdata& sample) noexcept {
  if (sample.ops != &kDataOperations) return nullptr;
  return static_cast<const MessageData&>(sample).message;
}

bool is_refused(const ddsi_serdata& sample) noexcept {
  return static_cast<const MessageData&>(sample).is_refused;
}

bool is_unreadable(const ddsi_serdata& sample) noexcept {
  return sample.ops == &kDataOperations &&
         static_cast<const MessageData&>(sample).is_from_elsewhere &&
         layout_of(sample.type).texts().have_inner_zero(bytes_of(&sample).message());
}

}  // namespace cie::executor
