// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/region_surface.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/templates/search_stop.h"
#include "subvol/templates/voxel_topology.h"

#include <array>
#include <functional>
#include <map>
#include <span>
#include <vector>

namespace subvol::internal {

/// What is true of the faces between two regions as a surface.
struct SheetTopology {
  int components = 0;    ///< connected through edges
  int euler_number = 0;  ///< vertices - edges + faces
  friend bool operator==(const SheetTopology&, const SheetTopology&) = default;
};

/// The topology of all regions, by place from 0 on, and of the sheets between two of them or one and the outside (0),
/// by place + 1.
struct RegionTopology {
  std::vector<BettiNumbers> regions;
  std::map<std::array<int, 2>, SheetTopology> sheets;
};

/// Finds the topology of a surface's regions, in the order of `RegionSurface::regions`. InputError: as
/// `solid_boundary`.
/// stop  if given and stopped, the work ends early; the result then means nothing.
RegionTopology topology_of(const RegionSurface& surface, SearchStop* stop = nullptr);

/// Returns the topology of each sheet. faces: corners of each, 3 or 4; kNoIndex for those that a triangle lacks.
/// sheet_of_face: key of each.
std::map<std::array<int, 2>, SheetTopology> topology_of_sheets(std::span<const std::array<Index, 4>> faces,
                                                               std::span<const std::array<int, 2>> sheet_of_face);

/// A grid of cells each of which belongs to one of several regions, or to the outside (label 0).
class VoxelLabels {
 public:
  /// cells  number along each axis, >= 3; those on the grid's outer layer stay outside.
  /// rule   for the cells of each region around a lattice point; the outside need only be manifold.
  VoxelLabels(const std::array<int, 3>& cells, int num_regions, VertexRule rule);

  int label(Index cell) const { return labels_[cell]; }
  std::span<const int> labels() const { return labels_; }
  int num_regions() const { return num_regions_; }
  bool may_set(Index cell) const { return frame_.may_flip(cell); }
  void set(Index cell, int label) { labels_[cell] = label; }
  std::size_t num_cells() const { return labels_.size(); }
  std::size_t num_points() const { return frame_.num_points(); }
  std::array<Index, 8> points(Index cell) const { return frame_.points(cell); }
  std::array<Index, 8> cells_around(Index point) const { return frame_.cells_around(point); }
  const std::array<Index, 26>& all_offsets() const { return frame_.all_offsets(); }
  const std::array<Index, 6>& face_offsets() const { return frame_.face_offsets(); }

  /// Returns true if the cells of each label around a point satisfy its rule.
  bool good(Index point) const;
  /// Increase in the number of good points if a cell got another label.
  int good_gain(Index cell, int label);
  /// Returns true if another label for a cell leaves all its points good, and every union of regions unchanged up to
  /// deformation: then no sheet between two of them appears, vanishes or changes its topology.
  bool is_simple(Index cell, int label);

  /// Numbers the face-connected components of the cells with a label; -1 for others. Returns their number.
  int components(int label, std::vector<int>& component) const;
  /// Numbers those of all labels.
  int components(std::vector<int>& component) const;
  /// All points must be good. stop: if given and stopped, the work ends early; the result then means nothing.
  RegionTopology topology(SearchStop* stop = nullptr) const;

 private:
  /// Gives a number to the cells that are connected with one, and have its label. stack: for its own use.
  void flood(Index seed, int number, std::vector<int>& component, std::vector<Index>& stack) const;

  std::array<int, 3> cells_;
  int num_regions_;
  const std::array<bool, 256>*region_table_, *outside_table_;
  VoxelSolid frame_;  ///< empty: for numbers of points and neighbors
  std::vector<int> labels_;
};

/// Share of each region in each cell, by region from 1 on and cell; entry 0 is that of the outside.
using LabelFractions = std::vector<std::vector<double>>;

/// Changes the labels of single cells, each time the one that improves most, until all points are good: the number of
/// good points counts, and then by how much `share` rises. Returns false if that is not reached.
///
/// share    of a label in a cell, in [0, 1].
/// changes  number of changes so far, by cell: no more than four.
bool make_points_good(VoxelLabels& labels, const std::function<double(int label, Index cell)>& share,
                      std::vector<char>& changes, SearchStop* stop = nullptr);

/// Gives each cell the label with the largest share, times the label's weight, and then repairs bad points and drops
/// surplus components. Returns false if some points stay bad or too few components are there.
///
/// weights  of the regions, >= 1, entry 0 being unused: cells belong to the solid if the weighted shares of regions
///          outweigh that of the outside. Weights above 1 keep layers whole that are thinner than a cell.
/// wanted   regions; voids: number of components of the outside.
bool assign_labels(VoxelLabels& labels, const LabelFractions& fractions, std::span<const double> weights,
                   const RegionTopology& wanted, int voids, SearchStop* stop);

/// Gives cells the labels of largest share, those of the largest gain first, as long as the topology stays the same.
void evolve(VoxelLabels& labels, const LabelFractions& fractions, SearchStop* stop);

}  // namespace subvol::internal
