// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

namespace subvol::internal {

/// Bytes that a part takes regardless of its size, for samples of the target and search trees (30 MB were measured).
inline constexpr double kMemoryOfAnyPart = 40e6;
/// Bytes per hex of a level; 3.8 to 4.7 kB were measured from 40 000 to 360 000 cells.
inline constexpr double kMemoryOfLevelCell = 6e3;
/// Bytes per node of curved cells; 5 to 8 kB were measured from order 4 to order 8.
inline constexpr double kMemoryOfNode = 8e3;

/// Predicts if the next part of a fit, a level or an order, fits into the memory that the process may use.
///
/// A part takes memory roughly in proportion to its size (number of cells, or of nodes of curved cells):
///
///   expected = held now + fixed + rate * size
///
/// Both figures start at measured bounds. What the first part takes beyond them is fixed if its size is small: large
/// targets take memory at any size. What a larger or later part takes beyond them raises the rate.
class MemoryBudget {
 public:
  /// limit_bytes  limit for the process; 0: no limit.
  /// rate         least number of bytes per cell or node.
  MemoryBudget(double limit_bytes, double rate) : limit_(limit_bytes), rate_(rate) {}

  /// Returns true if a part of this size may begin. The previous part must have ended.
  bool allows(std::size_t size);
  /// Returns a message about the last size asked for: "level 3 would take about 900 MB of memory, the limit is 500 MB".
  std::string refusal(const std::string& part) const;

 private:
  double limit_, rate_, expected_ = 0;
  double fixed_ = kMemoryOfAnyPart;        ///< bytes of a part whatever its size
  double held_ = 0, peak_ = 0, size_ = 0;  ///< values at the start of the last part; size 0: none has begun
  bool is_first_ = true;                   ///< the last part was the first one
};

}  // namespace subvol::internal
