// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/features.h"

#include "subvol/base/angle.h"
#include "subvol/base/error.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <map>
#include <span>

namespace subvol {

using namespace internal;

namespace {

/// Returns the direction of the area vector of a triangle or quad, which is half the cross product of the diagonals for
/// any warp; zero if there is no area.
Vec3 face_normal(const VolumeMesh& mesh, std::span<const Index> face) {
  const auto& x = mesh.positions;
  const Vec3 d0 = x[face[2]] - x[face[0]], d1 = x[face[face.size() - 1]] - x[face[1]];
  return d0.cross(d1).normalized();
}

/// Finds the sharp edges of two faces each, of the boundary or of an interface.
std::vector<CreaseEdge> creases_by_angle(const VolumeMesh& mesh, const MeshTopology& topology,
                                         const Interfaces& interfaces, const InterfaceMarks& marks,
                                         double angle_degrees) {
  std::vector<std::array<Index, 2>> edge_faces(topology.num_edges(), {kNoIndex, kNoIndex});
  std::vector<Vec3> normals(topology.num_faces());
  const auto add_face = [&](Index f, std::span<const Index> face) {
    normals[f] = face_normal(mesh, face);
    for (std::size_t i = 0; i < face.size(); ++i) {
      auto& faces = edge_faces[topology.find_edge(face[i], face[(i + 1) % face.size()])];
      (faces[0] == kNoIndex ? faces[0] : faces[1]) = f;
    }
  };
  for (const Index f : topology.boundary_faces()) add_face(f, topology.face(f));
  for (const Index f : interfaces.faces) {
    const auto corners = oriented_face(mesh, topology, f);
    add_face(f, std::span(corners).first(topology.face(f).size()));
  }
  std::vector<CreaseEdge> creases;
  for (std::size_t e = 0; e < edge_faces.size(); ++e) {
    const auto [f0, f1] = edge_faces[e];
    if (f1 == kNoIndex || marks.is_curve(static_cast<Index>(e))) continue;
    const auto [v0, v1] = topology.edge(static_cast<Index>(e));
    if (angle_degrees_between(normals[f0], normals[f1]) > angle_degrees) creases.push_back({v0, v1});
  }
  return creases;
}

std::vector<CornerVertex> corners_of(const VolumeMesh& mesh, const MeshTopology& topology,
                                     const std::vector<CreaseEdge>& creases, const InterfaceMarks& marks,
                                     double angle_degrees) {
  struct Spokes {
    int count = 0;
    std::array<Index, 2> ends = {kNoIndex, kNoIndex};
  };
  std::vector<Spokes> spokes(mesh.num_vertices());
  const auto add = [&](Index at, Index end) {
    Spokes& s = spokes[at];
    if (s.count < 2) s.ends[s.count] = end;
    ++s.count;
  };
  for (const CreaseEdge& crease : creases) add(crease.v0, crease.v1), add(crease.v1, crease.v0);
  for (std::size_t e = 0; e < marks.curves.size(); ++e) {
    if (!marks.curves[e]) continue;
    const auto [a, b] = topology.edge(static_cast<Index>(e));
    add(a, b), add(b, a);
  }

  std::vector<CornerVertex> corners;
  for (std::size_t v = 0; v < spokes.size(); ++v) {
    const Spokes& s = spokes[v];
    if (s.count < 2) continue;
    const auto& x = mesh.positions;
    const double turn = angle_degrees_between(x[v] - x[s.ends[0]], x[s.ends[1]] - x[v]);
    if (s.count > 2 || turn > angle_degrees) corners.push_back({static_cast<Index>(v)});
  }
  return corners;
}

/// Sorts tags by key and keeps the sharpest of those with equal keys.
template <class Tag, class Key>
void unify(std::vector<Tag>& tags, const Key& key) {
  std::sort(tags.begin(), tags.end(),
            [&](const Tag& a, const Tag& b) { return key(a) != key(b) ? key(a) < key(b) : a.sharpness > b.sharpness; });
  tags.erase(std::unique(tags.begin(), tags.end(), [&](const Tag& a, const Tag& b) { return key(a) == key(b); }),
             tags.end());
}

}  // namespace

FeatureTags features_by_angle(const VolumeMesh& mesh, double angle_degrees) {
  if (!(angle_degrees >= 0 && angle_degrees <= 180))
    throw InputError("features_by_angle: angle_degrees must be in [0, 180], got " + std::to_string(angle_degrees));
  const MeshTopology topology(mesh);
  FeatureTags tags;
  const Interfaces interfaces = find_interfaces(mesh, topology);
  const InterfaceMarks marks = mark_interfaces(topology, interfaces);
  tags.creases = creases_by_angle(mesh, topology, interfaces, marks, angle_degrees);
  tags.corners = corners_of(mesh, topology, tags.creases, marks, angle_degrees);
  return merge_tags(tags, {});
}

FeatureTags merge_tags(const FeatureTags& a, const FeatureTags& b) {
  FeatureTags merged = a;
  merged.creases.insert(merged.creases.end(), b.creases.begin(), b.creases.end());
  merged.corners.insert(merged.corners.end(), b.corners.begin(), b.corners.end());
  for (CreaseEdge& crease : merged.creases)
    if (crease.v0 > crease.v1) std::swap(crease.v0, crease.v1);
  unify(merged.creases, [](const CreaseEdge& c) { return std::pair(c.v0, c.v1); });
  unify(merged.corners, [](const CornerVertex& c) { return c.vertex; });
  return merged;
}

std::vector<Index> parents_of_creases(const FeatureTags& fine, const FeatureTags& control) {
  // Both children of a crease end at its midpoint, which no other crease contains.
  std::map<Index, std::array<Index, 2>> ends_of_middle;
  for (const CreaseEdge& crease : fine.creases) {
    const auto [at, added] = ends_of_middle.try_emplace(crease.v1, std::array{crease.v0, crease.v0});
    if (!added) at->second = {std::min(at->second[0], crease.v0), std::max(at->second[1], crease.v0)};
  }
  std::vector<Index> parents;
  for (const CreaseEdge& crease : fine.creases) {
    const auto& [v0, v1] = ends_of_middle[crease.v1];
    const auto at = std::lower_bound(
        control.creases.begin(), control.creases.end(), std::pair(v0, v1),
        [](const CreaseEdge& c, const std::pair<Index, Index>& ends) { return std::pair(c.v0, c.v1) < ends; });
    parents.push_back(static_cast<Index>(at - control.creases.begin()));
  }
  return parents;
}

}  // namespace subvol
