// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/binary_value.h"

#include <bit>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::internal {

/// How the arrays of a VTK XML file are stored.
struct VtkXmlStorage {
  std::endian endian = std::endian::little;
  ValueType header = kUInt32;  ///< type of the lengths before binary data
  std::string compressor;      ///< vtkZLibDataCompressor, vtkLZ4DataCompressor, or empty
  std::string_view appended;   ///< what follows the underscore of AppendedData; base64 if `appended_base64`
  bool appended_base64 = false;
};

/// One data array before it is decoded.
struct VtkXmlArray {
  std::string name, type, format;
  std::string_view text;  ///< content of the element
  std::string offset;     ///< attribute of an array of the appended data
};

/// Decodes a data array: numbers in text, base64 or raw, compressed or not.
///
/// InputError, without the file's name: an unknown type, format or compressor, data cut short, a length that the data
/// cannot have, numbers in text that are none. Memory: a small multiple of the size of the file times the largest ratio
/// of the compressor (about 1000 for zlib, 255 for LZ4).
std::vector<double> decode_vtk_xml_array(const VtkXmlArray& array, const VtkXmlStorage& storage);

}  // namespace subvol::internal
