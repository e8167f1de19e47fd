// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/fit_level.h"

#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/subdivision/subdivision.h"

#include <algorithm>
#include <optional>

namespace subvol::internal {

namespace {

/// Most refinements of the boundary for samples, on the finest level and on those below, which follow the target only
/// roughly.
constexpr int kMaxSampleRefinements = 3, kMaxCoarseRefinements = 1;

/// Takes the vertices of the boundary and of interfaces of a hex mesh as samples, without the limit map.
void sample_plain_boundary(const VolumeMesh& mesh, const SparseMap& nodes, FitLevel& level) {
  const MeshTopology topology(mesh);
  std::vector<Index> sample_of(mesh.num_vertices(), kNoIndex), rows;
  const auto add_face = [&](Index f, std::span<const Index> face) {
    std::array<Index, 4> quad;
    for (int i = 0; i < 4; ++i) {
      Index& sample = sample_of[face[i]];
      if (sample == kNoIndex) {
        sample = static_cast<Index>(rows.size());
        rows.push_back(face[i]);
      }
      quad[i] = sample;
    }
    level.sample_triangles.push_back({quad[0], quad[1], quad[2]});
    level.sample_triangles.push_back({quad[0], quad[2], quad[3]});
    level.sample_faces.insert(level.sample_faces.end(), 2, f);
  };
  for (const Index f : topology.boundary_faces()) add_face(f, topology.face(f));
  for (const Index f : find_interfaces(mesh, topology).faces) add_face(f, oriented_face(mesh, topology, f));
  level.samples = select_rows(nodes, rows);
  for (const CreaseEdge& crease : mesh.tags.creases)
    level.crease_edges.push_back({sample_of[crease.v0], sample_of[crease.v1]});
}

/// Maps boundary nodes to the vertices of the boundary refined once, by bilinear interpolation in its quads.
SparseMap bilinear_refinement(const BoundaryRefinement& once, std::size_t num_nodes) {
  // A child quad has one old vertex, then the midpoint of the edge that leaves it, the face point, and the midpoint of
  // the edge that arrives. So each edge point sees its two ends, and each face point its four corners.
  std::vector<std::vector<Index>> parents(once.positions.num_rows());
  const auto num_old = static_cast<Index>(once.vertices.size());
  for (const auto& quad : once.quads) {
    int corner = 0;
    while (quad[corner] >= num_old) ++corner;
    const Index node = once.vertices[quad[corner]];
    for (int i = 0; i < 4; ++i) {
      std::vector<Index>& list = parents[quad[(corner + i) % 4]];
      if (std::find(list.begin(), list.end(), node) == list.end()) list.push_back(node);
    }
  }
  SparseMap map;
  map.num_cols = num_nodes;
  for (std::vector<Index>& list : parents) {
    std::sort(list.begin(), list.end());
    for (Index node : list) {
      map.columns.push_back(node);
      map.values.push_back(1.0 / static_cast<double>(list.size()));
    }
    map.offsets.push_back(map.columns.size());
  }
  return map;
}

void add_groups(FitLevel& level) {
  const MeshTopology topology(level.mesh);
  level.face_groups = groups_of_sheets(level.mesh, topology);
  if (level.face_groups.empty()) return;
  level.sample_groups = groups_of_triangles(level.sample_faces, level.face_groups);
  level.interfaces = find_interfaces(level.mesh, topology).faces;
}

}  // namespace

FitLevel make_fit_level(const VolumeMesh& control, const SparseMap& from_unknowns, const SparseMap& previous_nodes,
                        const FitOptions& options, std::size_t min_samples, bool finest) {
  FitLevel level;
  SubdivisionLevel refined = subdivide(control, options.boundary);
  level.mesh = std::move(refined.fine);
  level.parent_creases = parents_of_creases(level.mesh.tags, control.tags);
  level.safe_nodes = compose(linear_split(control), previous_nodes);
  level.refine = std::move(refined.matrix);
  const SparseMap fine_from_unknowns = compose(level.refine, from_unknowns);
  if (options.surface == FittedSurface::mesh) {
    level.nodes = fine_from_unknowns;
    sample_plain_boundary(level.mesh, level.nodes, level);
    add_groups(level);
    return level;
  }
  const SparseMap limit = limit_map(level.mesh);
  level.nodes = compose(limit, fine_from_unknowns);
  const MeshTopology topology(level.mesh);
  std::size_t boundary_faces = topology.boundary_faces().size();
  int refinements = 0;
  while (boundary_faces < min_samples && refinements < (finest ? kMaxSampleRefinements : kMaxCoarseRefinements)) {
    boundary_faces *= 4;
    ++refinements;
  }
  BoundaryRefinement boundary;
  std::optional<SparseMap> towards_mesh;
  if (finest) {
    boundary = refine_sheets(level.mesh, 1);
    const SparseMap bilinear = bilinear_refinement(boundary, level.mesh.num_vertices());
    const std::vector<Vec3> fine = level.refine.apply(control.positions);
    const std::vector<Vec3> on_limit = boundary.positions.apply(fine), on_mesh = bilinear.apply(limit.apply(fine));
    double gap = 0;
    for (std::size_t i = 0; i < on_limit.size(); ++i) gap += (on_limit[i] - on_mesh[i]).norm();
    // A tolerance applies to both surfaces.
    if (options.tolerance_percent ||
        gap <= options.tuning.fitting.most_mesh_limit_gap * static_cast<double>(on_limit.size()))
      towards_mesh = compose(bilinear, level.nodes);
  }
  if (!towards_mesh) boundary = refine_sheets(level.mesh, finest ? std::max(refinements, 1) : refinements);
  level.samples = compose(boundary.positions, fine_from_unknowns);
  if (towards_mesh) level.samples = blend(level.samples, *towards_mesh, options.tuning.fitting.mesh_share);
  level.crease_edges = std::move(boundary.crease_edges);
  for (std::size_t k = 0; k < boundary.quads.size(); ++k) {
    const auto& q = boundary.quads[k];
    level.sample_triangles.push_back({q[0], q[1], q[2]});
    level.sample_triangles.push_back({q[0], q[2], q[3]});
    level.sample_faces.insert(level.sample_faces.end(), 2, boundary.faces[boundary.face_of_quad[k]]);
  }
  add_groups(level);
  return level;
}

int limit_refinements(const VolumeMesh& mesh) {
  constexpr int kMostLimitRefinements = 2;        // of each face
  constexpr std::size_t kMostTriangles = 200000;  // beyond it, one refinement less, to bound the time of distances
  const std::size_t of_two = MeshTopology(mesh).boundary_faces().size() * 2 << 2 * kMostLimitRefinements;
  return of_two > kMostTriangles ? kMostLimitRefinements - 1 : kMostLimitRefinements;
}

TriangleMesh limit_triangles(const FitLevel& level, const BoundaryRefinement& limit, std::span<const Vec3> control) {
  TriangleMesh surface;
  surface.positions = limit.positions.apply(level.refine.apply(control));
  const auto num_boundary_faces = static_cast<Index>(limit.faces.size() - level.interfaces.size());
  for (std::size_t k = 0; k < limit.quads.size(); ++k) {
    if (limit.face_of_quad[k] >= num_boundary_faces) break;  // the rest are interfaces
    const auto& q = limit.quads[k];
    surface.triangles.push_back({q[0], q[1], q[2]});
    surface.triangles.push_back({q[0], q[2], q[3]});
  }
  return surface;
}

}  // namespace subvol::internal
