// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/animation.h"

#include "subvol/base/error.h"
#include "subvol/export/polygon_shading.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/surface/boundary.h"

#include <string>

namespace subvol {

using namespace internal;
namespace {

/// Polygons whose vertices depend linearly on the positions of a mesh.
struct MovingSurface {
  SparseMap positions;
  PolygonMesh polygons;  ///< at rest, as in the result
};

PolygonMesh at(const MovingSurface& surface, const FitState& state) {
  if (state.positions.size() != surface.positions.num_cols)
    throw InputError("state \"" + state.name + "\": expected " + std::to_string(surface.positions.num_cols) +
                     " positions, got " + std::to_string(state.positions.size()));
  return {surface.positions.apply(state.positions), surface.polygons.face_offsets, surface.polygons.face_vertices};
}

Scene scene_of(const MovingSurface& surface, std::span<const FitState> states, const SurfaceSceneOptions& options) {
  SurfaceSceneOptions plain = options;
  plain.wireframe = false;
  Scene scene = polygon_scene(surface.polygons, {}, plain);
  const ShadedPolygons shaded = shade_polygons(surface.polygons, options.crease_angle_degrees);
  for (const FitState& state : states) {
    const PolygonMesh moved = at(surface, state);
    SceneShape shape{state.name, std::vector<Vec3>(shaded.positions.size()),
                     shaded_normals(moved, shaded.corner_vertices, shaded.positions.size())};
    for (std::size_t k = 0; k < shaded.corner_vertices.size(); ++k)
      shape.positions[shaded.corner_vertices[k]] = moved.positions[moved.face_vertices[k]];
    scene.nodes[0].shapes.push_back(std::move(shape));
  }
  return scene;
}

}  // namespace

Scene animation_scene(const VolumeMesh& cage, std::span<const FitState> states, const SurfaceSceneOptions& options) {
  constexpr std::size_t kMostAnimatedQuads = 20'000;
  constexpr int kMostAnimationRefinements = 4;  // of a cage of few faces
  int refinements = 1;
  for (std::size_t quads = 16 * MeshTopology(cage).boundary_faces().size();
       quads <= kMostAnimatedQuads && refinements < kMostAnimationRefinements; quads *= 4)
    ++refinements;
  BoundaryRefinement boundary = refine_boundary(cage, refinements);
  MovingSurface surface;
  surface.polygons.positions = boundary.positions.apply(cage.positions);
  surface.polygons.face_offsets = {0};
  for (const auto& quad : boundary.quads) {
    surface.polygons.face_vertices.insert(surface.polygons.face_vertices.end(), quad.begin(), quad.end());
    surface.polygons.face_offsets.push_back(surface.polygons.face_vertices.size());
  }
  surface.positions = std::move(boundary.positions);
  return scene_of(surface, states, options);
}

Scene animation_scene(const HighOrderMesh& mesh, std::span<const FitState> states, const SurfaceSceneOptions& options) {
  BoundarySamples boundary = make_boundary_samples(mesh.space, 2 * mesh.space.max_order());
  MovingSurface surface;
  surface.polygons = as_polygons({boundary.positions.apply(mesh.coefficients), std::move(boundary.triangles)});
  surface.positions = std::move(boundary.positions);
  return scene_of(surface, states, options);
}

}  // namespace subvol
