// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/interfaces.h"
#include "subvol/surface/surface_topology.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <vector>

namespace subvol::internal {

/// What the interfaces of a mesh make of its edges and vertices under subdivision.
///
/// The *sheets* of a mesh are its boundary and its interfaces. They meet along feature curves (`InterfaceMarks`). Where
/// an interface ends at the boundary, the curve is part of both. Feature curves are refined as
/// creases of infinite sharpness are. A vertex is a corner, which stays in its place, if
///
///   - feature curves meet or end there: other than two of their edges do;
///   - a crease of the tags ends there at a feature curve;
///   - sheets touch there without a common edge.
struct SheetFeatures {
  Interfaces interfaces;
  InterfaceMarks marks;
  std::vector<char> corners;  ///< 1 for these corners, by vertex; empty without interfaces
  /// The corners of the interface faces, face by face: `fans` joins those of one vertex that are connected across
  /// edges of two faces.
  std::vector<Index> face_offsets{0}, corner_vertices, corner_edges;
  std::vector<Index> twins;          ///< the corner on the other side of the edge; kNoIndex at feature curves
  std::vector<Index> fan_of_corner;  ///< numbered by vertex, then by first corner
  std::vector<Index> fan_vertices;   ///< mesh vertex of each fan

  bool is_curve(Index e) const { return marks.is_curve(e); }
  bool is_corner(Index v) const { return !corners.empty() && corners[v] != 0; }
};

/// Returns the features of a mesh whose boundary is a manifold. topology: of this mesh. Nothing if it has no
/// interfaces.
/// InputError: two faces of an interface that run the same way along their edge (cells of inconsistent orientation).
/// Cost: linear.
SheetFeatures sheet_features(const VolumeMesh& mesh, const MeshTopology& topology);

/// The sheets of a volume mesh as one surface: first its boundary as `tagged_boundary` gives it, with the same numbers;
/// then its interfaces, cut open along feature curves, with normals that point from the smaller to the larger
/// reference.
///
/// A vertex on a feature curve occurs several times, once for each fan of faces around it; so does an edge. The edges
/// where an interface was cut open are sharp and have one face; `vertex_corners` is the first corner of an open fan,
/// counter-clockwise. By the rules of creases, all copies of a vertex then move alike.
struct SheetSurface : BoundarySurface {
  std::size_t num_boundary_faces = 0;
};

/// Cost: linear. InputError: as `tagged_boundary` and `sheet_features`.
SheetSurface tagged_sheets(const VolumeMesh& mesh, const MeshTopology& topology);

/// Returns the tags that the boundary needs on its own to be the same subdivision surface as with its interfaces: the
/// tags of the boundary, and infinitely sharp creases and corners where interfaces reach it.
FeatureTags boundary_tags(const VolumeMesh& mesh, const MeshTopology& topology);

/// Returns the faces between regions as polygons on all vertices of the mesh, numbered as there, in the order of
/// `interfaces.faces`; normals point from the smaller to the larger reference.
PolygonMesh interface_surface(const VolumeMesh& mesh, const MeshTopology& topology, const Interfaces& interfaces);

}  // namespace subvol::internal
