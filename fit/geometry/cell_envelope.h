// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/geometry/barycentric.h"
#include "subvol/fit/simd/wide.h"

#include <cstdint>
#include <vector>

namespace subvol::internal {

/// Divides a convex polygon into the parts in which each of a set of linear functions is the lowest: the Voronoi cells
/// of nearby sites, if they are known to be few.
///
/// Each cell starts as the whole polygon and is cut by the functions found lowest at its corners, until none is lower
/// than its own. This is much cheaper than repeated cutting in two, because cells are not cut by the bisectors of
/// others. It is not safe if functions agree within rounding, so the areas are checked in the end.
class CellEnvelope {
 public:
  CellEnvelope() = default;
  CellEnvelope(const CellEnvelope&) = delete;
  CellEnvelope& operator=(const CellEnvelope&) = delete;

  struct Cell {
    int function;
    std::array<double, 6> moments;
  };

  /// Starts a new set of functions.
  void clear();
  /// Adds eight functions, given by their values at the triangle's corners; kNever at all corners means no function.
  /// `ranks` decide between equal functions: the lowest comes first.
  void add(const std::array<Wide, 3>& values, const std::array<std::int32_t, kWide>& ranks);
  static constexpr double kNever = 1e300;  // above every squared distance

  /// Finds the cells of a polygon.
  ///
  /// first   the function lowest at one of the polygon's corners; functions are numbered as they were added.
  /// noise   differences of functions below it count as rounding.
  /// returns true if the areas of the cells add up to the polygon's; if not (ties, or too many corners), another method
  ///         must be used.
  bool compute(std::span<const Barycentric> polygon, int first, double noise);
  const std::vector<Cell>& cells() const { return cells_; }

 private:
  // Polygons of more corners are left to the other method, which takes any number.
  static constexpr int kMaxCorners = 24, kMaxKnown = 7;
  struct Polygon {
    int size = 0;
    std::array<Barycentric, kMaxCorners> at;
    std::uint32_t checked = 0;  ///< bit i: no function is lower at corner i than that of the cell
  };
  struct Known {
    int count = 0;
    bool queued = false;
    std::array<int, kMaxKnown> neighbors;
  };
  using Block = std::array<Wide, 3>;
  enum class Cut { untouched, cut, empty, tie };

  Barycentric values(int function) const;
  Wide lowest(const Barycentric& at) const;
  int lowest_function(const Barycentric& at, double value) const;
  Cut cut(int inside, int outside);
  Cut find_cell(int function, std::span<const Barycentric> whole);
  void note_neighbors(int cell, int found);

  double noise_ = 0;
  std::vector<Block> blocks_;
  std::vector<std::int32_t> ranks_;
  std::vector<Known> known_;
  std::vector<int> queue_;
  std::vector<Cell> cells_;
  Polygon buffers_[2];
  Polygon* polygon_ = &buffers_[0];  ///< the cell so far
  Polygon* rest_ = &buffers_[1];     ///< the cell after the current cut
};

}  // namespace subvol::internal
