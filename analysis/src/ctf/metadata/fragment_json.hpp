// The JSON of CTF 2 metadata: a text sequence (RFC 7464) of objects, with bounded size and depth,
// and their properties.
#pragma once

#include "tokens.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace cie::analysis::ctf {

using Json = nlohmann::json;

// Passes every object on, with its number from 1 on. Throws MetadataError when one is cut, no JSON,
// too large or nested too deeply; what was passed on before then is whole.
void each_fragment(std::string_view sequence,
                   const std::function<void(std::size_t number, const Json& fragment)>& take);

// Properties. All throw MetadataError when a property is of another kind than asked for, or missing
// although there is no default.
const Json* find_property(const Json& object, const char* name);  // null: it is not there
const Json& property(const Json& object, const char* name);
std::string text_property(const Json& object, const char* name);
std::string text_property(const Json& object, const char* name, const char* absent);
std::uint64_t unsigned_property(const Json& object, const char* name);
std::uint64_t unsigned_property(const Json& object, const char* name, std::uint64_t absent);
std::int64_t signed_property(const Json& object, const char* name, std::int64_t absent);
// Null if it is not there.
const Json* array_property(const Json& object, const char* name);
const Json* object_property(const Json& object, const char* name);

// An integer of either sign. Throws MetadataError if it is none, or beyond 64 bits.
__extension__ using WideInteger = __int128;
WideInteger integer_of(const Json& value);

// Extensions change the format: none is known, so none may be there.
void refuse_extensions(const Json& object);

}  // namespace cie::analysis::ctf
