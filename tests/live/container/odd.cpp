// Components as they should not be, and one that is as it should.
#include <cie/executor/component.hpp>

#include <chrono>
#include <cstdint>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

// An exception whose type is this library's.
class OddError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

[[noreturn]] void never_return() {
  while (true)
    std::this_thread::sleep_for(std::chrono::hours{1});
}

class Good {
 public:
  explicit Good(const cie::ComponentOptions& options) : node_(options) {
    timer_ = node_.create_wall_timer(std::chrono::milliseconds{50}, [] {});
  }
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
  std::shared_ptr<cie::Timer> timer_;
};

class ThrowsInConstructor {
 public:
  explicit ThrowsInConstructor(const cie::ComponentOptions& options) : node_(options) {
    throw OddError{"no lidar is connected"};
  }
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
};

class ThrowsInCallback {
 public:
  explicit ThrowsInCallback(const cie::ComponentOptions& options) : node_(options) {
    timer_ = node_.create_wall_timer(std::chrono::milliseconds{10}, [] { throw OddError{"odd"}; });
  }
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
  std::shared_ptr<cie::Timer> timer_;
};

class NeverLoads {
 public:
  explicit NeverLoads(const cie::ComponentOptions& options) : node_(options) { never_return(); }
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
};

class NamesItselfOtherwise {
 public:
  explicit NamesItselfOtherwise(const cie::ComponentOptions& options)
      : node_(options.context(), "somebody_else") {}
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
};

class Tunable {
 public:
  explicit Tunable(const cie::ComponentOptions& options)
      : frame_(options.parameter<std::string>("frame", "base")), node_(options) {
    node_.declare_parameter<std::int64_t>(
        "rate", 2, {.description = "per second", .integer_range = cie::IntegerRange{1, 10, 0}});
    node_.declare_parameter("gain.x", 1.0);
    handle_ = node_.add_on_set_parameters_callback([](const std::vector<cie::Parameter>& all) {
      const bool is_five = all.front().value == cie::ParameterValue{std::int64_t{5}};
      if (all.front().value == cie::ParameterValue{std::int64_t{6}}) never_return();
      return cie::SetParametersResult{.is_successful = !is_five,
                                      .reason = is_five ? "five is right out" : ""};
    });
  }
  cie::Node& node() { return node_; }

 private:
  std::string frame_;
  cie::Node node_;
  std::shared_ptr<void> handle_;
};

constexpr cie::ComponentClass kClasses[] = {
    cie::component_class<Tunable>("odd::Tunable"),
    cie::component_class<Good>("odd::Good"),
    cie::component_class<ThrowsInConstructor>("odd::ThrowsInConstructor"),
    cie::component_class<ThrowsInCallback>("odd::ThrowsInCallback"),
    cie::component_class<NamesItselfOtherwise>("odd::NamesItselfOtherwise"),
    cie::component_class<NeverLoads>("odd::NeverLoads"),
};
constexpr cie::ComponentLibrary kLibrary{.count = std::size(kClasses), .classes = kClasses};

}  // namespace

extern "C" const cie::ComponentLibrary* cie_component_library() { return &kLibrary; }
