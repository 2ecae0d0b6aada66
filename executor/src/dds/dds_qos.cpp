#include "dds_qos.hpp"

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

namespace cie::executor::dds {
namespace {

dds_duration_t to_dds(std::optional<std::chrono::nanoseconds> duration, std::string_view what,
                      std::string_view object) {
  if (!duration) return DDS_INFINITY;
  if (duration->count() <= 0) {
    throw std::logic_error{
        fmt::format("the {} in the QoS of \"{}\" cannot be {} ns: write more, "
                    "or none for an unlimited one",
                    what, object, duration->count())};
  }
  return duration->count();
}

}  // namespace

QosPtr to_dds(const QoS& qos, std::string_view object, std::string_view user_data) {
  const bool keeps_all = qos.history() == History::keep_all;
  if (!keeps_all &&
      (qos.depth() == 0 || qos.depth() > std::uint32_t{std::numeric_limits<std::int32_t>::max()})) {
    throw std::logic_error{
        fmt::format("the queue of \"{}\" cannot be {} deep: use KeepLast{{1}} or more, or KeepAll",
                    object, qos.depth())};
  }
  const auto depth = keeps_all ? 0 : static_cast<std::int32_t>(qos.depth());
  const auto history = keeps_all ? DDS_HISTORY_KEEP_ALL : DDS_HISTORY_KEEP_LAST;
  QosPtr result{dds_create_qos()};
  dds_qset_history(result.get(), history, depth);
  dds_qset_reliability(result.get(),
                       qos.reliability() == Reliability::reliable ? DDS_RELIABILITY_RELIABLE
                                                                  : DDS_RELIABILITY_BEST_EFFORT,
                       to_dds(qos.max_blocking_time(), "blocking time", object));
  dds_qset_deadline(result.get(), to_dds(qos.deadline(), "deadline", object));
  dds_qset_lifespan(result.get(), to_dds(qos.lifespan(), "lifespan", object));
  dds_qset_liveliness(result.get(),
                      qos.liveliness() == Liveliness::automatic ? DDS_LIVELINESS_AUTOMATIC
                                                                : DDS_LIVELINESS_MANUAL_BY_TOPIC,
                      to_dds(qos.liveliness_lease_duration(), "lease duration", object));
  dds_qset_writer_data_lifecycle(result.get(), false);
  if (qos.durability() == Durability::transient_local) {
    dds_qset_durability(result.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
    dds_qset_durability_service(result.get(), 0, history, depth, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  } else {
    dds_qset_durability(result.get(), DDS_DURABILITY_VOLATILE);
  }
  if (!user_data.empty()) dds_qset_userdata(result.get(), user_data.data(), user_data.size());
  return result;
}

}  // namespace cie::executor::dds
