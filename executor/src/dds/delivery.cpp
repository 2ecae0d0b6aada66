#include "delivery.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

// features.h decides the layout of the structures below.
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

#include <cie/scheduling/clock.hpp>

#include "scheduling_names.hpp"
#include "shared_memory.hpp"

// Exported by libddsc 0.10, declared in none of its installed headers.
extern "C" dds_rhc* dds_rhc_default_new(dds_reader* reader, const ddsi_sertype* type);

namespace cie::executor {

void Delivery::set_target(ReadySink* sink, Callback* callback) {
  const std::lock_guard lock{mutex_};
  sink_ = sink;
  callback_ = callback;
}

void Delivery::set_wakeup(Wakeup* wakeup) {
  const std::lock_guard lock{mutex_};
  wakeup_ = wakeup;
}

void Delivery::set_trace(trace::Callback* callback) {
  const std::lock_guard lock{mutex_};
  trace_ = callback;
  if (trace_ == nullptr) return;
  // Nobody took any meanwhile: the latest ones overwrote.
  const std::uint64_t overwritten = count_.overwritten();
  for (auto left = std::exchange(untold_releases_, 0); left-- > 0;)
    trace_->release(overwritten - std::min(overwritten, left));
  if (const auto lost = std::exchange(untold_losses_, 0); lost > 0) trace_->sample_lost(lost);
}

void Delivery::close() {
  const std::lock_guard lock{mutex_};
  is_closed_ = true;
}

void Delivery::wake() noexcept {
  const std::lock_guard lock{mutex_};
  if (sink_ != nullptr) sink_->on_ready(*callback_);
  if (wakeup_ != nullptr) wakeup_->notify();
}

void Delivery::announce() noexcept {
  const std::uint64_t overwritten = count_.on_stored();
  if (trace_ != nullptr) {
    trace_->release(overwritten);
  } else {
    ++untold_releases_;
  }
  if (sink_ != nullptr) sink_->on_ready(*callback_);
  if (wakeup_ != nullptr) wakeup_->notify();
}

void Delivery::lost(std::uint32_t count) noexcept {
  {
    const std::lock_guard lock{mutex_};
    if (is_closed_) return;
    if (trace_ != nullptr) {
      trace_->sample_lost(count);
    } else {
      untold_losses_ += count;
    }
  }
  if (tell_lost_) tell_lost_(count);
}

void Delivery::unreadable() noexcept {
  lost(1);
  if (tell_unreadable_ && !is_unreadable_told_.test_and_set()) tell_unreadable_();
}

std::uint64_t writer_gid(const unsigned char (&guid)[16]) noexcept {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
  std::memcpy(&high, guid, sizeof high);
  std::memcpy(&low, guid + sizeof high, sizeof low);
  // The finalizer of splitmix64 over both halves: one-to-one in each of them.
  std::uint64_t mixed = high ^ (low * 0x9e3779b97f4a7c15U);
  mixed = (mixed ^ (mixed >> 30U)) * 0xbf58476d1ce4e5b9U;
  mixed = (mixed ^ (mixed >> 27U)) * 0x94d049bb133111ebU;
  mixed ^= mixed >> 31U;
  return mixed == 0 ? 1 : mixed;
}

namespace {

// `base` is what Cyclone sees.
struct RecordingCache {
  dds_rhc base;
  dds_rhc* inner = nullptr;  // owned; null until associated
  std::shared_ptr<Delivery> delivery;
  ChunkGaps gaps{};  // of the one thread on which iceoryx hands chunks over
};

RecordingCache& self(void* cache) noexcept { return *static_cast<RecordingCache*>(cache); }
dds_rhc* inner(void* cache) noexcept { return self(cache).inner; }

// A GUID as dds_get_guid() writes it: prefix and entity id in network byte order.
std::uint64_t gid_of(const ddsi_guid_t& guid) noexcept {
  const ddsi_guid_t wire = nn_hton_guid(guid);
  unsigned char bytes[16];
  static_assert(sizeof wire == sizeof bytes);
  std::memcpy(bytes, &wire, sizeof bytes);
  return writer_gid(bytes);
}

// A service's header stands behind the four bytes that say how the sample is encoded. Every sample
// of such a type is long enough, and in this machine's byte order: Cyclone has checked it.
bool is_for(std::uint64_t recipient, const ddsi_serdata* sample) noexcept {
  constexpr std::size_t kEncoding = 4;
  std::uint64_t guid = 0;
  if (const void* const chunk = in_shared_memory(sample)) {  // with no encoding before it
    std::memcpy(&guid, chunk, sizeof guid);
  } else {
    ddsi_serdata_to_ser(sample, kEncoding, sizeof guid, &guid);
  }
  return guid == recipient;
}

// Samples that were dropped in shared memory since the last one.
void count_dropped(RecordingCache& cache, const void* chunk) {
  const auto number = number_of_chunk(chunk);
  const auto dropped = number ? cache.gaps.before(*number) : 0;
  if (dropped > 0) cache.delivery->lost(static_cast<std::uint32_t>(dropped));
}

bool store(ddsi_rhc* cache, const ddsi_writer_info* writer, ddsi_serdata* sample,
           ddsi_tkmap_instance* instance) noexcept {
  const auto pass_on = [=] { return dds_rhc_store(inner(cache), writer, sample, instance); };
  if (const void* const chunk = in_shared_memory(sample)) count_dropped(self(cache), chunk);
  if (sample->kind != SDK_DATA) return pass_on();  // a writer or an instance that ends
  const auto recipient = self(cache).delivery->recipient();
  if (recipient && !is_for(*recipient, sample)) return true;
  const Arrival arrival{.time_ns = monotonic_now(), .writer_gid = gid_of(writer->guid)};
  return self(cache).delivery->deliver(sample, arrival, pass_on);
}

void unregister_writer(ddsi_rhc* cache, const ddsi_writer_info* writer) noexcept {
  dds_rhc_unregister_wr(inner(cache), writer);
}

void relinquish_ownership(ddsi_rhc* cache, std::uint64_t writer) noexcept {
  dds_rhc_relinquish_ownership(inner(cache), writer);
}

void set_qos(ddsi_rhc* cache, const dds_qos* qos) noexcept { dds_rhc_set_qos(inner(cache), qos); }

void free_cache(ddsi_rhc* cache) noexcept {
  const std::unique_ptr<RecordingCache> owned{&self(cache)};
  if (owned->inner != nullptr) dds_rhc_free(owned->inner);
}

std::int32_t read(dds_rhc* cache, bool lock, void** values, dds_sample_info_t* infos,
                  std::uint32_t most, std::uint32_t mask, dds_instance_handle_t instance,
                  dds_readcond* condition) noexcept {
  return dds_rhc_read(inner(cache), lock, values, infos, most, mask, instance, condition);
}

std::int32_t take(dds_rhc* cache, bool lock, void** values, dds_sample_info_t* infos,
                  std::uint32_t most, std::uint32_t mask, dds_instance_handle_t instance,
                  dds_readcond* condition) noexcept {
  return dds_rhc_take(inner(cache), lock, values, infos, most, mask, instance, condition);
}

std::int32_t read_cdr(dds_rhc* cache, bool lock, ddsi_serdata** values, dds_sample_info_t* infos,
                      std::uint32_t most, std::uint32_t samples, std::uint32_t views,
                      std::uint32_t instances, dds_instance_handle_t instance) noexcept {
  return dds_rhc_readcdr(inner(cache), lock, values, infos, most, samples, views, instances,
                         instance);
}

std::int32_t take_cdr(dds_rhc* cache, bool lock, ddsi_serdata** values, dds_sample_info_t* infos,
                      std::uint32_t most, std::uint32_t samples, std::uint32_t views,
                      std::uint32_t instances, dds_instance_handle_t instance) noexcept {
  return dds_rhc_takecdr(inner(cache), lock, values, infos, most, samples, views, instances,
                         instance);
}

bool add_read_condition(dds_rhc* cache, dds_readcond* condition) noexcept {
  return dds_rhc_add_readcondition(inner(cache), condition);
}

void remove_read_condition(dds_rhc* cache, dds_readcond* condition) noexcept {
  dds_rhc_remove_readcondition(inner(cache), condition);
}

std::uint32_t lock_samples(dds_rhc* cache) noexcept { return dds_rhc_lock_samples(inner(cache)); }

dds_return_t associate(dds_rhc* cache, dds_reader* reader, const ddsi_sertype* type,
                       ddsi_tkmap* instances) noexcept {
  self(cache).inner = dds_rhc_default_new(reader, type);
  return dds_rhc_associate(inner(cache), reader, type, instances);
}

constexpr dds_rhc_ops kOperations{
    .rhc_ops = {.store = store,
                .unregister_wr = unregister_writer,
                .relinquish_ownership = relinquish_ownership,
                .set_qos = set_qos,
                .free = free_cache},
    .read = read,
    .take = take,
    .readcdr = read_cdr,
    .takecdr = take_cdr,
    .add_readcondition = add_read_condition,
    .remove_readcondition = remove_read_condition,
    .lock_samples = lock_samples,
    .associate = associate,
};

}  // namespace

dds_rhc* make_recording_cache(std::shared_ptr<Delivery> delivery) {
  auto cache = std::make_unique<RecordingCache>();
  cache->base.common.ops = &kOperations;
  cache->delivery = std::move(delivery);
  return &cache.release()->base;
}

}  // namespace cie::executor
