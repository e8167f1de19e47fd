// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/sparse_map.h"

#include <Eigen/Geometry>

#include <array>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

/// Returns the map from control vertices to nodes: vertices of the boundary and of interfaces between regions go to
/// their positions on the Catmull-Clark limit of these sheets (`tagged_sheets`), other interior vertices stay.
///
/// Square, num_vertices() rows; rows of a sheet sum to 1 and use vertices of the sheet only. Exact for smooth vertices,
/// creases, corners, semi-sharp features and darts, next to quads and triangles.
/// InputError: as `tagged_boundary` (a boundary that is not a manifold, bad tags). Cost: linear.
SparseMap limit_map(const VolumeMesh& mesh);

/// The boundary of a volume mesh, refined on its own, with its vertices at limit positions.
struct BoundaryRefinement {
  SparseMap positions;  ///< refined boundary vertices x control vertices of the volume mesh
  /// Faces of the refined boundary, outward. All of them are quads, except at level 0 of a boundary with triangles,
  /// which have kNoIndex as their last corner.
  std::vector<std::array<Index, 4>> quads;
  std::vector<Index> face_of_quad;  ///< surface face of each quad, ascending: a place in `faces`
  /// The faces of the mesh that were refined, as MeshTopology numbers them: its boundary_faces(), and then those
  /// of interfaces, if they were refined, too.
  std::vector<Index> faces;
  std::vector<Index> vertices;  ///< volume vertex of each of the first vertices.size() refined vertices
  /// Refined edges along the mesh's creases, in the order of its tags: 2^levels for each. Those on interfaces are left
  /// out if only the boundary is refined.
  std::vector<std::array<Index, 2>> crease_edges;

  /// Tangents of the limit surface, one row per *normal site*: one site per vertex on smooth parts, one per side where
  /// creases cut the surface. Empty unless asked for.
  SparseMap tangent_u, tangent_v;
  std::vector<std::array<Index, 4>> quad_sites;  ///< site of each corner of `quads`
};

/// Refines the boundary of a mesh and moves its vertices to their limit positions.
///
/// levels         0 .. 8 further refinements of the boundary alone; each splits every quad into four.
/// with_tangents  fills tangent_u, tangent_v and quad_sites, too.
///
/// Each refined vertex lies exactly on the limit surface (as `limit_map`), so the quads are a tessellation of it.
/// InputError: levels out of range; as `limit_map`. Cost: about 1 microsecond per refined vertex.
BoundaryRefinement refine_boundary(const VolumeMesh& mesh, int levels, bool with_tangents = false);

/// Does the same with the boundary and the interfaces between regions. Each sheet has vertices of its own along the
/// feature curves at which it ends, at the same places as those of its neighbors. `limit_normals` of interfaces point
/// from the smaller to the larger reference.
BoundaryRefinement refine_sheets(const VolumeMesh& mesh, int levels, bool with_tangents = false);

/// Returns the outward unit normals of the limit surface at the sites of a refinement with tangents.
///
/// control  positions of the control vertices.
/// points   positions.apply(control). A site whose tangents are parallel gets the mean normal of its quads.
/// InputError: a refinement without tangents; arrays of another length.
std::vector<Vec3> limit_normals(const BoundaryRefinement& refinement, std::span<const Vec3> control,
                                std::span<const Vec3> points);

/// A point of the limit surface with its derivatives with respect to the face's parameters.
struct LimitPoint {
  Vec3 position, du, dv;
  Vec3 normal() const { return du.cross(dv).normalized(); }
};

/// Evaluates the limit surface anywhere, by OpenSubdiv's base face representation.
///
/// Positions are exact except close to darts and semi-sharp features (2e-4 of the extent); normals at extraordinary
/// vertices are accurate to 1e-5. The boundary must consist of quads, as it does after one `subdivide` (InputError).
class LimitSurface {
 public:
  explicit LimitSurface(const VolumeMesh& mesh);
  ~LimitSurface();
  LimitSurface(LimitSurface&&) noexcept;
  LimitSurface& operator=(LimitSurface&&) noexcept;

  std::size_t num_faces() const;
  /// face  a place in MeshTopology::boundary_faces(), whose corners are (u, v) = (0,0), (1,0), (1,1), (0,1).
  /// InputError: face, u or v out of range. Cost: about 100 ns once the face has been prepared, at its first use. Must
  /// not be called from several threads at a time.
  LimitPoint evaluate(Index face, double u, double v) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace subvol
