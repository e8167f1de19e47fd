// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/certificate.h"
#include "subvol/shell/shell_layers.h"

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace subvol {

/// Defects that make a shell invalid.
struct ShellFailures {
  CertificateSummary certificate;
  /// Pairs of faces that intersect, as numbers in `ShellCheck::polygons()`, smaller first, ascending. A face with a
  /// triangle without area, or whose own triangles intersect, is paired with itself.
  std::vector<std::array<Index, 2>> intersecting;
  bool is_complete = true;  ///< false: the search was canceled, or ended as in `self_intersections`
  bool none() const { return is_complete && certificate.all_certified() && intersecting.empty(); }
};

/// The sheets that are checked for intersections. If all cells are certified, checking the two outer ones suffices: a
/// map that is injective on the boundary of its domain, and near every point, is injective everywhere.
enum class CheckedSheets { outer, all };

/// Checks if a shell is valid: every cell is certified, and no face of a sheet or of a wall along the border intersects
/// another.
///
/// Quads, including walls, are represented by their `fan_triangles`, the same way on all sheets.
class ShellCheck {
 public:
  /// layers, cells  must outlive the check.
  /// surface_moves  true if the surface's own vertices can move: `strands` then includes both strands of their columns.
  ShellCheck(const ShellLayers& layers, const VolumeMesh& cells, CheckedSheets sheets, bool surface_moves = false);

  /// positions  one per vertex of the cells.
  /// cancelled  ends the search for pairs, as in `self_intersections`.
  /// Exact, apart from the triangulation of quads; same result for any number of threads.
  ShellFailures failures(std::span<const Vec3> positions, const std::function<bool()>& cancelled = {}) const;

  /// Returns the strands of the failing cells and faces, ascending.
  std::vector<Index> strands(const ShellFailures& failures) const;

  const PolygonMesh& polygons() const { return polygons_; }

 private:
  const ShellLayers& layers_;
  const VolumeMesh& cells_;
  PolygonMesh polygons_;
  bool surface_moves_;
};

/// The strands that each node of a shell moves with. Nodes of linear cells are their vertices: a vertex belongs to its
/// own strand, and a vertex of the surface to both strands of its column. For the nodes of curved cells, see
/// `curved_shell.cpp`.
struct NodeStrands {
  std::vector<std::size_t> offsets{0};
  std::vector<Index> strands;
  std::span<const Index> of_node(std::size_t i) const {
    return {strands.data() + offsets[i], offsets[i + 1] - offsets[i]};
  }
};
/// Returns the strands of the vertices, which are the nodes of linear cells.
NodeStrands vertex_strands(const ShellLayers& layers);

/// Returns the strands that make a shell with these nodes invalid, ascending; empty if it is valid.
using FailingStrands = std::function<std::vector<Index>(std::span<const Vec3> nodes)>;

/// Moves from a valid state as far toward a wanted state as validity allows. Every strand gets its own share of the
/// way, reduced if the strand fails; shares of neighbors differ by at most a quarter. A node moves by the least share
/// of its strands.
///
/// safe    a valid state; otherwise the result may be invalid.
/// ended   asked after each check; if it returns true, the safe state is the result. Empty: never.
/// shares  if not null, receives each strand's share, 0 .. 1.
std::vector<Vec3> advance(const ShellLayers& layers, const NodeStrands& nodes, const FailingStrands& failing,
                          std::span<const Vec3> safe, std::span<const Vec3> wanted,
                          const std::function<bool()>& ended = {}, std::vector<double>* shares = nullptr);
/// Does the same for linear cells.
std::vector<Vec3> advance(const ShellLayers& layers, const ShellCheck& check, std::span<const Vec3> safe,
                          std::span<const Vec3> wanted, const std::function<bool()>& ended = {},
                          std::vector<double>* shares = nullptr);

}  // namespace subvol
