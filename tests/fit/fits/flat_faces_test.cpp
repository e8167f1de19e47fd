// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/flat_faces.h"

#include "subvol/fit/features/flat_facets.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/mesh_topology.h"
#include "tests/support/feature_fixtures.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <random>
#include <utility>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// A lattice in the cube [-1, 1]^3 whose vertices are off their places by up to `noise` in each direction.
VolumeMesh noisy_cube(int n, double noise) {
  VolumeMesh mesh = centered_lattice(n);
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> off(-noise, noise);
  for (Vec3& p : mesh.positions) p += Vec3(off(engine), off(engine), off(engine));
  return mesh;
}

std::size_t flatten(VolumeMesh& mesh, const TriangleMesh& target) {
  return flatten_faces(mesh, target, ClosestPoint(target), flat_facets(target));
}

}  // namespace

TEST_CASE("flat facets: a cube has six, however many triangles it has; a sphere one for each triangle") {
  const TriangleMesh cube = cube_surface(5, false);
  const FlatFacets facets = flat_facets(cube);
  CHECK(facets.planes.size() == 6);
  CHECK(std::count(facets.of_triangle.begin(), facets.of_triangle.end(), kNoIndex) == 0);
  for (const FacetPlane& plane : facets.planes) {
    CHECK(plane.normal.norm() == Approx(1));
    CHECK(plane.offset == Approx(1));
  }
  const TriangleMesh sphere = cube_surface(5, true);
  CHECK(flat_facets(sphere).planes.size() > sphere.triangles.size() / 2);
}

TEST_CASE("flat facets: triangles without area are in none") {
  const FlatFacets facets = flat_facets({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}});
  CHECK(facets.of_triangle == std::vector<Index>{kNoIndex, 0});
  CHECK(flat_facets({}).planes.empty());
}

TEST_CASE("flat faces: the faces of a fitted cube become planes, its edges lines, its corners points") {
  VolumeMesh mesh = noisy_cube(4, 0.02);
  const double least = measure_quality(mesh).min_scaled_jacobian;
  const std::size_t flat = flatten(mesh, cube_surface(4, false));
  const MeshTopology topology(mesh);
  std::size_t boundary = 0;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v) {
    if (!topology.is_boundary_vertex(static_cast<Index>(v))) continue;
    ++boundary;
    CHECK(mesh.positions[v].cwiseAbs().maxCoeff() == Approx(1).epsilon(1e-14));
  }
  CHECK(flat == boundary);
  CHECK(volume_of(mesh) == Approx(8).epsilon(1e-13));
  CHECK(measure_quality(mesh).min_scaled_jacobian >= least);
}

TEST_CASE("flat faces: what is far from the target, or curved, stays where it is") {
  VolumeMesh far = noisy_cube(4, 0.02);
  for (Vec3& p : far.positions) p *= 1.3;
  const std::vector<Vec3> before = far.positions;
  flatten(far, cube_surface(4, false));
  CHECK(far.positions == before);
  VolumeMesh round = noisy_cube(4, 0.02);
  const std::vector<Vec3> round_before = round.positions;
  CHECK(flatten(round, cube_surface(12, true)) == 0);
  CHECK(round.positions == round_before);
}

TEST_CASE("flat faces: a cage is judged by the cells of its mesh, not by its own") {
  constexpr int kCells = 4;
  constexpr double kSharp = 40, kOff = 1e-3;
  VolumeMesh control = centered_lattice(kCells);
  control.tags = features_by_angle(control, kSharp);
  FittedCage cage(std::move(control));
  const auto at = [&](const Vec3& place) {
    return static_cast<std::size_t>(
        std::ranges::min_element(cage.cage.positions, std::less{}, [&](const Vec3& p) { return (p - place).norm(); }) -
        cage.cage.positions.begin());
  };
  // An edge of the cage is as short as the way to the plane, and vanishes there. The cells of the mesh stay good.
  const std::size_t center = at({0, 0, 1}), below = at({0, 0, 0.5});
  cage.cage.positions[below] = Vec3(0, 0, 1);
  cage.cage.positions[center].z() += kOff;
  VolumeMesh alone = cage.cage;
  const TriangleMesh target = cube_surface(kCells, false);
  const ClosestPoint tree(target);
  const double least = measure_quality(cage.mesh()).min_scaled_jacobian;
  REQUIRE(least > 0.3);
  const std::size_t boundary = 6 * kCells * kCells + 2;
  CHECK(flatten_faces(alone, target, tree, flat_facets(target)) < boundary);
  CHECK(flatten_faces(cage, target, tree, flat_facets(target)) == boundary);
  CHECK(cage.cage.positions[center].z() == Approx(1).epsilon(1e-14));
  CHECK(measure_quality(cage.mesh()).min_scaled_jacobian >= least);
}
