#include <cie/tracepoints/logical_id.hpp>
#include <cie/tracepoints/scheduling_spec.hpp>
#include <cie/tracepoints/sha256.hpp>

#include "base/yaml_document.hpp"
#include "spec_reader.hpp"

#include <charconv>

namespace cie {
namespace {

// "tick" and "100000000" of "/node@Timer(tick)" and of "/node@Timer(100000000)"; empty for others.
std::string_view name_or_period(std::string_view logical_id) noexcept {
  const auto id = LogicalId::parse(logical_id);
  const bool is_timer = id && id->kind == "Timer" && id->number.empty();
  return is_timer ? id->what : std::string_view{};
}

bool is_all_digits(std::string_view text) noexcept {
  return text.find_first_not_of("0123456789") == std::string_view::npos;
}

}  // namespace

bool SpecEntry::is_wildcard() const noexcept { return id.ends_with(kWildcard); }

std::string_view SpecEntry::node() const noexcept {
  const std::string_view text = id;
  return is_wildcard() ? text.substr(0, text.size() - kWildcard.size()) : LogicalId::node_of(text);
}

SchedulingSpec SchedulingSpec::parse(std::string_view text, std::string_view name,
                                     std::optional<std::uint32_t> domain) {
  const auto document = yaml::parse(text, name, "callback_groups: []");
  auto sections = read_spec(yaml::Value(*document, name), domain);
  SchedulingSpec spec;
  spec.name_ = name;
  spec.sha256_ = sha256_hex(text);
  spec.callbacks_ = std::move(sections.callbacks);
  spec.threads_ = std::move(sections.threads);
  spec.chains_ = std::move(sections.chains);
  spec.hardware_info_ = std::move(sections.hardware_info);
  spec.not_applied_ = std::move(sections.not_applied);
  spec.hardware_info_lines_ = std::move(sections.hardware_info_lines);
  for (std::size_t i = 0; i < spec.callbacks_.size(); ++i) {
    const SpecEntry& entry = spec.callbacks_[i];
    if (entry.is_wildcard()) {
      spec.nodes_.emplace(entry.node(), i);
    } else {
      spec.callback_index_.emplace(entry.id, i);
      const auto digits = name_or_period(entry.id);
      std::uint64_t period = 0;
      if (!digits.empty() && is_all_digits(digits) &&
          std::from_chars(digits.data(), digits.data() + digits.size(), period).ec == std::errc{}) {
        spec.timers_[std::string(entry.node())].emplace(period, i);
      }
    }
  }
  for (std::size_t i = 0; i < spec.threads_.size(); ++i) {
    const std::string& id = spec.threads_[i].id;
    spec.thread_index_.emplace(id, i);
    if (id == kDdsQueues) spec.thread_families_.emplace(id.substr(0, id.size() - 1), i);
  }
  return spec;
}

SchedulingSpec SchedulingSpec::load(const std::filesystem::path& file,
                                    std::optional<std::uint32_t> domain) {
  return parse(yaml::read_file(file), file.string(), domain);
}

const SpecEntry* SchedulingSpec::find_callback(std::string_view logical_id,
                                               std::uint64_t period_ns) const noexcept {
  const auto exact = callback_index_.find(logical_id);
  if (exact != callback_index_.end()) return &callbacks_[exact->second];
  const auto its_node = LogicalId::node_of(logical_id);
  if (its_node.size() == logical_id.size()) return nullptr;  // no id of a callback
  if (period_ns > 0 && !is_all_digits(name_or_period(logical_id))) {
    const auto node = timers_.find(its_node);
    if (node != timers_.end()) {
      const auto timer = node->second.find(period_ns);
      if (timer != node->second.end()) return &callbacks_[timer->second];
    }
  }
  const auto wildcard = nodes_.find(its_node);
  return wildcard == nodes_.end() ? nullptr : &callbacks_[wildcard->second];
}

const SpecEntry* SchedulingSpec::find_thread(std::string_view name) const noexcept {
  const auto entry = thread_index_.find(name);
  if (entry != thread_index_.end()) return &threads_[entry->second];
  const auto family = thread_families_.find(name.substr(0, name.find('.') + 1));
  return family == thread_families_.end() ? nullptr : &threads_[family->second];
}

}  // namespace cie
