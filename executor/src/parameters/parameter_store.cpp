#include "parameter_store.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace cie::executor {
namespace {

bool is_in(const IntegerRange& range, std::int64_t value) noexcept {
  if (value < range.from || value > range.to) return false;
  if (range.step == 0 || value == range.to) return true;
  // Differences of 64-bit numbers fit into 64 bits without a sign.
  const std::uint64_t distance =
      static_cast<std::uint64_t>(value) - static_cast<std::uint64_t>(range.from);
  return distance % range.step == 0;
}

// A multiple of the step within what the rounding of a division and a product may lose.
bool is_in(const FloatingPointRange& range, double value) noexcept {
  if (!(value >= range.from && value <= range.to)) return false;
  if (range.step == 0 || value == range.to) return true;
  constexpr double kTolerance = 1e-9;
  const double steps = (value - range.from) / range.step;
  return std::abs(steps - std::round(steps)) <= kTolerance * std::max(1.0, std::abs(steps));
}

bool has_zero(std::string_view text) { return text.find('\0') != std::string_view::npos; }

// What no message could tell the network.
bool holds_zero(const ParameterValue& value) {
  if (const auto* const text = std::get_if<std::string>(&value)) return has_zero(*text);
  const auto* const texts = std::get_if<std::vector<std::string>>(&value);
  return texts != nullptr &&
         std::ranges::any_of(*texts, [](const std::string& text) { return has_zero(text); });
}

// Empty if the value fits.
std::string misfit(const ParameterDescriptor& descriptor, const ParameterValue& value) {
  if (holds_zero(value)) return "a text has a zero inside, and texts end at a zero on the network";
  const auto* const integer = std::get_if<std::int64_t>(&value);
  const auto& integers = descriptor.integer_range;
  if (integer != nullptr && integers && !is_in(*integers, *integer)) {
    return fmt::format("{} is not in the range {} to {}{}", *integer, integers->from, integers->to,
                       integers->step > 1 ? fmt::format(" in steps of {}", integers->step) : "");
  }
  const auto* const number = std::get_if<double>(&value);
  const auto& numbers = descriptor.floating_point_range;
  if (number != nullptr && numbers && !is_in(*numbers, *number)) {
    return fmt::format("{} is not in the range {} to {}{}", to_text(value), to_text(numbers->from),
                       to_text(numbers->to),
                       numbers->step != 0 ? " in steps of " + to_text(numbers->step) : "");
  }
  return {};
}

SetParametersResult refusal(const std::string& name, const std::string& reason) {
  return {.is_successful = false, .reason = "parameter \"" + name + "\": " + reason};
}

bool is_listed(std::string_view name, const std::string& prefix, std::uint64_t depth) {
  if (name == prefix) return true;
  if (!prefix.empty()) {
    if (!name.starts_with(prefix + ".")) return false;
    name.remove_prefix(prefix.size() + 1);
  }
  const auto dots = static_cast<std::uint64_t>(std::ranges::count(name, '.'));
  return depth == 0 || dots < depth;
}

}  // namespace

class ParameterStore::Changing {
 public:
  explicit Changing(ParameterStore& store) : store_(store) {
    if (store.changing_.load() == std::this_thread::get_id()) {
      throw std::logic_error{"an on-set callback of node \"" + store.node_ +
                             "\" declares or sets parameters of the node: a post-set callback may"};
    }
    store.changing_mutex_.lock();
    store.changing_ = std::this_thread::get_id();
  }
  Changing(const Changing&) = delete;
  Changing& operator=(const Changing&) = delete;
  ~Changing() {
    store_.changing_ = std::thread::id{};
    store_.changing_mutex_.unlock();
  }
  void tell(Change change, const std::vector<Parameter>& parameters) const {
    if (store_.change_sink_) store_.change_sink_(change, parameters);
  }

 private:
  ParameterStore& store_;
};

void ParameterStore::fail(std::string_view name, const std::string& what) const {
  throw ParameterError{"parameter \"" + std::string{name} + "\" of node \"" + node_ + "\" " + what};
}

const ParameterStore::Declared& ParameterStore::find(std::string_view name) const {
  const auto found = declared_.find(name);
  if (found == declared_.end()) fail(name, "is not declared");
  return found->second;
}

template <typename Result, typename Function>
Result ParameterStore::call(Registered<Function>& registered,
                            const std::vector<Parameter>& parameters) {
  const std::lock_guard lock{registered.mutex};
  if (!registered.function) return Result();
  struct Running {
    explicit Running(int& running) : count(running) { ++count; }
    ~Running() { --count; }
    int& count;
  };
  const Running running{registered.running};
  return registered.function(parameters);
}

template <typename Function>
std::shared_ptr<void> ParameterStore::add(Functions<Function>& functions, Function function) {
  auto callbacks = callbacks_;
  const std::lock_guard lock{callbacks->mutex};
  functions.push_back(std::make_shared<Registered<Function>>(std::move(function)));
  const auto place = std::prev(functions.end());
  return {place->get(), [callbacks, &functions, place](void*) {
            const auto gone = *place;
            {
              const std::lock_guard removing{callbacks->mutex};
              functions.erase(place);
            }
            const std::lock_guard waiting{gone->mutex};
            if (gone->running == 0) gone->function = nullptr;
          }};
}

template <typename Function>
std::vector<std::shared_ptr<ParameterStore::Registered<Function>>> ParameterStore::copy(
    const Functions<Function>& functions) const {
  const std::lock_guard lock{callbacks_->mutex};
  return {functions.begin(), functions.end()};
}

ParameterValue ParameterStore::declare(std::string_view name, ParameterValue value,
                                       ParameterDescriptor descriptor) {
  const Changing changing{*this};
  if (name.empty()) fail(name, "needs a name");
  if (has_zero(name) || has_zero(descriptor.description) ||
      has_zero(descriptor.additional_constraints)) {
    fail(name.substr(0, name.find('\0')), "has a zero in its name or description: remove it");
  }
  if (has(name)) fail(name, "is declared already");
  const auto text = overrides_.find(name);
  if (text != overrides_.end()) {
    const auto kind = descriptor.is_dynamically_typed ? ParameterKind::not_set : kind_of(value);
    try {
      value = parse_parameter(name, text->second, kind);
    } catch (const std::invalid_argument& error) {
      throw ParameterError{error.what()};
    }
  }
  if (kind_of(value) == ParameterKind::not_set && !descriptor.is_dynamically_typed) {
    fail(name, "has no value, and so no type: give it one, or declare it dynamically typed");
  }
  if (const std::string reason = misfit(descriptor, value); !reason.empty()) {
    fail(name, "cannot be declared: " + reason);
  }
  const std::vector<Parameter> all{{std::string{name}, value}};
  if (const auto result = ask(all); !result.is_successful) {
    fail(name, "cannot be declared: " + result.reason);
  }
  {
    const std::lock_guard lock{values_mutex_};
    declared_.emplace(name, Declared{value, std::move(descriptor)});
    ever_declared_.emplace(name);
  }
  changing.tell(Change::declared, all);
  return value;
}

void ParameterStore::undeclare(std::string_view name) {
  const Changing changing{*this};
  std::vector<Parameter> gone;
  {
    const std::lock_guard lock{values_mutex_};
    const Declared& declared = find(name);
    if (declared.descriptor.is_read_only) fail(name, "is read-only and stays declared");
    gone.push_back({std::string{name}, declared.value});
    declared_.erase(declared_.find(name));
  }
  changing.tell(Change::undeclared, gone);
}

bool ParameterStore::has(std::string_view name) const {
  const std::lock_guard lock{values_mutex_};
  return declared_.contains(name);
}

ParameterValue ParameterStore::get(std::string_view name) const {
  const std::lock_guard lock{values_mutex_};
  return find(name).value;
}

ParameterDescriptor ParameterStore::describe(std::string_view name) const {
  const std::lock_guard lock{values_mutex_};
  return find(name).descriptor;
}

SetParametersResult ParameterStore::check(const std::vector<Parameter>& parameters) const {
  const std::lock_guard lock{values_mutex_};
  for (const auto& [name, value] : parameters) {
    const auto found = declared_.find(name);
    if (found == declared_.end()) return refusal(name, "not declared");
    const auto& [current, descriptor] = found->second;
    if (descriptor.is_read_only) return refusal(name, "read-only");
    if (!descriptor.is_dynamically_typed && kind_of(value) != kind_of(current)) {
      return refusal(name, "its type is " + std::string{kind_name(kind_of(current))} + ", not " +
                               std::string{kind_name(kind_of(value))});
    }
    if (const std::string reason = misfit(descriptor, value); !reason.empty()) {
      return refusal(name, reason);
    }
  }
  return {};
}

SetParametersResult ParameterStore::ask(const std::vector<Parameter>& parameters) const {
  for (const auto& function : copy(callbacks_->on_set)) {
    auto result = call<SetParametersResult>(*function, parameters);
    if (!result.is_successful) return result;
  }
  return {};
}

SetParametersResult ParameterStore::set(const std::vector<Parameter>& parameters) {
  if (parameters.empty()) return {};
  {
    const Changing changing{*this};
    if (auto result = check(parameters); !result.is_successful) return result;
    if (auto result = ask(parameters); !result.is_successful) return result;
    {
      const std::lock_guard lock{values_mutex_};
      for (const auto& [name, value] : parameters)
        declared_.find(name)->second.value = value;
    }
    changing.tell(Change::set, parameters);
  }
  for (const auto& function : copy(callbacks_->post_set))
    call<void>(*function, parameters);
  return {};
}

std::vector<std::string> ParameterStore::list(const std::vector<std::string>& prefixes,
                                              std::uint64_t depth) const {
  std::vector<std::string> names;
  const std::lock_guard lock{values_mutex_};
  for (const auto& declared : declared_) {
    const std::string& name = declared.first;
    const bool is_wanted = prefixes.empty()
                               ? is_listed(name, "", depth)
                               : std::ranges::any_of(prefixes, [&](const std::string& prefix) {
                                   return is_listed(name, prefix, depth);
                                 });
    if (is_wanted) names.push_back(name);
  }
  return names;
}

std::shared_ptr<void> ParameterStore::add_on_set(OnSetParameters function) {
  return add(callbacks_->on_set, std::move(function));
}

std::shared_ptr<void> ParameterStore::add_post_set(PostSetParameters function) {
  return add(callbacks_->post_set, std::move(function));
}

std::vector<std::string> ParameterStore::unused_overrides() const {
  std::vector<std::string> unused;
  const std::lock_guard lock{values_mutex_};
  for (const auto& [name, text] : overrides_) {
    if (!ever_declared_.contains(name)) unused.push_back(name);
  }
  return unused;
}

}  // namespace cie::executor
