#include <cie/executor/component.hpp>

#include <utility>

namespace cie {

ComponentOptions::ComponentOptions(const Context& context, std::string name, std::string name_space,
                                   Parameters parameters, Remaps remaps)
    : context_(&context),
      name_(std::move(name)),
      name_space_(std::move(name_space)),
      parameters_(std::move(parameters)),
      remaps_(std::move(remaps)) {}

Node::Node(const ComponentOptions& options)
    : Node(options.context(), options.name(), options.name_space(), options.remaps(),
           options.parameters()) {}

ParameterValue ComponentOptions::read(std::string_view name, ParameterValue absent) const {
  const auto text = parameters_.find(name);
  ParameterValue value = text == parameters_.end()
                             ? std::move(absent)
                             : parse_parameter(name, text->second, kind_of(absent));
  read_.insert_or_assign(std::string{name}, value);
  return value;
}

}  // namespace cie
