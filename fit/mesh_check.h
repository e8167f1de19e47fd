// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/high_order_mesh.h"
#include "fit/geometry/curved_boundary.h"
#include "fit/geometry/surface_distance.h"
#include "fit/quality/quality.h"
#include "subvol/base/work_progress.h"
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

/// What stands for the quads of a boundary where triangles are needed.
enum class QuadTriangles {
  bilinear,  ///< `refined_triangles`: eight per quad, close to the bilinear patch (default)
  diagonal   ///< `triangulate`: two per quad
};

struct MeshCheckOptions {
  int samples_per_direction = 5;   ///< of the scaled Jacobian, >= 2
  QuadTriangles quad_triangles = QuadTriangles::bilinear;
  int distance_samples = SurfaceDistanceOptions{}.num_samples;  ///< its `num_samples`
  /// Told "quality", "topology", "self-intersections" and, where there are a target and a boundary, "distance" before
  /// each.
  WorkProgress progress{};
};

/// How fine the cells of a high-order mesh are.
struct OrderSummary {
  Basis basis;
  int min_order, max_order;                                ///< of edges, faces and cells
  std::size_t num_nodes;
  std::size_t num_full_order_nodes;                        ///< if everything had the largest order
};
OrderSummary order_summary(const ElementSpace& space);

/// A point that shows a cell to be inverted.
struct InversionWitness {
  Index cell;
  Vec3 canonical;      ///< in the cell's canonical coordinates
  Vec3 position;       ///< in space
  double determinant;  ///< det J by canonical coordinates, <= 0 beyond rounding
};

/// All that is known of a volume mesh without a fit. Parts that were not looked at, since defects rule them out or the
/// progress ended it, are left at their defaults, and neither text nor reports speak of them.
struct MeshCheck {
  bool ended_early = false;                                  ///< by the progress

  std::vector<MeshDefect> defects;                           ///< `validate`'s

  std::size_t num_vertices = 0, num_cells = 0;
  std::array<std::size_t, kNumCellKinds> num_cells_of_kind{};  ///< by CellKind: tets, prisms, hexes
  std::optional<OrderSummary> orders;                        ///< of a high-order mesh

  bool has_topology = false;                                 ///< whether the numbers below are set
  std::size_t num_edges = 0, num_faces = 0;
  std::size_t num_boundary_vertices = 0, num_boundary_edges = 0, num_boundary_faces = 0;
  std::size_t num_components = 0;                            ///< of the cells, through common faces
  std::size_t num_boundary_components = 0;                   ///< through common vertices
  long boundary_euler_number = 0;                            ///< V - E + F of the boundary
  long euler_number = 0;                                     ///< V - E + F - C of the cells, unused vertices left out

  std::optional<SubdivisionAudit> subdivision_audit;         ///< what works against subdividing it; no defect

  std::optional<QualityReport> quality;                      ///< with the certificate
  std::vector<InversionWitness> witnesses;                   ///< of the first ten cells that are refuted

  bool has_boundary_geometry = false;                        ///< whether the numbers below are set
  double chord_error = 0;                                    ///< of the triangles that stand for a curved boundary
  double volume = 0;                                         ///< enclosed by the boundary's triangles, signed
  std::vector<std::array<Index, 2>> intersecting_faces;      ///< places in `boundary_faces()`, ascending; may be equal
  std::size_t num_intersecting_triangle_pairs = 0;           ///< `kMostIntersectingPairs`: that many or more
  std::size_t num_degenerate_boundary_triangles = 0;         ///< without area: not looked at for intersections

  std::optional<SurfaceDistance> distance;                   ///< a: boundary, b: target; none without a boundary
  double target_diagonal = 0;                                ///< of the target's bounding box: 100 per cent

  /// Usable as it is: sound but for unused vertices, every cell certified, the boundary's triangles (those with an
  /// area) free of self-intersection. False where one of these was not looked at; the distance has no part in it.
  bool valid() const;
  double mean_distance_percent() const { return in_percent(distance ? distance->mean() : 0); }
  double max_distance_percent() const { return in_percent(distance ? distance->max() : 0); }

 private:
  double in_percent(double length) const { return target_diagonal > 0 ? 100 * length / target_diagonal : 0; }
};

/// InputError, naming what it is of, where `check_mesh` would refuse a mesh with these vertices: an extent of more than
/// nothing that `require_length` refuses. Those that are not finite are left out: they are a defect, and told as one.
void require_extent(std::span<const Vec3> points, const char* what);

/// Looks at everything: defects, topology, quality, certificate, self-intersection, distance.
///
/// target   what the boundary should be, or null.
/// Where the progress ends it, what has not been looked at is as if defects ruled it out.
/// InputError, before anything is looked at: options out of range; a mesh or target of more than one point whose extent
/// `require_length` refuses; a target that `ClosestPoint` refuses, or a cloud without points or with one that is not
/// finite. Never for what else is wrong with the mesh.
/// Deterministic for any number of threads. Cost on one core: per hex about 2 us, per boundary quad 50 us without
/// and 80 us with a target.
MeshCheck check_mesh(const VolumeMesh& mesh, const TriangleMesh* target = nullptr,
                     const MeshCheckOptions& options = {});
/// The same against points, one-sided: distances are from the points to the boundary. target may be null.
MeshCheck check_mesh(const VolumeMesh& mesh, const PointCloud* target, const MeshCheckOptions& options = {});
/// Against nothing.
inline MeshCheck check_mesh(const VolumeMesh& mesh, std::nullptr_t, const MeshCheckOptions& options) {
  return check_mesh(mesh, static_cast<const TriangleMesh*>(nullptr), options);
}

/// The same of a curved mesh. Defects are those of the straight-sided mesh, whose cells may be inverted; there is no
/// audit.
///
/// boundary               what stands for its surface in the parts that need triangles; must be the mesh's.
/// samples_per_direction  as for `measure_quality` of a high-order mesh; that of `options` and its quads mean nothing.
MeshCheck check_mesh(const HighOrderMesh& mesh, const CurvedBoundary& boundary, const TriangleMesh* target = nullptr,
                     const MeshCheckOptions& options = {}, int samples_per_direction = 0);
MeshCheck check_mesh(const HighOrderMesh& mesh, const CurvedBoundary& boundary, const PointCloud* target,
                     const MeshCheckOptions& options = {}, int samples_per_direction = 0);

/// The same as a text of some lines for people, the verdict last.
std::string to_text(const MeshCheck& check);

}  // namespace subvol
