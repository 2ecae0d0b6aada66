#include "evidence_places.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <vector>

namespace cie::analysis {
namespace {

void locate(const Model& model, std::vector<Evidence>& evidence) {
  for (auto& item : evidence) {
    if (!item.stream || *item.stream >= model.streams.size()) continue;
    const auto& stream = model.streams[*item.stream];
    item.file = stream.path;
    if (!item.time) continue;
    const auto& begins = stream.packet_begins;
    const auto next = std::ranges::upper_bound(begins, *item.time);
    if (next == begins.begin() || stream.packets != begins.size()) continue;
    auto packet = static_cast<std::uint64_t>(next - begins.begin() - 1);
    const auto& later = stream.later_files;
    const auto file = std::ranges::upper_bound(later, packet, {}, &StreamFacts::File::first_packet);
    if (file != later.begin()) {
      item.file = std::prev(file)->path;
      packet -= std::prev(file)->first_packet;
    }
    item.packet = packet;
  }
}

}  // namespace

void locate_evidence(const Model& model, VerdictReport& verdicts) {
  for (auto& rule : verdicts.rules) {
    for (auto& subject : rule.subjects)
      locate(model, subject.evidence);
  }
}

}  // namespace cie::analysis
