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

// Code of the component runs on threads that end before the library is closed: a thread_local with
// a destructor would otherwise keep it mapped. Exceptions of the component leave here as
// std::runtime_error of their text, because their own type may be the library's.
class LoadedComponent {
 public:
  // Throws std::runtime_error; nothing is left of the component then.
  LoadedComponent(const std::string& library, const std::string& class_name,
                  const ComponentOptions& options);
  LoadedComponent(const LoadedComponent&) = delete;
  LoadedComponent& operator=(const LoadedComponent&) = delete;
  ~LoadedComponent();

  // Destroys the component and closes its library. Empty if the library was unmapped, else why not.
  std::string unload();

  Node& node() const { return class_->node(component_); }
  const std::string& library() const noexcept { return library_->name(); }
  const std::string& class_name() const noexcept { return class_name_; }

 private:
  void destroy() noexcept;

  std::string class_name_;
  std::unique_ptr<Library> library_;
  const ComponentClass* class_ = nullptr;
  void* component_ = nullptr;
};

}  // namespace cie::container
