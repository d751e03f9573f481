// Whether text is XML, by Expat.
#pragma once
#include <expat.h>

#include <memory>
#include <string>

namespace parian::test {

/// What is wrong with the text, and where; empty if it is well-formed.
inline std::string xml_problem(const std::string& text) {
  const std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser(XML_ParserCreate("UTF-8"), &XML_ParserFree);
  if (XML_Parse(parser.get(), text.data(), static_cast<int>(text.size()), XML_TRUE) == XML_STATUS_OK) return {};
  return "line " + std::to_string(XML_GetCurrentLineNumber(parser.get())) + ", column " +
         std::to_string(XML_GetCurrentColumnNumber(parser.get())) + ": " +
         XML_ErrorString(XML_GetErrorCode(parser.get()));
}

}  // namespace parian::test
