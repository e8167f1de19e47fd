// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

namespace subvol::internal {

/// Storage format of a number in a binary file.
struct ValueType {
  enum class Class { real, whole, natural };
  std::size_t size;  ///< bytes: 1, 2, 4 or 8; a real has 4 or 8
  Class values;
  constexpr bool is_real() const { return values == Class::real; }
  friend bool operator==(const ValueType&, const ValueType&) = default;
};

inline constexpr ValueType kFloat32 = {4, ValueType::Class::real}, kFloat64 = {8, ValueType::Class::real};
inline constexpr ValueType kInt8 = {1, ValueType::Class::whole}, kUInt8 = {1, ValueType::Class::natural};
inline constexpr ValueType kInt16 = {2, ValueType::Class::whole}, kUInt16 = {2, ValueType::Class::natural};
inline constexpr ValueType kInt32 = {4, ValueType::Class::whole}, kUInt32 = {4, ValueType::Class::natural};
inline constexpr ValueType kInt64 = {8, ValueType::Class::whole}, kUInt64 = {8, ValueType::Class::natural};

/// Returns the first type.size bytes as the bits of a number; those of whole numbers are extended by their sign.
inline std::uint64_t decode_bits(const char* bytes, ValueType type, std::endian order) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < type.size; ++i) {
    const std::size_t at = order == std::endian::big ? i : type.size - 1 - i;
    bits = bits << 8 | static_cast<unsigned char>(bytes[at]);
  }
  if (type.values != ValueType::Class::whole) return bits;
  const int unused_bits = 64 - 8 * static_cast<int>(type.size);
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(bits << unused_bits) >> unused_bits);
}

/// Returns the number in the first type.size bytes. Whole numbers beyond 2^53 are rounded.
inline double decode(const char* bytes, ValueType type, std::endian order) {
  const std::uint64_t bits = decode_bits(bytes, type, order);
  if (type.is_real())
    return type.size == 4 ? std::bit_cast<float>(static_cast<std::uint32_t>(bits)) : std::bit_cast<double>(bits);
  if (type.values == ValueType::Class::natural) return static_cast<double>(bits);
  return static_cast<double>(static_cast<std::int64_t>(bits));
}

}  // namespace subvol::internal
