// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/boundary_patches.h"
#include "subvol/base/error.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/geometry/closest_point.h"
#include "tests/support/feature_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

TEST_CASE("paths along a cube's edges make six patches, each matched to its region") {
  const TriangleMesh target = cube_surface(2, false);
  const RoutedLattice cube(target, 3);
  const MeshTopology topology(cube.grid);
  const BoundaryPatches patches = boundary_patches(topology, cube.routing.paths);
  CHECK(patches.count == 6);
  for (Index p = 0; p < 6; ++p) CHECK(std::ranges::count(patches.of_face, p) == 9);
  const PatchGroups groups = patch_groups(topology, patches, cube.fitted.positions, target, cube.features);
  CHECK(groups.count == 6);
  CHECK(std::set<Index>(groups.of_patch.begin(), groups.of_patch.end()).size() == 6);
  CHECK(std::set<Index>(groups.of_region.begin(), groups.of_region.end()).size() == 6);
  const ClosestPoint tree(target);
  for (std::size_t i = 0; i < patches.of_face.size(); ++i) {
    Vec3 center = Vec3::Zero();
    for (Index v : topology.face(topology.boundary_faces()[i])) center += cube.fitted.positions[v] / 4;
    const Index region = cube.features.regions[tree.closest(center).triangle];
    CHECK(groups.of_region[region] == groups.of_patch[patches.of_face[i]]);
  }
}

TEST_CASE("without the path between them, two sides are one patch and one group") {
  const TriangleMesh target = cube_surface(2, false);
  RoutedLattice cube(target, 3);
  cube.routing.paths.pop_back();
  const MeshTopology topology(cube.grid);
  const BoundaryPatches patches = boundary_patches(topology, cube.routing.paths);
  CHECK(patches.count == 5);
  const PatchGroups groups = patch_groups(topology, patches, cube.fitted.positions, target, cube.features);
  CHECK(groups.count == 5);
  CHECK(groups.of_region.size() == 6);
}

TEST_CASE("regions too small for votes join the patch nearby, and everything has a group") {
  // A cube with a small pyramid pushed out of one side, which no face's point is closest to.
  TriangleMesh target = cube_surface(20, false);
  const auto tip = std::ranges::find_if(target.positions, [](const Vec3& p) { return p.isApprox(Vec3(0.1, 0.1, 1)); });
  REQUIRE(tip != target.positions.end());
  *tip = Vec3(0.1, 0.1, 1.15);
  const SignedFeatures features = features_of(target);
  const VolumeMesh mesh = centered_lattice(3);
  const FeatureRouting routing = route_features(mesh, features);
  CHECK(routing.paths.size() == 12);
  const MeshTopology topology(mesh);
  const BoundaryPatches patches = boundary_patches(topology, routing.paths);
  const PatchGroups groups = patch_groups(topology, patches, mesh.positions, target, features);
  CHECK(groups.count == 6);
  REQUIRE(groups.of_region.size() == features.num_regions);
  CHECK(features.num_regions > 7);
  for (Index g : groups.of_region) CHECK((g >= 0 && g < 6));
}

TEST_CASE("smooth edges have the target's angle at the scale of the mesh") {
  const TriangleMesh flat = cube_surface(2, false), round = cube_surface(16, true);
  const VolumeMesh mesh = centered_lattice(4);
  const MeshTopology topology(mesh);
  for (const EdgeAngle& edge : smooth_edge_angles(topology, RoutedLattice(flat, 4).routing.paths, mesh.positions, flat))
    CHECK(edge.angle == Approx(180));
  // Without paths, an edge of the cube is an edge of 90 degrees; on a sphere, edges are convex a little.
  int sharp = 0;
  for (const EdgeAngle& edge : smooth_edge_angles(topology, {}, mesh.positions, flat))
    sharp += edge.angle == Approx(90);
  CHECK(sharp == 48);
  const auto on_sphere = smooth_edge_angles(topology, {}, fitted_to(round, mesh), round);
  CHECK(on_sphere.size() == 192);
  for (const EdgeAngle& edge : on_sphere) CHECK((edge.angle > 140 && edge.angle <= 181));
}

TEST_CASE("patches refuse paths inside the mesh and arrays of other sizes") {
  const TriangleMesh target = cube_surface(2, false);
  const RoutedLattice cube(target, 2);
  const MeshTopology topology(cube.grid);
  std::vector<CreasePath> inside = {{0, {4, 13}}};
  CHECK_THROWS_AS(boundary_patches(topology, inside), InputError);
  inside[0].vertices = {0, 26};
  CHECK_THROWS_AS(boundary_patches(topology, inside), InputError);
  inside[0].vertices = {0, 1'000'000};
  CHECK_THROWS_AS(boundary_patches(topology, inside), InputError);
  const BoundaryPatches patches = boundary_patches(topology, cube.routing.paths);
  CHECK_THROWS_AS(patch_groups(topology, {}, cube.grid.positions, target, cube.features), InputError);
  CHECK_THROWS_AS(patch_groups(topology, patches, {}, target, cube.features), InputError);
  CHECK_THROWS_AS(patch_groups(topology, patches, cube.grid.positions, {}, cube.features), InputError);
  CHECK_THROWS_AS(smooth_edge_angles(topology, {}, {}, target), InputError);
}
