// Exports a GNU unique symbol, which an inline variable of a template becomes, and uses it.
#include <cie/executor/component.hpp>

#include <iterator>

namespace container_test {

template <typename T>
struct Counter {
  static inline T value{};
};

class Unique {
 public:
  explicit Unique(const cie::ComponentOptions& options) : node_(options) { ++Counter<long>::value; }
  cie::Node& node() { return node_; }

 private:
  cie::Node node_;
};

constexpr cie::ComponentClass kClasses[] = {cie::component_class<Unique>("odd::Good")};
constexpr cie::ComponentLibrary kLibrary{.count = std::size(kClasses), .classes = kClasses};

}  // namespace container_test

extern "C" const cie::ComponentLibrary* cie_component_library() {
  return &container_test::kLibrary;
}
