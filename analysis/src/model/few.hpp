// Pointers of which there is mostly one, and often none.
#pragma once

#include <cie/analysis/rare.hpp>

#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

namespace cie::analysis {

// A series of pointers that are not null. The first lies here, where std::vector would look for it in
// memory of its own; with a second all of them move there.
template <typename Pointer>
class Few {
 public:
  bool empty() const noexcept { return size() == 0; }
  std::size_t size() const noexcept {
    if (many_) return many_->size();
    return one_ != nullptr ? 1 : 0;
  }
  Pointer* begin() noexcept { return many_ ? many_->data() : &one_; }
  Pointer* end() noexcept { return begin() + size(); }
  const Pointer* begin() const noexcept { return many_ ? many_->data() : &one_; }
  const Pointer* end() const noexcept { return begin() + size(); }
  auto rbegin() noexcept { return std::reverse_iterator(end()); }
  auto rend() noexcept { return std::reverse_iterator(begin()); }
  auto rbegin() const noexcept { return std::reverse_iterator(end()); }
  auto rend() const noexcept { return std::reverse_iterator(begin()); }
  // Only where there is one.
  Pointer& front() noexcept { return *begin(); }
  Pointer& back() noexcept { return *(end() - 1); }
  const Pointer& front() const noexcept { return *begin(); }
  const Pointer& back() const noexcept { return *(end() - 1); }

  void push_back(Pointer pointer) {
    if (many_) {
      many_->push_back(std::move(pointer));
    } else if (one_ == nullptr) {
      one_ = std::move(pointer);
    } else {
      auto& many = many_.emplace();
      many.push_back(std::exchange(one_, nullptr));
      many.push_back(std::move(pointer));
    }
  }
  // Returns where the next one is.
  Pointer* erase(const Pointer* place) noexcept {
    if (many_) {
      const auto index = place - many_->data();
      many_->erase(many_->begin() + index);
      return many_->data() + index;
    }
    one_ = nullptr;
    return end();
  }
  // It may be among them.
  void remove(const Pointer& pointer) noexcept {
    if (many_) {
      std::erase(*many_, pointer);
    } else if (one_ == pointer) {
      one_ = nullptr;
    }
  }
  void clear() noexcept {
    one_ = nullptr;
    many_.reset();
  }

 private:
  Pointer one_{};
  Rare<std::vector<Pointer>> many_;
};

}  // namespace cie::analysis
