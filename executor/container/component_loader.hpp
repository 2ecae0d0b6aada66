// A component and the shared object it comes from.
#pragma once

#include <cie/executor/component.hpp>

#include <memory>
#include <string>

namespace cie::container {

// A shared object opened with RTLD_NOW | RTLD_LOCAL.
class Library {
 public:
  // Throws std::runtime_error with the dynamic linker's reason.
  explicit Library(const std::string& name);
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  ~Library();

  // The class of this name. Throws std::runtime_error when the library has no
  // cie_component_library(), was built for another version of it, or has no such class.
  const ComponentClass& find_class(const std::string& class_name) const;
  const std::string& name() const noexcept { return name_; }

 private:
  std::string name_;
  void* handle_ = nullptr;
};

// Exceptions of the component leave here as std::runtime_error of their text, because their own type
// may be the library's.
class LoadedComponent {
 public:
  // Throws std::runtime_error; nothing is left of the component then.
  LoadedComponent(const std::string& library, const std::string& class_name,
                  const ComponentOptions& options);

  Node& node() const { return class_->node(component_.get()); }
  const std::string& library() const noexcept { return library_->name(); }
  const std::string& class_name() const noexcept { return class_name_; }

 private:
  std::string class_name_;
  std::unique_ptr<Library> library_;
  const ComponentClass* class_ = nullptr;
  std::unique_ptr<void, void (*)(void*) noexcept> component_{nullptr, nullptr};
};

}  // namespace cie::container
