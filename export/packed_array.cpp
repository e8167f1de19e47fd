// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/packed_array.h"

#include "subvol/base/base64.h"

#include <zlib.h>

#include <bit>
#include <new>
#include <stdexcept>

namespace subvol::internal {
namespace {

/// A level that takes half the time of zlib's default; the result is 3 % larger.
constexpr int kZlibLevel = 4;

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(result.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), kZlibLevel);
  if (status == Z_MEM_ERROR) throw std::bad_alloc();
  if (status != Z_OK) throw std::logic_error("zlib: a buffer of compressBound is too small");
  result.resize(size);
  return result;
}

template <class Bits>
void append(std::string& json, const char* type, std::size_t size, std::size_t stride, const Bits& bits) {
  std::string planes(4 * size, '\0');
  for (std::size_t i = 0; i < size; ++i) {
    const std::uint32_t difference = i < stride ? bits(i) : bits(i) - bits(i - stride);
    for (std::size_t k = 0; k < 4; ++k) planes[k * size + i] = static_cast<char>(difference >> (8 * k) & 0xff);
  }
  json += std::string("{\"type\":\"") + type + "\",\"size\":" + std::to_string(size) +
          ",\"stride\":" + std::to_string(stride) + ",\"data\":\"";
  append_base64(json, deflated(planes));
  json += "\"}";
}

}  // namespace

void append_packed(std::string& json, std::span<const std::uint32_t> values, std::size_t stride) {
  append(json, "u32", values.size(), stride, [&](std::size_t i) { return values[i]; });
}

void append_packed(std::string& json, std::span<const float> values, std::size_t stride) {
  append(json, "f32", values.size(), stride, [&](std::size_t i) { return std::bit_cast<std::uint32_t>(values[i]); });
}

}  // namespace subvol::internal
