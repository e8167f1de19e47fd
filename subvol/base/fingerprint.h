// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace subvol::internal {

/// 64-bit hash (FNV-1a) that tells data apart: it detects changed files and mistaken inputs, not forgeries. It depends
/// on the order of the added values, on the lengths of arrays and on how this machine stores numbers.
class Fingerprint {
 public:
  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T> Fingerprint& add(T value) { return mix(&value, sizeof value); }
  /// Adds the length and the bytes of an array, whose values must have no padding.
  template <class T>
  Fingerprint& add(std::span<const T> values) {
    add(values.size());
    return mix(values.data(), values.size_bytes());
  }
  Fingerprint& add(std::string_view text) { return add(std::span<const char>(text)); }

  std::uint64_t value() const { return hash_; }
  /// Returns the value as 16 hexadecimal digits.
  std::string text() const {
    std::string digits;
    for (int shift = 60; shift >= 0; shift -= 4) digits += "0123456789abcdef"[(hash_ >> shift) & 15];
    return digits;
  }

 private:
  Fingerprint& mix(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) hash_ = (hash_ ^ bytes[i]) * 0x100000001b3u;
    return *this;
  }

  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

}  // namespace subvol::internal
