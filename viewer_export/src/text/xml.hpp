// Text in XML 1.0 documents.
#pragma once

#include <string>
#include <string_view>

namespace cie::viewer_export {

// For element content and for attributes in double quotes: markup is escaped, line breaks and tabs
// survive an attribute's normalisation, everything else is printable(), which XML can hold.
// https://www.w3.org/TR/xml/#charsets
std::string xml_escaped(std::string_view text);

}  // namespace cie::viewer_export
