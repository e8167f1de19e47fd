// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/work_progress.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/geometry/curved_boundary.h"
#include "subvol/fit/geometry/normal_deviation.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/mesh/validate.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/audit.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// The triangles that represent the quads of a boundary.
enum class QuadTriangles {
  bilinear,  ///< `refined_triangles`: eight per quad, close to the bilinear patch (default)
  diagonal   ///< `triangulate`: two per quad
};

/// Options of `check_mesh`.
struct MeshCheckOptions {
  int samples_per_direction = 5;  ///< for the scaled Jacobian, >= 2
  QuadTriangles quad_triangles = QuadTriangles::bilinear;
  int distance_samples = SurfaceDistanceOptions{}.num_samples;  ///< as in `SurfaceDistanceOptions`
  bool audits_subdivision = true;  ///< reports what would degrade a subdivision of the mesh
  CellLabels labels{};             ///< of curved cells, whose mesh does not hold them; empty: one region
  /// Called before each part with its name: "quality", "topology", "self-intersections", "nesting" if
  /// the boundary has several parts, and, if there are a target and a boundary, "distance". Also called repeatedly
  /// during the search for self-intersections and that of parts that lie in others.
  WorkProgress progress{};
};

/// Orders and number of nodes of a high-order mesh.
struct OrderSummary {
  Basis basis;
  int min_order, max_order;  ///< of edges, faces and cells
  std::size_t num_nodes;
  std::size_t num_full_order_nodes;  ///< number of nodes if every entity had the largest order
};
/// Counts the nodes of a space and finds its orders.
OrderSummary order_summary(const ElementSpace& space);

/// A point at which a cell is inverted.
struct InversionWitness {
  Index cell;
  Vec3 canonical;      ///< in the cell's canonical coordinates
  Vec3 position;       ///< the point in space
  double determinant;  ///< det J with respect to canonical coordinates, <= 0 beyond rounding
};

/// All results of checking a volume mesh. Parts that were not checked, because defects rule them out or the progress
/// callback ended the check, keep their defaults and appear neither in the text nor in reports.
struct MeshCheck {
  bool ended_early = false;  ///< true if the progress callback ended the check

  std::vector<MeshDefect> defects;  ///< those of `validate`

  std::size_t num_vertices = 0, num_cells = 0;
  std::array<std::size_t, kNumCellKinds> num_cells_of_kind{};  ///< by CellKind: tets, prisms, hexes, pyramids
  std::optional<OrderSummary> orders;                          ///< for a high-order mesh

  bool has_topology = false;  ///< true if the numbers below are set
  std::size_t num_edges = 0, num_faces = 0;
  std::size_t num_boundary_vertices = 0, num_boundary_edges = 0, num_boundary_faces = 0;
  std::size_t num_components = 0;           ///< of cells connected by common faces
  std::size_t num_boundary_components = 0;  ///< of boundary faces connected by common vertices
  long boundary_euler_number = 0;           ///< V - E + F of the boundary
  long euler_number = 0;                    ///< V - E + F - C of the cells, without unused vertices

  std::optional<SubdivisionAudit> subdivision_audit;  ///< findings that degrade a subdivision of the mesh; not defects

  std::optional<QualityReport> quality;  ///< includes the certificate
  std::optional<RegionReport> regions;   ///< if the cells have several references; area and volume of each, interfaces
  std::vector<InversionWitness> witnesses;  ///< one for each of the first ten refuted cells

  bool has_boundary_geometry = false;  ///< true if the numbers below are set
  double chord_error = 0;              ///< of the triangles that represent a curved boundary
  double volume = 0;                   ///< signed volume enclosed by the boundary's triangles
  /// Positions in `boundary_faces()`, ascending; both may be equal.
  std::vector<std::array<Index, 2>> intersecting_faces;
  std::size_t num_intersecting_triangle_pairs = 0;    ///< if `kMostIntersectingPairs`: at least that many
  std::size_t num_degenerate_boundary_triangles = 0;  ///< of zero area: not checked for intersections
  /// Holds a vertex of each part of the boundary that faces the wrong way: the part bounds a solid inside another
  /// solid, which no intersection shows. It stays empty if the boundary has one component, meets itself, or is not
  /// closed.
  std::vector<Vec3> parts_inside_solids;

  std::optional<SurfaceDistance> distance;  ///< a: boundary, b: target; empty without a target or a boundary
  std::optional<NormalDeviation> normals;   ///< between the boundary and a target of triangles
  double target_diagonal = 0;               ///< diagonal of the target's bounding box: 100 percent

  /// Returns true if the mesh can be used as it is: it has no defects except unused vertices, every cell is certified,
  /// the boundary's triangles (those with an area) do not intersect, and no solid lies in another. Returns false if one
  /// of these was not checked. The distance does not matter.
  bool valid() const;
  double mean_distance_percent() const { return in_percent(distance ? distance->mean() : 0); }
  double max_distance_percent() const { return in_percent(distance ? distance->max() : 0); }

 private:
  double in_percent(double length) const { return target_diagonal > 0 ? 100 * length / target_diagonal : 0; }
};

/// Throws InputError (naming `what`) if `check_mesh` would reject the extent of these points: if it is neither zero nor
/// between 1e-40 and 1e40. Points that are not finite are ignored here: `validate` reports them.
void require_extent(std::span<const Vec3> points, const char* what);

/// Checks everything: defects, topology, quality, certificate, self-intersections, distance.
///
/// target   the surface that the boundary should reproduce, or null.
/// If the progress callback ends the check, the remaining parts keep their defaults, as if defects ruled them out.
/// InputError, before anything is checked: options out of range; a mesh or target of more than one point whose extent
/// `require_extent` rejects; a target that `ClosestPoint` rejects; a cloud that is empty or has a point that is not
/// finite. Anything else that is wrong with the mesh is reported, not thrown.
/// Deterministic for any number of threads. Cost on one core: about 2 us per hex; per boundary quad, 50 us without a
/// target and 80 us with one.
MeshCheck check_mesh(const VolumeMesh& mesh, const TriangleMesh* target = nullptr,
                     const MeshCheckOptions& options = {});
/// Checks a mesh against points. Distances are one-sided, from the points to the boundary. target may be null.
MeshCheck check_mesh(const VolumeMesh& mesh, const PointCloud* target, const MeshCheckOptions& options = {});
/// Checks a mesh without a target.
inline MeshCheck check_mesh(const VolumeMesh& mesh, std::nullptr_t, const MeshCheckOptions& options) {
  return check_mesh(mesh, static_cast<const TriangleMesh*>(nullptr), options);
}

/// Checks a curved mesh. Defects are those of the straight-sided mesh, except inverted cells, which are allowed there,
/// and coefficients that are not finite; the boundary does not matter then. There is no subdivision audit.
///
/// boundary               the triangles that represent the mesh's surface in the parts that need triangles; must belong
///                        to the mesh.
/// samples_per_direction  as for `measure_quality` of a high-order mesh. The fields `samples_per_direction` and
///                        `quad_triangles` of `options` are ignored. InputError: also another number of references
///                        than of cells.
MeshCheck check_mesh(const HighOrderMesh& mesh, const CurvedBoundary& boundary, const TriangleMesh* target = nullptr,
                     const MeshCheckOptions& options = {}, int samples_per_direction = 0);
MeshCheck check_mesh(const HighOrderMesh& mesh, const CurvedBoundary& boundary, const PointCloud* target,
                     const MeshCheckOptions& options = {}, int samples_per_direction = 0);

/// Returns the results as a few lines of text for people; the last line is the verdict.
std::string to_text(const MeshCheck& check);

}  // namespace subvol
