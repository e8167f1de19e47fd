// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>

namespace subvol {

/// Foretells whether the next part of a fit, a level or an order, fits into the memory that the process may take.
///
/// A part takes memory about in proportion to its size (cells, or nodes of curved ones):
///
///   expected = held now + kMemoryOfAnyPart + rate * size
///
/// The rate is a bound found by measuring, or what the part before took where that was more.
class MemoryBudget {
 public:
  /// limit_bytes  of the process; 0: none.
  /// rate         bytes for each cell or node, at least.
  MemoryBudget(double limit_bytes, double rate) : limit_(limit_bytes), rate_(rate) {}

  /// Whether a part of this size may begin; the one before has ended then.
  bool allows(std::size_t size);
  /// "level 3 would take about 900 MB of memory, the limit is 500 MB", of what was last asked for.
  std::string refusal(const std::string& part) const;

 private:
  double limit_, rate_, expected_ = 0;
  double held_ = 0, size_ = 0;  ///< when the last part began
};

/// Memory that a part takes whatever its size: samples of the target, search trees (30 MB were measured).
inline constexpr double kMemoryOfAnyPart = 40e6;
/// For each hex of a level: 3.8 to 4.7 kB were measured from 40 000 to 360 000 cells.
inline constexpr double kMemoryOfLevelCell = 6e3;
/// For each node of curved cells: 5 to 8 kB were measured from order 4 to order 8.
inline constexpr double kMemoryOfNode = 8e3;

}  // namespace subvol
