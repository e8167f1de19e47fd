// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"

#include <span>
#include <vector>

namespace subvol {

/// An oriented polygon surface as half-edges: the boundary of a volume mesh with its tags, or a surface of its own.
///
/// A *corner* h is one vertex of one face and stands for the directed edge to the next vertex of that face, which has
/// the face on its left (normals point outward). Vertices have their own compact numbers.
///
///        prev(h)
///           |  face(h)
///           v
///        h (v) ------> next(h)       twin(h) lies on the other side of the edge and runs back
///
/// Along the border of an open surface (or of a piece cut out of one, `surface_piece`) twins are kNoIndex.
struct SurfaceTopology {
  std::vector<Index> face_offsets{0};
  std::vector<Index> corner_vertices, corner_faces, twins, corner_edges;
  std::vector<Index> edge_corners;    ///< one corner of each edge: that of the smaller number
  std::vector<Index> vertex_corners;  ///< one corner at each vertex: that of the smallest number
  std::vector<float> edge_sharpness, vertex_sharpness;

  std::size_t num_vertices() const { return vertex_corners.size(); }
  std::size_t num_edges() const { return edge_corners.size(); }
  std::size_t num_faces() const { return face_offsets.size() - 1; }
  int face_size(Index f) const { return face_offsets[f + 1] - face_offsets[f]; }
  std::span<const Index> face(Index f) const {
    return {corner_vertices.data() + face_offsets[f], static_cast<std::size_t>(face_size(f))};
  }
  Index next(Index h) const {
    const Index f = corner_faces[h];
    return h + 1 == face_offsets[f + 1] ? face_offsets[f] : h + 1;
  }
  Index prev(Index h) const {
    const Index f = corner_faces[h];
    return h == face_offsets[f] ? face_offsets[f + 1] - 1 : h - 1;
  }
  /// Returns the next corner at the same vertex, counter-clockwise as seen from outside.
  Index rotate(Index h) const { return twins[prev(h)]; }
};

enum class SurfaceKind {
  closed,     ///< every edge has two faces
  maybe_open  ///< edges of one face are allowed: the border
};

/// Builds a surface from oriented polygons by pairing their corners; all sharpnesses are 0.
///
/// face_offsets, face_vertices  polygons on vertices 0 .. num_vertices - 1, each of which is used.
/// names                        vertex numbers for messages; if empty, those of the surface.
/// positions                    positions of the vertices for messages; may be empty.
/// InputError: an edge that does not lie between exactly two faces that run along it in opposite directions (or at one
/// face, if the surface may be open), or a vertex whose faces form more than one fan. Non-manifold edges (of more than
/// two faces) are all counted, and the first ten are listed.
SurfaceTopology build_surface(std::size_t num_vertices, std::vector<Index> face_offsets,
                              std::vector<Index> face_vertices, std::span<const Index> names = {},
                              SurfaceKind kind = SurfaceKind::closed, std::span<const Vec3> positions = {});

/// The boundary of a volume mesh.
struct BoundarySurface {
  std::vector<Index> vertices;  ///< volume vertex of each surface vertex, ascending
  std::vector<Index> edges;     ///< volume edge of each surface edge
  std::vector<Index> faces;     ///< volume face of each surface face, ascending
  SurfaceTopology topology;
};

namespace internal {
struct SheetFeatures;
}

/// Builds the boundary of a volume mesh with its tags as sharpnesses. Where interfaces between regions reach the
/// boundary, it has creases and corners of infinite sharpness (sheets.h); tags on interfaces are left out.
/// features  those of the mesh; if not given, they are found.
/// Cost: linear. InputError: as `build_surface`; a tag that is on no sheet; sharpness <= 0 or NaN.
BoundarySurface tagged_boundary(const VolumeMesh& mesh, const MeshTopology& topology);
BoundarySurface tagged_boundary(const VolumeMesh& mesh, const MeshTopology& topology,
                                const internal::SheetFeatures& features);

}  // namespace subvol
