// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/sheet_layout.h"
#include "subvol/fit/features/joined_curves.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/fit/features/boundary_patches.h"
#include "subvol/fit/features/sheet_pads.h"
#include "subvol/mesh/face_groups.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

/// The faces of a mesh's sheets, and the pair of regions on either side of each; kOutsideRegion at the boundary.
struct SheetFaces {
  std::vector<Index> faces;
  std::vector<std::array<int, 2>> pairs;
};

SheetFaces sheet_faces(const VolumeMesh& mesh, const MeshTopology& topology) {
  SheetFaces sheets;
  for (const Index f : topology.boundary_faces()) {
    sheets.faces.push_back(f);
    sheets.pairs.push_back({kOutsideRegion, mesh.references[topology.face_cells(f)[0]]});
  }
  const Interfaces interfaces = find_interfaces(mesh, topology);
  for (std::size_t i = 0; i < interfaces.faces.size(); ++i) {
    sheets.faces.push_back(interfaces.faces[i]);
    sheets.pairs.push_back(interfaces.pairs[interfaces.pair_of_face[i]]);
  }
  return sheets;
}

/// Divides the sheets along paths and feature curves.
std::size_t divide(const MeshTopology& topology, const SheetFaces& sheets, std::span<const CreasePath> paths,
                   std::vector<Index>& patch_of_sheet_face) {
  std::vector<char> is_path(topology.num_edges(), 0);
  for (const CreasePath& path : paths)
    for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i)
      is_path[topology.find_edge(path.vertices[i], path.vertices[i + 1])] = 1;
  std::vector<std::vector<Index>> at_edge(topology.num_edges());
  for (std::size_t i = 0; i < sheets.faces.size(); ++i) {
    const auto face = topology.face(sheets.faces[i]);
    for (std::size_t k = 0; k < face.size(); ++k)
      at_edge[topology.find_edge(face[k], face[(k + 1) % face.size()])].push_back(static_cast<Index>(i));
  }
  DisjointSets patches(sheets.faces.size());
  for (std::size_t e = 0; e < at_edge.size(); ++e)
    if (!is_path[e] && at_edge[e].size() == 2 && sheets.pairs[at_edge[e][0]] == sheets.pairs[at_edge[e][1]])
      patches.join(at_edge[e][0], at_edge[e][1]);
  return patches.number(patch_of_sheet_face);
}

}  // namespace

SheetCurves sheet_curves(const RegionSurface& target, std::optional<double> angle_degrees) {
  constexpr double kSheetJunctionAngle = 90, kFlatSheetAngle = 180;  // degrees
  SheetCurves result;
  const std::vector<std::array<Index, 2>> junctions = curve_edges(target);
  SignedFeatures& features = result.features;
  features.curves = feature_curves(target.mesh, angle_degrees.value_or(kNoCreaseAngle), junctions);
  std::set<std::array<Index, 2>> on_curves;
  for (const FeatureCurve& curve : features.curves.curves) {
    const auto [low, high] = std::minmax(curve.vertices[0], curve.vertices[1]);
    const bool is_junction = std::ranges::binary_search(junctions, std::array<Index, 2>{low, high});
    result.are_junctions.push_back(is_junction);
    features.angles.push_back(is_junction ? kSheetJunctionAngle : kFlatSheetAngle);
    features.segment_angles.emplace_back(curve.vertices.size() - 1, features.angles.back());
    for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i) {
      const auto [a, b] = std::minmax(curve.vertices[i], curve.vertices[i + 1]);
      on_curves.insert({a, b});
    }
  }
  DisjointSets patches(target.mesh.triangles.size());
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(target.mesh.triangles, target.mesh.positions.size());
  for_each_edge(sides, [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() == 2 && !on_curves.contains({edge[0].low, edge[0].high}) &&
        target.pair(static_cast<std::size_t>(edge[0].triangle)) ==
            target.pair(static_cast<std::size_t>(edge[1].triangle)))
      patches.join(edge[0].triangle, edge[1].triangle);
  });
  features.num_regions = patches.number(features.regions);
  return result;
}

SheetLayout sheet_layout(const VolumeMesh& grid, std::span<const Vec3> fitted, const RegionSurface& target,
                         const SheetCurves& curves, const RoutingOptions& options, const PillowChoice& pillow) {
  VolumeMesh near_target = grid;
  near_target.tags = {};
  near_target.positions.assign(fitted.begin(), fitted.end());
  SheetLayout layout;
  RoutingOptions routing = options;
  routing.on_sheets = true;
  routing.along_sheet_curves = curves.are_junctions;
  layout.routing = route_features(near_target, curves.features, routing);
  const MeshTopology topology(grid);
  const SheetFaces sheets = sheet_faces(grid, topology);
  std::vector<Index> patch_of_sheet_face;
  PatchedSheets patched{grid, near_target.positions, layout.routing.paths, layout.routing.corners, {}, 0};
  patched.mesh.tags = {};
  patched.num_patches = divide(topology, sheets, layout.routing.paths, patch_of_sheet_face);
  for (std::size_t i = 0; i < sheets.faces.size(); ++i)
    patched.patches[face_key(topology.face(sheets.faces[i]))] = patch_of_sheet_face[i];

  const std::vector<std::array<int, 2>> pairs = region_pairs(target);
  const auto key_of = [&](const std::array<int, 2>& pair) {
    const auto at = std::ranges::lower_bound(pairs, pair);
    if (at == pairs.end() || *at != pair)
      throw InputError("regions " + std::to_string(pair[0]) + " and " + std::to_string(pair[1]) +
                       " of the mesh have faces in common, but none in the target");
    return static_cast<Index>(at - pairs.begin());
  };
  std::vector<Index> key_of_face, key_of_triangle;
  for (const auto& pair : sheets.pairs) key_of_face.push_back(key_of(pair));
  for (std::size_t t = 0; t < target.sides.size(); ++t) key_of_triangle.push_back(key_of(target.pair(t)));
  const PatchGroups groups = sheet_patch_groups(topology, sheets.faces, patch_of_sheet_face, patched.num_patches,
                                                key_of_face, near_target.positions, target.mesh,
                                                curves.features.regions, curves.features.num_regions, key_of_triangle);
  for (const Index region : curves.features.regions) layout.group_of_triangle.push_back(groups.of_region[region]);

  layout.pads = pad_sheets(patched, target, curves.features.curves);
  layout.tagged_mesh = layout.pads ? std::move(patched.mesh) : pillow_regions(patched.mesh, pillow);
  layout.creases =
      FollowedCreases(followed_parts(near_target, curves.features, layout.routing), patched.paths, layout.tagged_mesh);
  for (const CreasePath& path : patched.paths)
    for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i)
      layout.segments.push_back({{path.vertices[i], path.vertices[i + 1]}, path.curve});
  const MeshTopology padded(layout.tagged_mesh);
  layout.group_of_face.assign(padded.num_faces(), 0);
  for (const Index f : sheet_faces(layout.tagged_mesh, padded).faces)
    layout.group_of_face[f] = groups.of_patch[patched.patches.at(face_key(padded.face(f)))];
  return layout;
}

}  // namespace subvol::internal
