// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/base64.h"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>

namespace subvol::internal {

static_assert(std::endian::native == std::endian::little, "the arrays of a .vtu are written as they lie in memory");

/// The name of a number type in a .vtu.
template <class T>
constexpr const char* vtu_type();
template <>
constexpr const char* vtu_type<double>() {
  return "Float64";
}
template <>
constexpr const char* vtu_type<std::int32_t>() {
  return "Int32";
}
template <>
constexpr const char* vtu_type<std::int64_t>() {
  return "Int64";
}
template <>
constexpr const char* vtu_type<std::uint8_t>() {
  return "UInt8";
}

/// Appends a `<DataArray>` with its length in bytes and its numbers in base64. attributes: the name and any others.
template <class T>
void append_data_array(std::string& text, const std::string& attributes, std::span<const T> values) {
  const std::uint64_t size = values.size() * sizeof(T);
  std::string bytes(sizeof size + size, '\0');
  std::memcpy(bytes.data(), &size, sizeof size);
  if (size > 0) std::memcpy(bytes.data() + sizeof size, values.data(), size);
  text += std::string("        <DataArray type=\"") + vtu_type<T>() + "\" " + attributes + " format=\"binary\">";
  append_base64(text, bytes);
  text += "</DataArray>\n";
}

}  // namespace subvol::internal
