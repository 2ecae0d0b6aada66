#include "context_state.hpp"

#include <cie/scheduling/started_threads.hpp>

#include "base/file_descriptor.hpp"
#include "dds_qos.hpp"
#include "scheduling_names.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

namespace cie {
namespace executor {
namespace {

// Tells ROS 2 that nodes are here; the place in its hierarchy of security settings is the root.
constexpr std::string_view kEnclave = "enclave=/;";

// Literally in traces and scheduling specs.
constexpr const char* kParameterThread = "cie-parameters";

// Participants of one machine that can find each other without multicast: each sends its
// announcement to every index, so the number costs traffic at start.
constexpr std::uint32_t kMostParticipantIndex = 30;

// Where RouDi, which hands out shared memory, takes requests.
constexpr std::string_view kRoudiSocket = "/tmp/roudi";

// The address, not a name: a bare system or a container may know no "localhost".
std::string loopback_configuration(const std::string& tag) {
  return fmt::format(
      "<CycloneDDS><Domain Id=\"any\"><General><Interfaces>"
      "<NetworkInterface name=\"lo\" multicast=\"false\"/></Interfaces>"
      "<AllowMulticast>false</AllowMulticast></General>"
      "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>{}"
      "</MaxAutoParticipantIndex><Peers><Peer address=\"127.0.0.1\"/></Peers>{}"
      "</Discovery></Domain></CycloneDDS>",
      kMostParticipantIndex, tag.empty() ? "" : "<Tag>" + tag + "</Tag>");
}

void validate(const Context::Options& options) {
  if (options.domain > Context::kMostDomain) {
    throw std::invalid_argument{fmt::format("DDS domain {} is not usable: choose 0 to {}",
                                            options.domain, Context::kMostDomain)};
  }
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  };
  if (!std::ranges::all_of(options.tag, is_plain)) {
    throw std::invalid_argument{"discovery tag \"" + options.tag +
                                "\" is not usable: letters, digits, '-' and '_' only"};
  }
  if (!options.tag.empty() && !options.loopback) {
    throw std::invalid_argument{"a discovery tag needs the loopback configuration"};
  }
}

// What DDS is to be configured with; empty: as it is without us.
std::string configuration(const Context::Options& options) {
  std::string xml;
  if (options.loopback) {
    xml = loopback_configuration(options.tag);
  } else if (const char* const given = std::getenv("CYCLONEDDS_URI");
             options.shared_memory && given != nullptr) {
    xml = given;
  }
  if (options.shared_memory) {
    if (!xml.empty()) xml += ',';
    xml +=
        "<CycloneDDS><Domain Id=\"any\"><SharedMemory><Enable>true</Enable></SharedMemory>"
        "</Domain></CycloneDDS>";
  }
  return xml;
}

// Without RouDi iceoryx waits for a minute and then ends the process.
void check_for_roudi() {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::ranges::copy(kRoudiSocket, address.sun_path);
  const FileDescriptor socket{::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)};
  if (socket.is_open() &&
      connect(socket.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) {
    return;
  }
  const int error = errno;
  throw std::runtime_error{
      "shared memory is not available: RouDi does not answer at " + std::string{kRoudiSocket} +
      " (" + std::generic_category().message(error) + "): start iox-roudi (Debian: iceoryx)"};
}

std::mutex& claims_mutex() {
  static std::mutex mutex;
  return mutex;
}
std::set<std::uint32_t>& claims() {
  static std::set<std::uint32_t> domains;
  return domains;
}

}  // namespace

ContextState::DomainClaim::DomainClaim(std::uint32_t domain) : domain_(domain) {
  const std::lock_guard lock{claims_mutex()};
  if (!claims().insert(domain).second) {
    throw std::logic_error{
        fmt::format("this process already has a Context of DDS domain {}: share "
                    "it, one participant is enough",
                    domain)};
  }
}

ContextState::DomainClaim::~DomainClaim() {
  const std::lock_guard lock{claims_mutex()};
  claims().erase(domain_);
}

ContextState::ContextState(const Context::Options& options)
    : options_((validate(options), options)),
      warnings_(std::make_shared<Warnings>(options.on_warning)),
      claim_(options.domain) {
  const StartedThreads started;
  const std::string domain = fmt::format("domain {}", options_.domain);
  if (options_.shared_memory) check_for_roudi();
  if (const std::string xml = configuration(options_); !xml.empty()) {
    domain_ =
        dds::Entity{dds_create_domain(options_.domain, xml.c_str()), "configuring DDS", domain};
  }
  const dds::QosPtr qos{dds_create_qos()};
  if (options_.ros_graph != RosGraph::none) {
    dds_qset_userdata(qos.get(), kEnclave.data(), kEnclave.size());
  }
  participant_ = dds::Entity{dds_create_participant(options_.domain, qos.get(), nullptr),
                             "creating the DDS participant", domain};
  graph_.emplace(participant_.get(), options_.ros_graph);
  for (const auto& [tid, name] : started.named()) {
    workers_.push_back({name, std::make_shared<trace::Thread>(ThreadRole::worker, kNoCallback,
                                                              kNoGroup, name, tid)});
    workers_.back().trace->emit_sched(SchedMoment::initial, 0);
  }
}

std::vector<AnnouncedThread> ContextState::workers() const {
  const std::lock_guard lock{mutex_};
  return workers_;
}

BackgroundServer& ContextState::parameter_server() {
  const std::lock_guard lock{mutex_};
  if (parameter_server_ == nullptr) {
    parameter_server_ = std::make_unique<BackgroundServer>(kParameterThread);
    workers_.push_back({kParameterThread, parameter_server_->thread()});
  }
  return *parameter_server_;
}

ContextState::~ContextState() {
  workers_.clear();  // while they live: their last read-back is of what they ran as
  parameter_server_.reset();
  graph_.reset();
  participant_.reset();
  domain_.reset();
}

}  // namespace executor

namespace {

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string{} : std::string{value};
}

std::uint32_t domain_from(const char* name, const std::string& text) {
  std::uint32_t domain = 0;
  const auto* const end = text.data() + text.size();
  const auto [parsed, error] = std::from_chars(text.data(), end, domain);
  if (error != std::errc{} || parsed != end) {
    throw std::invalid_argument{std::string{name} + "=\"" + text + "\" is not a domain number"};
  }
  return domain;
}

bool is_set(const char* name) {
  const std::string text = environment(name);
  if (!text.empty() && text != "0" && text != "1") {
    throw std::invalid_argument{std::string{name} + "=\"" + text + "\" is neither 0 nor 1"};
  }
  return text == "1";
}

RosGraph ros_graph_from(const std::string& text, const std::string& distribution) {
  if (text == "none") return RosGraph::none;
  if (text == "humble") return RosGraph::humble;
  if (text == "iron") return RosGraph::iron;
  if (!text.empty()) {
    throw std::invalid_argument{"CIE_ROS_GRAPH=\"" + text + "\" is none of none, humble, iron"};
  }
  // Distributions are named in the order of the alphabet.
  return distribution < "iron" ? RosGraph::humble : RosGraph::iron;
}

}  // namespace

Context::Options Context::Options::from_environment() {
  Options options;
  for (const char* const name : {"CIE_DOMAIN_ID", "ROS_DOMAIN_ID"}) {
    const std::string text = environment(name);
    if (text.empty()) continue;
    options.domain = domain_from(name, text);
    break;
  }
  options.loopback = is_set("CIE_LOOPBACK");
  options.shared_memory = is_set("CIE_SHARED_MEMORY");
  options.tag = environment("CIE_DISCOVERY_TAG");
  options.ros_graph = ros_graph_from(environment("CIE_ROS_GRAPH"), environment("ROS_DISTRO"));
  return options;
}

Context::Context(const Options& options)
    : state_(std::make_shared<executor::ContextState>(options)) {}
Context::~Context() = default;
Context::Context(Context&&) noexcept = default;
Context& Context::operator=(Context&&) noexcept = default;
const Context::Options& Context::options() const noexcept { return state_->options(); }

}  // namespace cie
