#include <cie/tracepoints/fields.hpp>
#include <cie/tracepoints/recording_manifest.hpp>

#include "base/file.hpp"

#include <algorithm>
#include <cstring>
#include <system_error>
#include <type_traits>
#include <utility>

#include <nlohmann/json.hpp>

namespace cie {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;  // what is written
using Parsed = nlohmann::json;        // finds members in logarithmic time, however many there are

constexpr std::string_view kSchema = "cie.recording/1";
constexpr std::string_view kAnySchema = "cie.recording/";
// A file takes some 150 bytes: this is a hundred thousand of them.
constexpr std::size_t kLargest = 16U << 20U;
constexpr int kDeepest = 8;

// The members of each object, each key named once. A visitor has
//
//   visit(key, member)
//   visit.needed(key, number)      that every such object has
//   visit.below(key, path)         that leads below the recording
//   visit.present(key, optional)   that is written only where it is there
//   visit.fixed(key, text)         that is written, and not read
//   visit.object(key, visit_its)   an object whose members are this object's own
//   visit.where(claim, visit_more) members that are written only where the claim is true
void fields(auto& visit, Is<RecordedInstant> auto& i) {
  visit("monotonic_ns", i.monotonic_ns);
  visit("realtime_ns", i.realtime_ns);
}

void fields(auto& visit, Is<RecordedExit> auto& e) {
  visit.present("status", e.code);
  visit.present("signal", e.signal);
}

void fields(auto& visit, Is<RecordedSnapshot> auto& s) {
  visit("reason", s.reason);
  visit("held_ns", s.held_ns);
}

void fields(auto& visit, Is<RelayedSession> auto& s) {
  visit("path", s.path);
  visit("begin", s.begin);
  visit("lost", s.lost);
  visit("end", s.end);
}

void fields(auto& visit, Is<RecordedRelay> auto& r) {
  visit("address", r.address);
  visit("sessions", r.sessions);
}

void fields(auto& visit, Is<RecordedKernel> auto& k) {
  visit("route", k.route);
  visit("buffer_size", k.buffer_size);
  visit("streams", k.streams);
  visit("events", k.events);
  visit("lost_events", k.lost_events);
  visit("untold_switches", k.untold_switches);
}

void fields(auto& visit, Is<RecordedSession> auto& s) {
  visit("name", s.name);
  visit("events", s.events);
  visit("subbuf_size", s.subbuf_size);
  visit("num_subbuf", s.num_subbuf);
  visit("flush_interval_ms", s.flush_interval_ms);
}

void fields(auto& visit, Is<RecordedProcess> auto& p) {
  visit.needed("pid", p.pid);
  visit("name", p.name);
  visit("start_ns", p.start_ns);
  visit.present("monotonic_offset_ns", p.monotonic_offset_ns);
}

void fields(auto& visit, Is<RecordedChannel> auto& c) {
  visit("name", c.name);
  visit("discarded_events", c.discarded_events);
  visit("lost_packets", c.lost_packets);
}

void fields(auto& visit, Is<RecordedFile> auto& f) {
  visit.below("path", f.path);
  visit.needed("size", f.size);
  visit("sha256", f.sha256);
}

void fields(auto& visit, Is<RecordingManifest> auto& m) {
  visit.fixed("schema", kSchema);
  visit.object("tool", [&m](auto& tool) {
    tool.fixed("name", "cie-record");
    tool("version", m.tool_version);
  });
  visit("mode", m.mode);
  visit("command", m.command);
  visit("exit", m.exit);
  visit("host", m.host);
  visit("boot_id", m.boot_id);
  visit("begin", m.begin);
  visit("end", m.end);
  visit("snapshot", m.snapshot);
  visit("relay", m.relay);
  visit("chunk", m.chunk);
  visit("removed_chunks", m.removed_chunks);
  visit("kernel_events", m.has_kernel_events);
  visit.object("kernel", [&m](auto& kernel) {
    kernel.where(m.has_kernel_events, [&] { fields(kernel, m.kernel); });
    kernel.where(!m.has_kernel_events, [&] { kernel("reason", m.kernel_reason); });
    kernel("problems", m.kernel.problems);
  });
  visit("session", m.session);
  visit("processes", m.processes);
  visit("names_all_processes", m.names_all_processes);
  visit("channels", m.channels);
  visit("problems", m.problems);
  visit("files", m.files);
}

class Writer {
 public:
  template <typename Value>
  void operator()(const char* key, const Value& value) {
    json_[key] = json_of(value);
  }
  template <typename Number>
  void needed(const char* key, const Number& number) {
    (*this)(key, number);
  }
  void below(const char* key, const std::string& path) { (*this)(key, path); }
  template <typename Value>
  void present(const char* key, const std::optional<Value>& value) {
    if (value) (*this)(key, *value);
  }
  void fixed(const char* key, std::string_view text) { json_[key] = text; }
  template <typename VisitIts>
  void object(const char* key, const VisitIts& visit_its) {
    Writer writer;
    visit_its(writer);
    json_[key] = std::move(writer.json_);
  }
  template <typename VisitMore>
  void where(bool claim, const VisitMore& visit_more) {
    if (claim) visit_more();
  }

  template <typename Object>
  requires std::is_class_v<Object>
  static Json json_of(const Object& object) {
    Writer writer;
    fields(writer, object);
    return std::move(writer.json_);
  }

 private:
  template <typename Number>
  requires std::is_arithmetic_v<Number>
  static Json json_of(Number number) { return number; }
  static Json json_of(const std::string& text) { return text; }
  template <typename Value>
  static Json json_of(const std::optional<Value>& value) {
    return value ? json_of(*value) : Json(nullptr);
  }
  template <typename Item>
  static Json json_of(const std::vector<Item>& items) {
    Json list = Json::array();
    for (const Item& item : items)
      list.push_back(json_of(item));
    return list;
  }

  Json json_ = Json::object();
};

// A value of the document and how it is called in messages: "files[3].size". Visits its members.
class Member {
 public:
  Member(const Parsed* json, std::string name) : json_(json), name_(std::move(name)) {}

  bool is_there() const { return json_ != nullptr && !json_->is_null(); }
  // A member of an object, which need not be there.
  Member operator[](const char* key) const {
    if (!is_there()) return {nullptr, name_};
    require(json_->is_object(), "an object");
    const auto found = json_->find(key);
    auto name = name_.empty() ? std::string(key) : name_ + '.' + key;
    return {found == json_->end() ? nullptr : &*found, std::move(name)};
  }

  void read(std::string& text) const {
    if (!is_there()) return;
    require(json_->is_string(), "a text");
    text = json_->get_ref<const std::string&>();
  }
  void read(bool& claim) const {
    if (!is_there()) return;
    require(json_->is_boolean(), "true or false");
    claim = json_->get<bool>();
  }
  template <typename Number>
  requires(std::is_integral_v<Number> &&
           !std::is_same_v<Number, bool>) void read(Number& number) const {
    if (!is_there()) return;
    require(json_->is_number_integer(), "an integer");
    const bool fits = json_->is_number_unsigned()
                          ? std::in_range<Number>(json_->get<std::uint64_t>())
                          : std::in_range<Number>(json_->get<std::int64_t>());
    require(fits, "an integer of its range");
    number = json_->get<Number>();
  }
  template <typename Item>
  void read(std::optional<Item>& item) const {
    if (!is_there()) return;
    Item value{};
    read(value);
    item = std::move(value);
  }
  template <typename Item>
  void read(std::vector<Item>& items) const {
    if (!is_there()) return;
    require(json_->is_array(), "a list");
    std::size_t index = 0;
    for (const Parsed& element : *json_) {
      const Member value(&element, name_ + '[' + std::to_string(index++) + ']');
      value.require(value.is_there(), "null");
      Item item{};
      value.read(item);
      items.push_back(std::move(item));
    }
  }
  void read(RecordedExit& exit) const {
    fields(*this, exit);
    require(exit.code.has_value() != exit.signal.has_value(), "a status or a signal");
  }
  template <typename Object>
  requires std::is_class_v<Object>
  void read(Object& object) const { fields(*this, object); }

  template <typename Value>
  void operator()(const char* key, Value& value) const {
    (*this)[key].read(value);
  }
  template <typename Number>
  void needed(const char* key, Number& number) const {
    const Member member = (*this)[key];
    member.require(member.is_there(), "an integer");
    member.read(number);
  }
  void below(const char* key, std::string& path) const {
    const Member member = (*this)[key];
    member.read(path);
    member.require(leads_below(path), "a path below the recording");
  }
  template <typename Value>
  void present(const char* key, std::optional<Value>& value) const {
    (*this)(key, value);
  }
  void fixed(const char* /*key*/, std::string_view /*text*/) const {}
  template <typename VisitIts>
  void object(const char* key, const VisitIts& visit_its) const {
    const Member member = (*this)[key];
    visit_its(member);
  }
  template <typename VisitMore>
  void where(bool /*claim*/, const VisitMore& visit_more) const {
    visit_more();
  }

 private:
  // False for what names the directory itself, or anything outside it.
  static bool leads_below(const std::string& text) {
    if (text.empty() || text.find('\0') != std::string::npos) return false;
    const fs::path path(text);
    return path.is_relative() && std::ranges::none_of(path, [](const fs::path& part) {
             return part.empty() || part == "." || part == "..";
           });
  }

  void require(bool is_so, const char* what) const {
    if (!is_so) throw ManifestError(name_ + " is not " + what);
  }

  const Parsed* json_;
  std::string name_;
};

}  // namespace

std::string describe(const RecordedExit& exit) {
  if (exit.code) return "exited with status " + std::to_string(*exit.code);
  const int number = exit.signal.value_or(0);
  const char* name = number > 0 ? sigdescr_np(number) : nullptr;  // no strsignal(): threads
  return "was killed by signal " + std::to_string(number) +
         (name != nullptr ? std::string(" (") + name + ')' : "");
}

std::vector<std::string> all_problems(const RecordingManifest& manifest) {
  std::vector<std::string> all;
  for (const auto* problems : {&manifest.problems, &manifest.kernel.problems}) {
    for (const auto& problem : *problems)
      add_problem(all, problem);
  }
  return all;
}

bool add_problem(std::vector<std::string>& problems, std::string problem) {
  const bool is_told = std::find(problems.begin(), problems.end(), problem) != problems.end();
  if (!is_told) problems.push_back(std::move(problem));
  return !is_told;
}

std::string to_json(const RecordingManifest& manifest) {
  return Writer::json_of(manifest).dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::optional<RecordingManifest> parse_recording_manifest(std::string_view text) {
  if (text.size() > kLargest) throw ManifestError("it is larger than a manifest can be");
  const auto bound_depth = [](int depth, Parsed::parse_event_t /*event*/,
                              const Parsed& /*parsed*/) {
    if (depth > kDeepest) throw ManifestError("it is nested deeper than a manifest is");
    return true;
  };
  Parsed json;
  try {
    json = Parsed::parse(text, bound_depth);
  } catch (const Parsed::parse_error& error) {
    throw ManifestError("it is no JSON: byte " + std::to_string(error.byte));
  }
  const auto schema = json.is_object() ? json.find("schema") : json.end();
  if (schema == json.end() || !schema->is_string()) return std::nullopt;
  const auto& name = schema->get_ref<const std::string&>();
  if (name != kSchema) {
    if (!name.starts_with(kAnySchema)) return std::nullopt;
    throw ManifestError("it is of a kind that this program does not know, " +
                        Parsed(name).dump(-1, ' ', true, Parsed::error_handler_t::replace));
  }
  RecordingManifest manifest;
  Member(&json, {}).read(manifest);
  return manifest;
}

std::optional<RecordingManifest> load_recording_manifest(const fs::path& directory) {
  const fs::path path = directory / kManifestName;
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return std::nullopt;
  std::string text;
  try {
    text = read_file(path, kLargest + 1);
  } catch (const std::system_error& error) {
    throw ManifestError(std::string("it cannot be read: ") + error.what());
  }
  return parse_recording_manifest(text);
}

}  // namespace cie
