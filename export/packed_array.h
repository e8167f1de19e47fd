// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace subvol::internal {

/// Appends numbers of four bytes as JSON that export/viewer/data.js decodes: {"type", "size", "stride", "data"}.
///
/// The data are the differences (modulo 2^32, of the bits) from the number `stride` places before, then the first bytes
/// of all, the second, third and fourth, deflated, in base64.
void append_packed(std::string& json, std::span<const std::uint32_t> values, std::size_t stride);
void append_packed(std::string& json, std::span<const float> values, std::size_t stride);

}  // namespace subvol::internal
