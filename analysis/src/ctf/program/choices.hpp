// Which values of a tag or selector choose an option.
#pragma once

#include "ctf/metadata/types.hpp"
#include "program.hpp"
#include "program_writer.hpp"
#include "scope_names.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace cie::analysis::ctf {

// Makes values with a sign comparable as unsigned.
constexpr std::uint64_t bias_of(const Type& type) noexcept {
  return type.is_signed ? std::uint64_t{1} << 63U : 0;
}

// All that one tag can be must be alike: integers with or without a sign, or booleans. Throws
// MetadataError.
void check_selectors(const std::vector<ScopeNames*>& tags);

// Adds the choices of CTF 1.8 between `bodies`: ranges of `tag` whose label is an option's name. `out`
// counts them.
void add_labelled(Op& op, const Type& type, const Type& tag,
                  const std::vector<std::shared_ptr<const Sequence>>& bodies, ProgramWriter& out);

// Adds what CTF 2 says of `type`, a variant or optional, as choices between `bodies`, as far as a
// value of `tag` can be so.
void add_selections(Op& op, const Type& type, const Type& tag,
                    const std::vector<std::shared_ptr<const Sequence>>& bodies);

}  // namespace cie::analysis::ctf
