// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/stages/fit_options.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>

namespace subvol::internal {

/// Share of a fit's work that `free_mesh` takes.
inline constexpr double kShareOfFreeing = 0.4;

/// Holds the measures that decide which of two meshes of one target is better.
struct MeshState {
  double least_jacobian;             ///< least scaled Jacobian
  double mean_percent, max_percent;  ///< distances from the target, percent of its diagonal
  double face_percent;               ///< square root of the mean area of a boundary face, percent of the same
  std::size_t uncertified, pairs;    ///< cells without a certificate; pairs of boundary triangles that intersect

  bool is_valid() const { return uncertified == 0 && pairs == 0; }
  /// Returns true if one of the distances is more than 5 % larger than that of another state.
  bool is_farther_than(const MeshState& other, double most_rise) const;
  bool operator==(const MeshState&) const = default;
};
MeshState measure_state(const VolumeMesh& mesh, const TriangleMesh& target);

/// Returns true if the mesh of a fit may be freed from its cage: a quality is aimed at, the template has one region,
/// whose volume cannot change against that of another, and borders between groups, which freed vertices do not follow,
/// need not be kept.
bool can_be_freed(const VolumeMesh& template_mesh, const FitOptions& options);

/// Raises the quality of a fit's finest mesh beyond what its cage allows. The cage has an eighth of the mesh's
/// vertices, and its template may have smooth edges with one cell, which becomes flat there.
///
/// 1. All vertices of the mesh become degrees of freedom (`optimize_mesh`), from the state with the better cells.
/// 2. If the least scaled Jacobian is still below three quarters of the quality, or the mesh is not valid, a layer of
///    cells is put inside the boundary (`pillow`), and the vertices of that mesh are moved in the same way.
///
/// Each result is kept if no more cells lack a certificate and no more triangles of the boundary intersect, if one of
/// these numbers is lower or the least scaled Jacobian higher, and if the distances from the target are at most 5 %
/// larger than those of the cage's mesh, and within the tolerance if they were. If one is kept, `result.mesh` is that
/// mesh, without a cage and without states.
///
/// target   what the fit's mesh reproduces.
/// options  of the fit; the time limit is what is left of it, and the progress that of this work alone.
/// lifted   the mesh in another state of the same fit, with better cells on a surface that may be farther off; without
///          cells if there is none.
/// result   of a fit; nothing is done if a limit or the caller ended it. If it stalled, its mesh is that of the level
///          that could not be reached. If that was the finest one, and the freed mesh is valid and close to the target,
///          the fit counts as done, unless the number of steps was limited.
/// If memory runs out, what was kept before is the result, with the stop reason `memory_limit`.
void free_mesh(const TriangleMesh& target, const FitOptions& options, const VolumeMesh& lifted, FitResult& result);

}  // namespace subvol::internal
