// A component of somebody else, loaded by the installed cie-run.
#include <cie/executor/component.hpp>

#include <chrono>
#include <cstdint>
#include <iterator>
#include <memory>

namespace {

class Ticker {
 public:
  explicit Ticker(const cie::ComponentOptions& options) : node_(options) {
    const std::chrono::milliseconds period{options.parameter<std::int64_t>("period_ms", 10)};
    timer_ = node_.create_wall_timer(period, [] {});
  }
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
  std::shared_ptr<cie::Timer> timer_;
};

constexpr cie::ComponentClass kClasses[] = {cie::component_class<Ticker>("outside::Ticker")};
constexpr cie::ComponentLibrary kLibrary{.count = std::size(kClasses), .classes = kClasses};

}  // namespace

extern "C" const cie::ComponentLibrary* cie_component_library() { return &kLibrary; }
