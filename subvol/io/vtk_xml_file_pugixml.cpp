// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/vtk_xml_file.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"

#include <pugixml.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace subvol::internal {

VtkXmlFile::VtkXmlFile(const std::string& name, std::string_view bytes, const char* type)
    : name_(name), type_(type), document_(std::make_unique<pugi::xml_document>()) {
  require_no_utf16(name, bytes);
  // Cuts the appended data off, which need not be XML, and parses the rest.
  constexpr std::string_view kAppended = "<AppendedData";
  const std::size_t begin = bytes.find(kAppended);
  text_ = std::string(bytes.substr(0, begin));
  if (begin != std::string_view::npos) {
    const std::size_t end = bytes.find('>', begin), start = bytes.find('_', std::min(end, bytes.size()));
    if (end == std::string_view::npos || start == std::string_view::npos)
      fail("AppendedData: expected an underscore before the data");
    storage_.appended_base64 = bytes.substr(begin, end - begin).find("base64") != std::string_view::npos;
    storage_.appended = bytes.substr(start + 1);
    text_ += "</VTKFile>";
  }
  const pugi::xml_parse_result result =
      document_->load_buffer_inplace(text_.data(), text_.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!result) {
    const auto line =
        std::count(bytes.begin(), bytes.begin() + std::min<std::ptrdiff_t>(result.offset, text_.size()), '\n') + 1;
    throw InputError(name_ + ":" + std::to_string(line) + ": not whole XML: " + result.description());
  }
  const pugi::xml_node file = document_->child("VTKFile");
  if (!file) fail("expected the element VTKFile");
  const std::string found = file.attribute("type").value(), order = file.attribute("byte_order").value(),
                    header = file.attribute("header_type").value();
  if (found != type_) fail("expected the type " + type_ + ", found " + in_quotes(found));
  const auto version = parse_number(file.attribute("version").as_string("0.1"));
  if (!version || *version < 0 || *version > 2.2) fail("expected version 0.1 to 2.2 of VTK XML");
  old_numbers_ = *version < 2.1;
  if (order == "BigEndian")
    storage_.endian = std::endian::big;
  else if (!order.empty() && order != "LittleEndian")
    fail("unknown byte_order " + in_quotes(order));
  if (header == "UInt64")
    storage_.header = kUInt64;
  else if (!header.empty() && header != "UInt32")
    fail("unknown header_type " + in_quotes(header));
  storage_.compressor = file.attribute("compressor").value();
  if (!grid()) fail("expected the element " + type_);
}

VtkXmlFile::~VtkXmlFile() = default;

void VtkXmlFile::fail(const std::string& what) const { throw InputError(name_ + ": " + what); }

pugi::xml_node VtkXmlFile::grid() const { return document_->child("VTKFile").child(type_.c_str()); }

VtkXmlArray VtkXmlFile::described(const pugi::xml_node& array) {
  return {array.attribute("Name").value(), array.attribute("type").value(), array.attribute("format").value(),
          array.child_value(), array.attribute("offset").value()};
}

std::vector<double> VtkXmlFile::values(const pugi::xml_node& array) const {
  try {
    return decode_vtk_xml_array(described(array), storage_);
  } catch (const InputError& error) {
    fail(error.what());
  }
}

std::vector<std::int64_t> VtkXmlFile::whole_numbers(const pugi::xml_node& parent, const char* array) const {
  const pugi::xml_node node = parent.find_child_by_attribute("DataArray", "Name", array);
  if (!node) fail(std::string(parent.name()) + ": expected an array " + array);
  std::vector<std::int64_t> numbers;
  for (const double value : values(node)) {
    if (value != std::floor(value) || std::abs(value) > 1e15) fail(std::string(array) + ": expected whole numbers");
    numbers.push_back(static_cast<std::int64_t>(value));
  }
  return numbers;
}

std::size_t VtkXmlFile::append_points(const pugi::xml_node& piece, std::vector<Vec3>& points) const {
  const std::size_t count = claimed(piece, "NumberOfPoints");
  const std::vector<double> numbers = values(piece.child("Points").child("DataArray"));
  if (numbers.size() != 3 * count || numbers.size() / 3 != count)
    fail("Points: expected three coordinates for each of " + std::to_string(count) + " points, found " +
         std::to_string(numbers.size()) + " numbers");
  if (points.size() + count > static_cast<std::size_t>(std::numeric_limits<Index>::max()))
    fail("Points: more points than an index can tell");
  for (std::size_t i = 0; i < count; ++i) {
    points.emplace_back(&numbers[3 * i]);
    if (!points.back().allFinite()) fail("point " + std::to_string(i) + " has a coordinate that is not finite");
  }
  return count;
}

std::size_t VtkXmlFile::claimed(const pugi::xml_node& piece, const char* attribute) const {
  const unsigned long long count = piece.attribute(attribute).as_ullong();
  if (count > static_cast<unsigned long long>(std::numeric_limits<Index>::max()))
    fail(std::string(attribute) + ": expected at most 2^31 - 1, found " + piece.attribute(attribute).value());
  return static_cast<std::size_t>(count);
}

}  // namespace subvol::internal
