// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/narrow_strips.h"
#include "subvol/fit/features/quality_caps.h"
#include "subvol/mesh/validate.h"
#include "tests/support/feature_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <set>
#include <vector>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

constexpr double kChamfer = 0.15;

/// Returns the cube [-1, 1]^3 with a chamfer along the edges of its top.
TriangleMesh chamfered_cube() {
  TriangleMesh mesh;
  const double x[] = {-1, 1, 1, -1}, y[] = {-1, -1, 1, 1};
  for (const auto& [z, size] : {std::pair(-1.0, 1.0), std::pair(1 - kChamfer, 1.0), std::pair(1.0, 1 - kChamfer)})
    for (int i = 0; i < 4; ++i) mesh.positions.emplace_back(size * x[i], size * y[i], z);
  const auto add_quad = [&](Index a, Index b, Index c, Index d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  add_quad(3, 2, 1, 0);
  add_quad(8, 9, 10, 11);
  for (Index ring : {0, 4})
    for (Index i = 0; i < 4; ++i) add_quad(ring + i, ring + (i + 1) % 4, ring + 4 + (i + 1) % 4, ring + 4 + i);
  return mesh;
}

/// Returns the same cube with a chamfer along one edge of its top. The chamfer has no width at (-1, -1, 1).
TriangleMesh cube_with_taper() {
  TriangleMesh mesh;
  mesh.positions = {{-1, -1, -1},          {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},         {-1, -1, 1},
                    {1, -1, 1 - kChamfer}, {1, 1, 1},   {-1, 1, 1}, {1, kChamfer - 1, 1}};
  mesh.triangles = {{3, 2, 1}, {3, 1, 0}, {0, 1, 5}, {0, 5, 4}, {4, 5, 8}, {4, 8, 6}, {4, 6, 7},
                    {1, 2, 6}, {1, 6, 8}, {1, 8, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
  return mesh;
}

/// Says which curves have no path.
using IsLost = bool (*)(const FeatureCurve&);

bool is_at_top(const FeatureCurve& curve) { return curve.points.front().z() == 1 && curve.points.back().z() == 1; }
bool is_at_chamfer(const FeatureCurve& curve) {
  return curve.points.front().z() == 1 - kChamfer && curve.points.back().z() == 1 - kChamfer;
}
bool is_below_taper(const FeatureCurve& curve) {
  return std::min(curve.points.front().z(), curve.points.back().z()) == 1 - kChamfer && curve.length() > 1 &&
         std::max(curve.points.front().z(), curve.points.back().z()) == 1;
}

Index cube_vertex_at(const VolumeMesh& mesh, const Vec3& place) {
  const auto at = std::ranges::find_if(mesh.positions, [&](const Vec3& p) { return (p - place).norm() < 1e-9; });
  REQUIRE(at != mesh.positions.end());
  return static_cast<Index>(at - mesh.positions.begin());
}

/// [-1, 1]^3 in 4 x 4 cells in each of some layers.
VolumeMesh cube_of_layers(int layers) {
  VolumeMesh mesh = lattice(4, 4, layers);
  for (Vec3& p : mesh.positions) p = p.cwiseProduct(Vec3(0.5, 0.5, 2.0 / layers)) - Vec3::Ones();
  return mesh;
}

/// Paths along the edges of a cube of cells, except for curves that are lost or shorter than a cell.
FeatureRouting cube_routing(const VolumeMesh& cube, int layers, const SignedFeatures& features, IsLost is_lost) {
  const auto corner_near = [](const Vec3& p) {
    return Vec3(p.x() < 0 ? -1 : 1, p.y() < 0 ? -1 : 1, p.z() < 0 ? -1 : 1);
  };
  FeatureRouting routing;
  for (std::size_t c = 0; c < features.curves.curves.size(); ++c) {
    const FeatureCurve& curve = features.curves.curves[c];
    if (is_lost(curve) || curve.length() < 0.5) {
      const auto reason = is_lost(curve) ? NotFollowed::lost_to_neighbor : NotFollowed::shorter_than_cell;
      routing.unfollowed.push_back({static_cast<Index>(c), reason, curve.points[0], curve.points, curve.length()});
      continue;
    }
    const Vec3 from = corner_near(curve.points.front()), to = corner_near(curve.points.back());
    CreasePath path{static_cast<Index>(c), {}};
    const bool is_vertical = from.z() != to.z();
    const int steps = is_vertical ? layers : 4;
    for (int i = 0; i <= steps; ++i)
      path.vertices.push_back(cube_vertex_at(cube, from + (i / static_cast<double>(steps)) * (to - from)));
    routing.corners.push_back({curve.vertices.front(), path.vertices.front()});
    routing.corners.push_back({curve.vertices.back(), path.vertices.back()});
    routing.paths.push_back(std::move(path));
  }
  std::ranges::sort(routing.corners, {}, [](const PlacedCorner& p) { return std::pair(p.vertex, p.corner); });
  routing.corners.erase(std::unique(routing.corners.begin(), routing.corners.end()), routing.corners.end());
  return routing;
}

}  // namespace

TEST_CASE(
    "narrow strips: a chamfer narrower than a cell gets a row of faces of its own, one that is there or the side of a "
    "pad, whichever edge was found") {
  const IsLost lost = GENERATE(as<IsLost>(), is_at_top, is_at_chamfer);
  const TriangleMesh target = chamfered_cube();
  const SignedFeatures features = features_of(target);
  REQUIRE(features.curves.curves.size() == 20);
  const int layers = GENERATE(1, 4);  // with one, there is no row of faces between the paths at the top and the bottom
  const VolumeMesh cube = cube_of_layers(layers);
  FeatureRouting routing = cube_routing(cube, layers, features, lost);
  PatchedMesh patched = patched_mesh(cube, cube.positions, routing, target);
  PatchGroups groups = patch_groups(MeshTopology(cube), patched.patches, cube.positions, target, features);
  add_pads(patched, features);
  const std::size_t patches = patched.patches.count;

  const std::size_t cells = patched.mesh.num_cells();
  const double h = 0.5;
  const NarrowStrips strips = follow_narrow_strips(patched, routing, groups, target, features, h);
  CHECK(strips.num_followed == 4);
  CHECK(strips.pads.size() == (layers == 1 ? 1 : 0));
  CHECK(patched.mesh.num_cells() == cells + (layers == 1 ? 16 : 0));
  CHECK(routed_share(routing, features.curves) == 1);
  CHECK(routing.unfollowed.empty());
  CHECK(validate(patched.mesh).empty());
  CHECK(patched.patches.count == patches + 4);
  REQUIRE(groups.of_patch.size() == patched.patches.count);

  SECTION("every curve has a path between the vertices of its corners, and no edge has two") {
    const MeshTopology topology(patched.mesh);
    std::set<Index> edges;
    std::size_t num_edges = 0;
    REQUIRE(patched.paths.size() == features.curves.curves.size());
    for (const CreasePath& path : patched.paths) {
      for (const Index edge : edges_of_path(topology, path.vertices)) edges.insert(edge), ++num_edges;
      const FeatureCurve& curve = features.curves.curves[path.curve];
      for (const auto& [corner, vertex] : {std::pair(curve.vertices.front(), path.vertices.front()),
                                           std::pair(curve.vertices.back(), path.vertices.back())})
        CHECK(std::ranges::find(patched.corners, PlacedCorner{corner, vertex}) != patched.corners.end());
    }
    CHECK(edges.size() == num_edges);
  }
  SECTION("paths divide the boundary into the patches, one for each region of the target") {
    const MeshTopology topology(patched.mesh);
    const BoundaryPatches found = boundary_patches(topology, patched.paths);
    CHECK(found.count == features.num_regions);
    for (std::size_t f = 0; f < found.of_face.size(); ++f)
      for (std::size_t g = 0; g < f; ++g)
        if ((found.of_face[f] == found.of_face[g]) != (patched.patches.of_face[f] == patched.patches.of_face[g]))
          FAIL("faces " << f << " and " << g);
    std::set<Index> used(patched.patches.of_face.begin(), patched.patches.of_face.end());
    std::set<Index> of_regions(groups.of_region.begin(), groups.of_region.end()), of_patches;
    for (const Index p : used) of_patches.insert(groups.of_patch[p]);
    CHECK(of_regions.size() == features.num_regions);
    CHECK(of_patches == of_regions);
  }
  SECTION("the edges of the chamfer can have good cells") {
    for (const EdgeCap& cap : quality_caps(patched, features).edges) CHECK(cap.cap > 0.6);
  }
}

TEST_CASE(
    "narrow strips: curves farther apart than a cell, or excluded, or with a corner in common with the other are left "
    "alone") {
  TriangleMesh target = chamfered_cube();
  double length = 0.5;
  IsLost is_lost = is_at_top;
  SECTION("the two curves meet, so that the strip tapers to a point") {
    target = cube_with_taper();
    is_lost = is_below_taper;
  }
  const SignedFeatures features = features_of(target);
  const VolumeMesh cube = cube_of_layers(1);
  FeatureRouting routing = cube_routing(cube, 1, features, is_lost);
  REQUIRE(routing.unfollowed.size() >= 2);
  SECTION("cells much smaller than the chamfer") { length = 0.2 * kChamfer; }
  SECTION("excluded") {
    for (UnfollowedCurve& lost : routing.unfollowed) lost.reason = NotFollowed::excluded;
  }
  PatchedMesh patched = patched_mesh(cube, cube.positions, routing, target);
  PatchGroups groups = patch_groups(MeshTopology(cube), patched.patches, cube.positions, target, features);
  const std::size_t cells = patched.mesh.num_cells(), unfollowed = routing.unfollowed.size();
  CHECK(follow_narrow_strips(patched, routing, groups, target, features, length).num_followed == 0);
  CHECK(patched.mesh.num_cells() == cells);
  CHECK(routing.unfollowed.size() == unfollowed);
}
