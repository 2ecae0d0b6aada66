// The other side of the wire, for wire_test.py: shows what it discovers and receives, as bytes, and
// sends the bytes it is given. It knows Cyclone DDS and no type, and shares no code with executor/.
//
//   sub TOPIC TYPE volatile|transient_local[,deadline=NS][,lease=NS,manual] [USER_DATA]
//   pub … likewise     write TOPIC HEX
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

// features.h decides the layout of what follows.
// clang-format off
#include <dds/features.h>
#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <dds/ddsi/q_radmin.h>
// clang-format on
#include <poll.h>
#include <unistd.h>

namespace {

using Octets = std::vector<unsigned char>;

// A sample that is only bytes, padded to a multiple of four.
struct Raw final : ddsi_serdata {
  Octets octets;
};
Octets& octets_of(const ddsi_serdata* data) {
  return const_cast<Raw*>(static_cast<const Raw*>(data))->octets;
}
Raw* make_raw(const ddsi_sertype* type, ddsi_serdata_kind kind, Octets octets = {0, 1, 0, 0}) {
  auto* const raw = new Raw;
  ddsi_serdata_init(raw, type, kind);
  raw->hash = type->serdata_basehash;
  octets.resize((octets.size() + 3) / 4 * 4);
  raw->octets = std::move(octets);
  return raw;
}

const ddsi_serdata_ops kRawOperations{
    .eqkey = [](const ddsi_serdata*, const ddsi_serdata*) { return true; },
    .get_size =
        [](const ddsi_serdata* data) { return static_cast<std::uint32_t>(octets_of(data).size()); },
    .from_ser = [](const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment,
                   std::size_t size) -> ddsi_serdata* {
      Octets octets(size);
      for (; fragment != nullptr; fragment = fragment->nextfrag) {
        std::memcpy(octets.data() + fragment->min,
                    NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment)),
                    fragment->maxp1 - fragment->min);
      }
      return make_raw(type, kind, octets);
    },
    .from_ser_iov = nullptr,
    .from_keyhash = [](const ddsi_sertype* type, const ddsi_keyhash*) -> ddsi_serdata* {
      return make_raw(type, SDK_KEY);
    },
    .from_sample = nullptr,
    .to_ser = [](const ddsi_serdata* data, std::size_t offset, std::size_t size,
                 void* buffer) { std::memcpy(buffer, octets_of(data).data() + offset, size); },
    .to_ser_ref =
        [](const ddsi_serdata* data, std::size_t offset, std::size_t size, ddsrt_iovec_t* part) {
          part->iov_base = octets_of(data).data() + offset;
          part->iov_len = size;
          return ddsi_serdata_ref(data);
        },
    .to_ser_unref = [](ddsi_serdata* data, const ddsrt_iovec_t*) { ddsi_serdata_unref(data); },
    .to_sample = nullptr,
    .to_untyped = [](const ddsi_serdata* data) -> ddsi_serdata* {
      Raw* const raw = make_raw(data->type, SDK_KEY);
      raw->type = nullptr;
      return raw;
    },
    .untyped_to_sample = [](const ddsi_sertype*, const ddsi_serdata*, void*, void**,
                            void*) { return true; },
    .free = [](ddsi_serdata* data) { delete static_cast<Raw*>(data); },
    .print = [](const ddsi_sertype*, const ddsi_serdata*, char* text, std::size_t) -> std::size_t {
      text[0] = '\0';
      return 0;
    },
    .get_keyhash = [](const ddsi_serdata*, ddsi_keyhash* hash,
                      bool) { std::memset(hash->value, 0, sizeof hash->value); },
    .get_sample_size = nullptr,
    .from_iox_buffer = nullptr,
};

const ddsi_sertype_ops kRawTypeOperations{
    .version = ddsi_sertype_v0,
    .arg = nullptr,
    .free =
        [](ddsi_sertype* type) {
          ddsi_sertype_fini(type);
          delete type;
        },
    .zero_samples = nullptr,
    .realloc_samples = nullptr,
    .free_samples = nullptr,
    .equal = [](const ddsi_sertype*, const ddsi_sertype*) { return true; },
    .hash = [](const ddsi_sertype*) -> std::uint32_t { return 0; },
    .type_id = nullptr,
    .type_map = nullptr,
    .type_info = nullptr,
    .derive_sertype = nullptr,
    .get_serialized_size = nullptr,
    .serialize_into = nullptr,
};

int checked(int code, const char* what) {
  if (code >= 0) return code;
  std::fprintf(stderr, "peer: %s: %s\n", what, dds_strretcode(code));
  std::exit(1);
}

std::string hex(const void* data, std::size_t size) {
  std::string text;
  char digits[3];
  for (std::size_t i = 0; i < size; ++i) {
    std::snprintf(digits, sizeof digits, "%02x", static_cast<const unsigned char*>(data)[i]);
    text += digits;
  }
  return text;
}

Octets from_hex(std::string_view text) {
  Octets octets;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2)
    octets.push_back(
        static_cast<unsigned char>(std::stoul(std::string{text.substr(i, 2)}, nullptr, 16)));
  return octets;
}

std::string user_data_of(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size)) return "";
  std::string text{static_cast<const char*>(data), size};
  dds_free(data);
  return text;
}

// One line of JSON for each thing seen; no text here needs escapes.
void print(const std::string& line) { std::cout << "{" << line << "}" << std::endl; }
std::string field(const std::string& name, const std::string& value) {
  return "\"" + name + "\": \"" + value + "\"";
}
std::string field(const std::string& name, std::int64_t value) {
  return "\"" + name + "\": " + std::to_string(value);
}

std::string qos_fields(const dds_qos_t* qos) {
  std::string text;
  const auto add = [&text](const std::string& name, std::int64_t value) {
    text += ", " + field(name, value);
  };
  dds_reliability_kind_t reliability{};
  dds_duration_t blocking{};
  if (dds_qget_reliability(qos, &reliability, &blocking)) {
    add("reliable", reliability == DDS_RELIABILITY_RELIABLE);
    add("max_blocking", blocking);
  }
  dds_durability_kind_t durability{};
  if (dds_qget_durability(qos, &durability)) add("durability", durability);
  dds_history_kind_t history{};
  std::int32_t depth{};
  if (dds_qget_history(qos, &history, &depth)) {
    add("keep_all", history == DDS_HISTORY_KEEP_ALL);
    add("depth", depth);
  }
  dds_duration_t cleanup{};
  std::int32_t limits[3]{};
  if (dds_qget_durability_service(qos, &cleanup, &history, &depth, &limits[0], &limits[1],
                                  &limits[2])) {
    add("service_cleanup", cleanup);
    add("service_keep_all", history == DDS_HISTORY_KEEP_ALL);
    add("service_depth", depth);
    add("service_limit", std::max({limits[0], limits[1], limits[2]}));
  }
  dds_duration_t duration{};
  if (dds_qget_deadline(qos, &duration)) add("deadline", duration);
  if (dds_qget_lifespan(qos, &duration)) add("lifespan", duration);
  dds_liveliness_kind_t liveliness{};
  if (dds_qget_liveliness(qos, &liveliness, &duration)) {
    add("manual_by_topic", liveliness == DDS_LIVELINESS_MANUAL_BY_TOPIC);
    add("lease", duration);
  }
  bool is_disposing = false;
  if (dds_qget_writer_data_lifecycle(qos, &is_disposing)) add("autodispose", is_disposing);
  dds_data_representation_id_t* representations = nullptr;
  std::uint32_t count = 0;
  if (dds_qget_data_representation(qos, &count, &representations)) {
    add("representations", count);
    if (count > 0) add("representation", representations[0]);
    dds_free(representations);
  }
  return text + ", " + field("user_data", user_data_of(qos));
}

class Peer {
 public:
  explicit Peer(dds_domainid_t domain) {
    dds_qos_t* const qos = dds_create_qos();
    dds_qset_userdata(qos, "enclave=/;", 10);
    participant_ = checked(dds_create_participant(domain, qos, nullptr), "participant");
    dds_delete_qos(qos);
    dds_get_guid(participant_, &own_);
    const auto built_in = [this](dds_entity_t topic) {
      return checked(dds_create_reader(participant_, topic, nullptr, nullptr), "built-in reader");
    };
    participants_ = built_in(DDS_BUILTIN_TOPIC_DCPSPARTICIPANT);
    endpoints_["pub"] = built_in(DDS_BUILTIN_TOPIC_DCPSPUBLICATION);
    endpoints_["sub"] = built_in(DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION);
  }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;
  ~Peer() { dds_delete(participant_); }

  void obey(const std::string& line) {
    std::istringstream words{line};
    std::string verb;
    std::string topic;
    std::string rest;
    words >> verb >> topic >> rest;
    if (verb == "write") {
      write(topic, from_hex(rest));
      return;
    }
    std::string policies;
    std::string user_data;
    words >> policies >> user_data;
    add(verb, topic, rest, policies, user_data);
  }

  void look() {
    look_at_participants();
    for (const auto& [kind, reader] : endpoints_)
      look_at_endpoints(kind, reader);
    for (const auto& [topic, reader] : readers_)
      look_at_samples(topic, reader);
  }

 private:
  struct Sending {
    dds_entity_t entity;
    ddsi_sertype* type;
  };

  // 0: the policy is not there.
  static dds_duration_t duration(const std::string& policies, const std::string& policy) {
    const auto at = policies.find(policy);
    return at == std::string::npos ? 0 : std::stoll(policies.substr(at + policy.size()));
  }

  void add(const std::string& kind, const std::string& topic, const std::string& type,
           const std::string& policies, const std::string& user_data) {
    const bool is_transient = policies.starts_with("transient_local");
    auto* sertype = new ddsi_sertype{};
    ddsi_sertype_init(sertype, type.c_str(), &kRawTypeOperations, &kRawOperations, true);
    sertype->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
    const dds_entity_t entity = checked(
        dds_create_topic_sertype(participant_, topic.c_str(), &sertype, nullptr, nullptr, nullptr),
        "topic");
    dds_qos_t* const qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_INFINITY);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, is_transient ? 1 : 100);
    if (is_transient) dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
    if (const auto deadline = duration(policies, "deadline=")) dds_qset_deadline(qos, deadline);
    if (const auto lease = duration(policies, "lease=")) {
      dds_qset_liveliness(qos,
                          policies.find("manual") == std::string::npos
                              ? DDS_LIVELINESS_AUTOMATIC
                              : DDS_LIVELINESS_MANUAL_BY_TOPIC,
                          lease);
    }
    if (!user_data.empty()) dds_qset_userdata(qos, user_data.data(), user_data.size());
    if (kind == "sub") {
      readers_[topic] = checked(dds_create_reader(participant_, entity, qos, nullptr), "reader");
    } else {
      writers_[topic] = {checked(dds_create_writer(participant_, entity, qos, nullptr), "writer"),
                         sertype};
    }
    dds_delete_qos(qos);
    print(field("did", kind) + ", " + field("topic", topic));
  }

  void write(const std::string& topic, const Octets& octets) {
    const Sending& writer = writers_.at(topic);
    const auto end = dds_time() + DDS_SECS(20);
    dds_publication_matched_status_t status{};
    while (status.current_count == 0 && dds_time() < end) {
      dds_get_publication_matched_status(writer.entity, &status);
      dds_sleepfor(DDS_MSECS(2));
    }
    checked(dds_writecdr(writer.entity, make_raw(writer.type, SDK_DATA, octets)), "write");
    print(field("did", "write") + ", " + field("topic", topic));
  }

  void look_at_participants() const {
    void* samples[1] = {nullptr};
    dds_sample_info_t info{};
    while (dds_take(participants_, samples, &info, 1, 1) > 0) {
      const auto* const seen = static_cast<const dds_builtintopic_participant_t*>(samples[0]);
      if (info.valid_data && std::memcmp(&seen->key, &own_, sizeof own_) != 0) {
        print(field("seen", "participant") + ", " + field("guid", hex(&seen->key, 16)) + ", " +
              field("user_data", user_data_of(seen->qos)));
      }
      dds_return_loan(participants_, samples, 1);
    }
  }

  void look_at_endpoints(const std::string& kind, dds_entity_t reader) const {
    void* samples[1] = {nullptr};
    dds_sample_info_t info{};
    while (dds_take(reader, samples, &info, 1, 1) > 0) {
      const auto* const seen = static_cast<const dds_builtintopic_endpoint_t*>(samples[0]);
      if (info.instance_state != DDS_IST_ALIVE) {
        print(field("gone", kind) + ", " + field("guid", hex(&seen->key, 16)));
      } else if (info.valid_data && std::memcmp(&seen->participant_key, &own_, sizeof own_) != 0) {
        print(field("seen", kind) + ", " + field("guid", hex(&seen->key, 16)) + ", " +
              field("participant", hex(&seen->participant_key, 16)) + ", " +
              field("topic", seen->topic_name) + ", " + field("type", seen->type_name) +
              qos_fields(seen->qos));
      }
      dds_return_loan(reader, samples, 1);
    }
  }

  static void look_at_samples(const std::string& topic, dds_entity_t reader) {
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info{};
    while (dds_takecdr(reader, &sample, 1, &info, DDS_ANY_STATE) > 0) {
      if (info.valid_data) {
        const Octets& octets = octets_of(sample);
        print(field("sample", topic) + ", " + field("bytes", hex(octets.data(), octets.size())));
      }
      ddsi_serdata_unref(sample);
    }
  }

  dds_entity_t participant_ = 0;
  dds_guid_t own_{};
  dds_entity_t participants_ = 0;
  std::map<std::string, dds_entity_t> endpoints_;
  std::map<std::string, dds_entity_t> readers_;
  std::map<std::string, Sending> writers_;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  Peer peer{static_cast<dds_domainid_t>(std::stoul(argv[1]))};
  std::string pending;
  for (;;) {
    pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    if (poll(&input, 1, 5) > 0) {
      char chunk[4096];
      const ssize_t size = read(STDIN_FILENO, chunk, sizeof chunk);
      if (size <= 0) return 0;
      pending.append(chunk, static_cast<std::size_t>(size));
    }
    for (std::size_t end = 0; (end = pending.find('\n')) != std::string::npos;) {
      peer.obey(pending.substr(0, end));
      pending.erase(0, end + 1);
    }
    peer.look();
  }
}
