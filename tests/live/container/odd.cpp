// Components as they should not be, and one that is as it should.
#include <cie/executor/component.hpp>

#include <chrono>
#include <iterator>
#include <stdexcept>
#include <string>

namespace {

// An exception whose type is this library's.
class OddError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Good {
 public:
  explicit Good(const cie::ComponentOptions& options) : node_(options) {
    node_.create_wall_timer(std::chrono::milliseconds{50}, [] {});
  }
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
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
    node_.create_wall_timer(std::chrono::milliseconds{10}, [] { throw OddError{"odd"}; });
  }
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

constexpr cie::ComponentClass kClasses[] = {
    cie::component_class<Good>("odd::Good"),
    cie::component_class<ThrowsInConstructor>("odd::ThrowsInConstructor"),
    cie::component_class<ThrowsInCallback>("odd::ThrowsInCallback"),
    cie::component_class<NamesItselfOtherwise>("odd::NamesItselfOtherwise"),
};
constexpr cie::ComponentLibrary kLibrary{.count = std::size(kClasses), .classes = kClasses};

}  // namespace

extern "C" const cie::ComponentLibrary* cie_component_library() { return &kLibrary; }
