// Whether a document is well-formed XML, as far as Loopbench writes any.
#pragma once

#include "tests/standard.h"

namespace loopbench::harness {

/// Returns the first fault of an XML text: open tags or comments, bare ampersands, control
/// characters.
inline std::string FaultOfXml(const std::string& text) {
  static const std::regex known("&(amp|lt|gt|quot|#39|#9|#10|#13);");
  const auto fault_of_entities = [](const std::string& part) -> std::string {
    for (std::size_t i = part.find('&'); i != std::string::npos; i = part.find('&', i + 1)) {
      const std::string entity = part.substr(i, part.find(';', i) - i + 1);
      if (!std::regex_match(entity, known)) return "the entity " + entity;
    }
    return "";
  };
  std::vector<std::string> open;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (static_cast<unsigned char>(c) < ' ' && c != '\n') return "a control character";
    if (c == '&') {
      const std::string fault = fault_of_entities(text.substr(i, text.find(';', i) - i + 1));
      if (!fault.empty()) return fault;
    }
    if (c != '<') continue;
    if (text.compare(i, 4, "<!--") == 0) {
      i = text.find("--", i + 4);
      if (i == std::string::npos || text.compare(i, 3, "-->") != 0) return "a comment with --";
      continue;
    }
    const std::size_t end = text.find('>', i);
    if (end == std::string::npos) return "an open tag";
    const std::string tag = text.substr(i + 1, end - i - 1);
    if (tag.find('<') != std::string::npos) return "a tag within a tag";
    if (const std::string fault = fault_of_entities(tag); !fault.empty()) return fault;
    const std::string name = tag.substr(0, tag.find_first_of(" /\n", 1));
    if (tag.front() == '/') {
      if (open.empty() || "/" + open.back() != tag) return "the end of " + tag;
      open.pop_back();
    } else if (tag.back() != '/' && tag.front() != '?') {
      open.push_back(name);
    }
    i = end;
  }
  return open.empty() ? "" : "no end of " + open.back();
}

}  // namespace loopbench::harness
