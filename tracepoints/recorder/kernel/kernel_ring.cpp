#include "kernel/kernel_ring.hpp"

#include "kernel/kernel_events.hpp"
#include "kernel/kernel_record.h"

#include <algorithm>
#include <cstring>

namespace cie::record {
namespace {

// What is forgotten at once.
constexpr std::size_t kBlockSize = 64 << 10;

}  // namespace

KernelRing::KernelRing(std::chrono::nanoseconds length, std::size_t most_bytes, std::uint64_t begin)
    : length_(length), most_bytes_(most_bytes), begin_(begin) {}

void KernelRing::on_event(std::uint64_t time, std::string_view event) {
  if (blocks_.back().events.size() + event.size() > kBlockSize) {
    blocks_.push_back({.lost = blocks_.back().lost, .loss_time = 0, .end = time, .events = {}});
    trim(time);
  }
  Block& block = blocks_.back();
  block.events += event;
  block.end = time;
  bytes_ += event.size();
}

void KernelRing::on_loss(std::uint64_t time, std::uint64_t total) {
  blocks_.push_back({.lost = total, .loss_time = time, .end = time, .events = {}});
  trim(time);
}

void KernelRing::trim(std::uint64_t now) {
  const auto length = static_cast<std::uint64_t>(length_.count());
  while (blocks_.size() > 1 && (blocks_.front().end + length < now || bytes_ > most_bytes_)) {
    const Block& oldest = blocks_.front();
    begin_ = std::max(begin_, oldest.end);
    lost_before_ = oldest.lost;
    bytes_ -= oldest.events.size();
    blocks_.pop_front();
  }
}

void KernelRing::replay(KernelEventSink& sink) const {
  for (const Block& block : blocks_) {
    if (block.loss_time != 0) sink.on_loss(block.loss_time, block.lost - lost_before_);
    std::string_view rest = block.events;
    while (!rest.empty()) {
      cie_event_header header{};
      std::memcpy(&header, rest.data(), sizeof header);
      const std::size_t size = recorded_size(kernel_event_classes()[header.id]);
      sink.on_event(header.time, rest.substr(0, size));
      rest.remove_prefix(size);
    }
  }
}

std::uint64_t KernelRing::lost_since_begin(std::uint64_t total) const noexcept {
  return total - std::min(total, lost_before_);
}

}  // namespace cie::record
