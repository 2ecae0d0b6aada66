#include "vocabulary.hpp"

namespace cie::analysis {
namespace {

void procname(const Payload& p, VocabularyState&, EventBody& body) {
  body.emplace<ProcessName>() = {.name = p.text(0)};
}

}  // namespace

const std::vector<Translation>& lttng_vocabulary() {
  static const std::vector<Translation> table{
      {"lttng_ust_statedump:procname", {"procname"}, procname}};
  return table;
}

}  // namespace cie::analysis
