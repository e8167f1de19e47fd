// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/vtu_reader.h"

#include <utility>

namespace subvol::internal {
namespace {

std::string_view attribute(std::string_view tag, const std::string& key) {
  const std::string opening = ' ' + key + "=\"";
  const std::size_t begin = tag.find(opening);
  if (begin == std::string_view::npos) return {};
  const std::string_view rest = tag.substr(begin + opening.size());
  return rest.substr(0, rest.find('"'));
}

}  // namespace

VtuArrays::VtuArrays(std::string name, std::string_view bytes, const std::string& version) : name_(std::move(name)) {
  require_no_utf16(name_, bytes);
  const std::size_t begin = bytes.find("<VTKFile");
  if (begin == std::string_view::npos || bytes.find("</VTKFile>") == std::string_view::npos)
    fail("expected a whole VTK XML file");
  // Everything that subvol does not write is reported in the same way: nobody should edit headers one by one until the
  // file is accepted.
  const auto refuse_foreign = [&](const std::string& found) {
    fail("another program has written this .vtu (" + found + "), and it holds no exact map of curved cells");
  };
  const std::string_view header = tag(bytes, begin);
  for (const auto& [key, expected] : {std::pair<const char*, std::string>{"type", "UnstructuredGrid"},
                                      {"version", version},
                                      {"byte_order", "LittleEndian"},
                                      {"header_type", "UInt64"}})
    if (attribute(header, key) != expected)
      refuse_foreign("its " + std::string(key) + " is " + in_quotes(attribute(header, key)) + ", not '" + expected +
                     "'");
  if (header.find("compressor") != std::string_view::npos) refuse_foreign("its arrays are compressed");
  for (std::size_t at = bytes.find("<DataArray", begin); at != std::string_view::npos;
       at = bytes.find("<DataArray", at + 1))
    add(bytes, at);
}

// No tag begins inside another, so searching for the ends of all tags together reads the file at most once.
std::string_view VtuArrays::tag(std::string_view bytes, std::size_t begin) const {
  const std::size_t end = bytes.find_first_of("<>", begin + 1);
  if (end == std::string_view::npos) fail("the file ends inside a tag");
  if (bytes[end] == '<') fail("a tag begins inside another: expected every < to have its >");
  return bytes.substr(begin, end - begin);
}

void VtuArrays::add(std::string_view bytes, std::size_t begin) {
  const std::string_view opening = tag(bytes, begin);
  const std::string_view content = bytes.substr(begin + opening.size() + 1);
  const std::string array(attribute(opening, "Name"));
  const Array found{attribute(opening, "type"), attribute(opening, "format"), content.substr(0, content.find('<'))};
  if (!arrays_.try_emplace(array, found).second) fail("expected one data array " + in_quotes(array) + ", found more");
}

}  // namespace subvol::internal
