#include <cie/tracepoints/recording_manifest.hpp>

#include <algorithm>
#include <cstring>
#include <fstream>
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
constexpr std::uintmax_t kLargest = 16U << 20U;
constexpr int kDeepest = 8;

Json in_json(const RecordedInstant& instant) {
  return {{"monotonic_ns", instant.monotonic_ns}, {"realtime_ns", instant.realtime_ns}};
}

Json in_json(const std::optional<RecordedInstant>& instant) {
  return instant ? in_json(*instant) : Json(nullptr);
}

Json in_json(const std::optional<RecordedExit>& exit) {
  if (!exit) return nullptr;
  return exit->code ? Json{{"status", *exit->code}} : Json{{"signal", exit->signal.value_or(0)}};
}

Json in_json(const std::optional<RecordedSnapshot>& snapshot) {
  if (!snapshot) return nullptr;
  return {{"reason", snapshot->reason}, {"held_ns", snapshot->held_ns}};
}

Json in_json(const std::optional<RecordedRelay>& relay) {
  if (!relay) return nullptr;
  Json sessions = Json::array();
  for (const RelayedSession& session : relay->sessions) {
    sessions.push_back({{"path", session.path},
                        {"begin", in_json(session.begin)},
                        {"lost", in_json(session.lost)},
                        {"end", in_json(session.end)}});
  }
  return {{"address", relay->address}, {"sessions", sessions}};
}

Json kernel_of(const RecordingManifest& manifest) {
  if (!manifest.has_kernel_events) return {{"reason", manifest.kernel_reason}};
  const RecordedKernel& kernel = manifest.kernel;
  return {{"route", kernel.route},
          {"buffer_size", kernel.buffer_size},
          {"streams", kernel.streams},
          {"events", kernel.events.value_or(0)},
          {"lost_events", kernel.lost_events},
          {"untold_switches", kernel.untold_switches}};
}

Json in_json(const RecordedProcess& process) {
  return {{"pid", process.pid},
          {"name", process.name},
          {"start_ns", process.start_ns ? Json(*process.start_ns) : Json(nullptr)}};
}

Json in_json(const RecordedChannel& channel) {
  return {{"name", channel.name},
          {"discarded_events", channel.discarded_events},
          {"lost_packets", channel.lost_packets}};
}

Json in_json(const RecordedFile& file) {
  return {{"path", file.path}, {"size", file.size}, {"sha256", file.sha256}};
}

template <typename Item>
Json list_of(const std::vector<Item>& items) {
  Json list = Json::array();
  for (const Item& item : items)
    list.push_back(in_json(item));
  return list;
}

Json in_json(const std::optional<std::uint64_t>& number) {
  return number ? Json(*number) : Json(nullptr);
}

// A value of the document and how it is called in messages: "files[3].size".
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
  void read(RecordedInstant& instant) const {
    (*this)["monotonic_ns"].read(instant.monotonic_ns);
    (*this)["realtime_ns"].read(instant.realtime_ns);
  }
  void read(RecordedExit& exit) const {
    (*this)["status"].read(exit.code);
    (*this)["signal"].read(exit.signal);
    require(exit.code.has_value() != exit.signal.has_value(), "a status or a signal");
  }
  void read(RecordedSnapshot& snapshot) const {
    (*this)["reason"].read(snapshot.reason);
    (*this)["held_ns"].read(snapshot.held_ns);
  }
  void read(RelayedSession& session) const {
    (*this)["path"].read(session.path);
    (*this)["begin"].read(session.begin);
    (*this)["lost"].read(session.lost);
    (*this)["end"].read(session.end);
  }
  void read(RecordedRelay& relay) const {
    (*this)["address"].read(relay.address);
    (*this)["sessions"].read(relay.sessions);
  }
  void read(RecordedKernel& kernel) const {
    (*this)["route"].read(kernel.route);
    (*this)["buffer_size"].read(kernel.buffer_size);
    (*this)["streams"].read(kernel.streams);
    (*this)["events"].read(kernel.events);
    (*this)["lost_events"].read(kernel.lost_events);
    (*this)["untold_switches"].read(kernel.untold_switches);
  }
  void read(RecordedSession& session) const {
    (*this)["name"].read(session.name);
    (*this)["events"].read(session.events);
    (*this)["subbuf_size"].read(session.subbuf_size);
    (*this)["num_subbuf"].read(session.num_subbuf);
    (*this)["flush_interval_ms"].read(session.flush_interval_ms);
  }
  void read(RecordedProcess& process) const {
    const auto pid = (*this)["pid"];
    pid.require(pid.is_there(), "an integer");
    pid.read(process.pid);
    (*this)["name"].read(process.name);
    (*this)["start_ns"].read(process.start_ns);
  }
  void read(RecordedChannel& channel) const {
    (*this)["name"].read(channel.name);
    (*this)["discarded_events"].read(channel.discarded_events);
    (*this)["lost_packets"].read(channel.lost_packets);
  }
  void read(RecordedFile& file) const {
    const auto path = (*this)["path"];
    path.read(file.path);
    path.require(leads_below(file.path), "a path below the recording");
    const auto size = (*this)["size"];
    size.require(size.is_there(), "an integer");
    size.read(file.size);
    (*this)["sha256"].read(file.sha256);
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

RecordingManifest manifest_of(const Member& document) {
  RecordingManifest manifest;
  document["tool"]["version"].read(manifest.tool_version);
  document["mode"].read(manifest.mode);
  document["command"].read(manifest.command);
  document["exit"].read(manifest.exit);
  document["host"].read(manifest.host);
  document["boot_id"].read(manifest.boot_id);
  document["begin"].read(manifest.begin);
  document["end"].read(manifest.end);
  document["snapshot"].read(manifest.snapshot);
  document["relay"].read(manifest.relay);
  document["chunk"].read(manifest.chunk);
  document["removed_chunks"].read(manifest.removed_chunks);
  document["kernel_events"].read(manifest.has_kernel_events);
  document["kernel"].read(manifest.kernel);
  document["kernel"]["reason"].read(manifest.kernel_reason);
  document["session"].read(manifest.session);
  document["processes"].read(manifest.processes);
  document["names_all_processes"].read(manifest.names_all_processes);
  document["channels"].read(manifest.channels);
  document["problems"].read(manifest.problems);
  document["files"].read(manifest.files);
  return manifest;
}

}  // namespace

std::string describe(const RecordedExit& exit) {
  if (exit.code) return "exited with status " + std::to_string(*exit.code);
  const int number = exit.signal.value_or(0);
  const char* name = number > 0 ? sigdescr_np(number) : nullptr;  // no strsignal(): threads
  return "was killed by signal " + std::to_string(number) +
         (name != nullptr ? std::string(" (") + name + ')' : "");
}

std::string to_json(const RecordingManifest& manifest) {
  const RecordedSession& session = manifest.session;
  const Json json{{"schema", kSchema},
                  {"tool", {{"name", "cie-record"}, {"version", manifest.tool_version}}},
                  {"mode", manifest.mode},
                  {"command", manifest.command},
                  {"exit", in_json(manifest.exit)},
                  {"host", manifest.host},
                  {"boot_id", manifest.boot_id},
                  {"begin", in_json(manifest.begin)},
                  {"end", in_json(manifest.end)},
                  {"snapshot", in_json(manifest.snapshot)},
                  {"relay", in_json(manifest.relay)},
                  {"chunk", in_json(manifest.chunk)},
                  {"removed_chunks", in_json(manifest.removed_chunks)},
                  {"kernel_events", manifest.has_kernel_events},
                  {"kernel", kernel_of(manifest)},
                  {"session",
                   {{"name", session.name},
                    {"events", session.events},
                    {"subbuf_size", session.subbuf_size},
                    {"num_subbuf", session.num_subbuf},
                    {"flush_interval_ms", session.flush_interval_ms}}},
                  {"processes", list_of(manifest.processes)},
                  {"names_all_processes", manifest.names_all_processes},
                  {"channels", list_of(manifest.channels)},
                  {"problems", manifest.problems},
                  {"files", list_of(manifest.files)}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
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
  return manifest_of(Member(&json, {}));
}

std::optional<RecordingManifest> load_recording_manifest(const fs::path& directory) {
  const fs::path path = directory / kManifestName;
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status)) return std::nullopt;
  if (!fs::is_regular_file(status)) throw ManifestError("it is not a file");
  std::ifstream file(path, std::ios::binary);
  std::string text(static_cast<std::size_t>(std::min(fs::file_size(path, error), kLargest)) + 1, 0);
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file.is_open() || file.bad()) throw ManifestError("it cannot be read");
  text.resize(static_cast<std::size_t>(file.gcount()));
  return parse_recording_manifest(text);
}

}  // namespace cie
