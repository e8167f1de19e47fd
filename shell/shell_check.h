// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/certificate/certificate.h"
#include "shell/shell_layers.h"

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace subvol {

/// What keeps a shell from being one.
struct ShellFailures {
  CertificateSummary certificate;
  /// Faces that meet improperly, numbers in `ShellCheck::polygons()`, smaller first, ascending. A face without area
  /// makes a pair with itself.
  std::vector<std::array<Index, 2>> intersecting;
  bool is_complete = true;  ///< false: the search for pairs was ended, by the caller or as in `self_intersections`
  bool none() const { return is_complete && certificate.all_certified() && intersecting.empty(); }
};

/// Which sheets are looked at for intersections. With all cells certified the two outer ones decide for all: a map that
/// is injective on the boundary of what it maps, and near every point, is so everywhere.
enum class CheckedSheets { outer, all };

/// Tells whether a shell is valid: every cell certified, and no face of a sheet or of a wall along the border meeting
/// another.
///
/// Triangles stand for themselves, quads (walls among them) for their `fan_triangles`, the same on all sheets.
class ShellCheck {
 public:
  /// layers, cells  must outlive the check.
  /// surface_moves  whether faces of the surface itself concern the strands that stand on them.
  ShellCheck(const ShellLayers& layers, const VolumeMesh& cells, CheckedSheets sheets, bool surface_moves = false);

  /// positions  one per vertex of the cells. Exact but for what quads mean; same answer for any number of threads.
  /// cancelled  ends the search for pairs: as in `self_intersections`.
  ShellFailures failures(std::span<const Vec3> positions, const std::function<bool()>& cancelled = {}) const;

  /// Strands of the cells and faces concerned, ascending.
  std::vector<Index> strands(const ShellFailures& failures) const;

  const PolygonMesh& polygons() const { return polygons_; }

 private:
  const ShellLayers& layers_;
  const VolumeMesh& cells_;
  PolygonMesh polygons_;
  bool surface_moves_;
};

/// The strands that each node of a shell goes with. The nodes of linear cells are their vertices: a vertex goes with
/// its own strand, one of the surface with both of its column. Nodes of curved cells: `curved_shell.h`.
struct NodeStrands {
  std::vector<std::size_t> offsets{0};
  std::vector<Index> strands;
  std::span<const Index> of_node(std::size_t i) const {
    return {strands.data() + offsets[i], offsets[i + 1] - offsets[i]};
  }
};
NodeStrands vertex_strands(const ShellLayers& layers);

/// Strands that stand in the way of a shell with the given nodes, ascending; none where it is valid.
using FailingStrands = std::function<std::vector<Index>(std::span<const Vec3> nodes)>;

/// The most of a wanted state that is valid: every strand goes its own share of the way from a valid state to the
/// wanted one, less where strands fail, and neighbours differ by a quarter at most; a node goes the least share of its
/// strands.
///
/// safe  valid, so that this ends: there always is a failing strand that can go back farther.
/// shares  if given: how far each strand got, 0 .. 1.
std::vector<Vec3> advance(const ShellLayers& layers, const NodeStrands& nodes, const FailingStrands& failing,
                          std::span<const Vec3> safe, std::span<const Vec3> wanted,
                          std::vector<double>* shares = nullptr);
/// The same for linear cells.
std::vector<Vec3> advance(const ShellLayers& layers, const ShellCheck& check, std::span<const Vec3> safe,
                          std::span<const Vec3> wanted, std::vector<double>* shares = nullptr);

}  // namespace subvol
