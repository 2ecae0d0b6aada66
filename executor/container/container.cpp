#include "container.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace cie::container {
namespace {

// Whether the name stands in the text as a word of its own.
bool is_named(std::string_view text, std::string_view name) {
  const auto is_part = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
  };
  for (auto at = text.find(name); at != std::string_view::npos; at = text.find(name, at + 1)) {
    const auto end = at + name.size();
    if ((at == 0 || !is_part(text[at - 1])) && (end == text.size() || !is_part(text[end])))
      return true;
  }
  return false;
}

// Where the mistake is: what the command line says of a parameter does not stand in the file.
std::string place_of(const ComponentEntry& entry, const std::string& file,
                     std::string_view reason) {
  for (const auto& [parameter, source] : entry.overridden) {
    if (is_named(reason, parameter)) return source;
  }
  return fmt::format("{}:{}", file, entry.line);
}

Context::Options network(const AppFile& app) {
  Context::Options options = Context::Options::from_environment();
  if (app.domain) options.domain = *app.domain;
  if (app.is_loopback) options.loopback = *app.is_loopback;
  if (app.discovery_tag) options.tag = *app.discovery_tag;
  return options;
}

}  // namespace

Container::Container(const AppFile& app, Say say)
    : app_(app), say_(std::move(say)), context_(network(app)) {
  ExecutorOptions options;
  if (app_.spec) {
    options.spec = load_spec();
  }
  options.on_error = app_.on_error;
  options.audit_period = app_.audit_period;
  options.on_change = app_.on_change;
  options.lock_memory = app_.lock_memory;
  options.prefault_stack = app_.prefault_stack;
  options.on_scheduling_problem = [this](const SchedulingProblem& problem) {
    const bool is_told_only = problem.is_from_outside || problem.is_misspelt;
    const bool is_thrown_too = app_.on_error == OnError::refuse && !is_told_only;
    if (!is_thrown_too) say_("warning: " + problem.text());
  };
  options.on_exception = [this](const CallbackFailure& failure) { count_failure(failure); };
  executor_ = make_executor(app_.executor, std::move(options));
}

Container::~Container() {
  while (!members_.empty()) {  // the last one loaded goes first: it may use the others
    Member member = std::move(members_.back());
    members_.pop_back();
    executor_->remove_node(member.component->node());
  }
}

void Container::check_machine(const SchedulingSpec& spec) const {
  try {
    check_hardware_info(spec);
  } catch (const SpecError& error) {
    if (app_.on_error == OnError::refuse) throw;
    say_("warning: " + std::string{error.what()});
  }
}

std::size_t Container::load_all() {
  for (const ComponentEntry& entry : app_.components) {
    const std::string name = entry.qualified_name();
    const std::string what =
        "\"" + name + "\" (" + entry.class_name + " from " + entry.library + ")";
    try {
      const ComponentOptions options{context_, entry.name, entry.name_space, entry.parameters,
                                     entry.remaps};
      Member member{name,
                    std::make_unique<LoadedComponent>(entry.library, entry.class_name, options)};
      executor_->add_node(member.component->node());
      members_.push_back(std::move(member));
      say_("loaded " + what);
    } catch (const std::exception& error) {
      say_(fmt::format("{}: component {} is not loaded: {}",
                       place_of(entry, app_.file, error.what()), what, error.what()));
    }
  }
  return members_.size();
}

std::string Container::list() const {
  std::string text;
  for (const Member& member : members_) {
    text += member.name + " " + member.component->class_name() + " " + member.component->library() +
            "\n";
  }
  return text;
}

std::vector<std::string> Container::names() const {
  std::vector<std::string> names;
  for (const Member& member : members_)
    names.push_back(member.name);
  return names;
}

std::string Container::with_node(const std::string& name,
                                 const std::function<std::string(Node& node)>& function) const {
  const auto found = std::ranges::find(members_, name, &Member::name);
  if (found == members_.end()) throw std::runtime_error{"no component \"" + name + "\" is loaded"};
  return function(found->component->node());
}

std::shared_ptr<const SchedulingSpec> Container::load_spec() const {
  auto spec =
      std::make_shared<SchedulingSpec>(SchedulingSpec::load(*app_.spec, context_.options().domain));
  check_machine(*spec);
  for (const auto& [section, line] : spec->not_applied()) {
    say_(fmt::format("{}:{}: note: \"{}\" is about the machine and is not applied", spec->name(),
                     line, section));
  }
  return spec;
}

bool Container::has_spec() const noexcept { return app_.spec.has_value(); }

std::string Container::reload_spec() {
  if (!app_.spec)
    throw std::runtime_error{"there is no spec to load anew: the application names none"};
  std::string line;
  try {
    const auto spec = load_spec();
    executor_->reload_spec(spec);
    line = "runs by " + app_.spec->string() + " as it is now, sha256 " + spec->sha256();
  } catch (const std::exception& error) {
    say_("the former spec stays in force: " + std::string{error.what()});
    throw;
  }
  say_(line);
  return line + "\n";
}

void Container::run() { executor_->spin(); }

// Says the first one of each callback: a timer that throws would otherwise flood the terminal.
void Container::count_failure(const CallbackFailure& failure) {
  const std::string text = failure.text();
  {
    const std::lock_guard lock{failures_mutex_};
    if (++failures_[failure.logical_id] > 1) return;
  }
  say_(text + " (it stays in service; further ones are counted)");
}

std::uint64_t Container::failures() const {
  const std::lock_guard lock{failures_mutex_};
  std::uint64_t sum = 0;
  for (const auto& [logical_id, count] : failures_)
    sum += count;
  return sum;
}

}  // namespace cie::container
