#include "loss_gaps.hpp"

#include <algorithm>

namespace cie::analysis {

EventKinds kinds_of(Domain domain) noexcept {
  return domain == Domain::kernel ? kKernelKinds : kUserKinds;
}

const Gap* user_gap(const Model& model, HostIndex host, Timestamp begin, Timestamp end,
                    EventKinds kinds) {
  const Hidden any{.kinds = kinds, .scope = {.host = host}, .window = {.from = begin, .to = end}};
  return model.gaps.gap(any);
}

Gap edge_of(const Model& model, StreamIndex index, TimeWindow window) {
  const auto& stream = model.streams[at(index)];
  return {.scope = {.host = stream.host},
          .kinds = kinds_of(stream.domain),
          .window = window,
          .at_most = {},
          .reason = {.cause = GapCause::stream_edge,
                     .at = stream.begin.value_or(window.from),
                     .about = static_cast<std::uint32_t>(index)}};
}

Gap gap_of(const Loss& loss, std::size_t place) {
  const bool is_counted = loss.kind == LossKind::discarded_events;
  return {
      .scope = {.host = loss.host, .cpu = loss.cpu},
      .kinds = kinds_of(loss.domain),
      .window = {.from = loss.begin, .to = std::max(loss.begin, loss.end)},
      .at_most = is_counted ? loss.count : std::nullopt,
      .reason = {
          .cause = GapCause::loss, .at = loss.begin, .about = static_cast<std::uint32_t>(place)}};
}

Gap gap_before(const Loss& loss, std::size_t place) {
  auto gap = gap_of(loss, place);
  gap.kinds = gap.kinds & kStateKinds;
  gap.reason.cause = GapCause::window;
  return gap;
}

}  // namespace cie::analysis
