// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/fitted_cage.h"

#include "subvol/fit/quality/quality.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>

using namespace subvol;
using namespace subvol::internal;

namespace {

constexpr double kSharp = 40;  // degrees

VolumeMesh creased_lattice(int x, int y, int z) {
  VolumeMesh mesh = test::lattice(x, y, z);
  mesh.tags = features_by_angle(mesh, kSharp);
  return mesh;
}

}  // namespace

TEST_CASE("The mesh of a cage follows it, and its limit surface is the fitted surface", "[fitted_cage]") {
  FittedCage cage(creased_lattice(2, 2, 2));
  CHECK(cage.mesh().num_cells() == 8 * kChildren);
  CHECK(measure_quality(cage.mesh()).min_scaled_jacobian == Approx(1));
  const auto top = [](const std::vector<Vec3>& points) {
    return std::ranges::max(points, std::less{}, [](const Vec3& p) { return p.z(); }).z();
  };
  const double before = top(cage.limit_surface().positions);
  CHECK(before == Approx(top(cage.mesh().positions)));
  for (Vec3& p : cage.cage.positions) p.z() *= 2;
  CHECK(top(cage.mesh().positions) == Approx(2 * before));
  CHECK(top(cage.limit_surface().positions) == Approx(2 * before));
}

TEST_CASE("Parts of a cage's cells and faces have what these have", "[fitted_cage]") {
  VolumeMesh control = creased_lattice(2, 1, 1);
  const MeshTopology coarse(control);
  std::vector<Index> groups(coarse.num_faces(), 0);
  for (std::size_t i = 0; i < coarse.boundary_faces().size(); ++i)
    groups[coarse.boundary_faces()[i]] = static_cast<Index>(i + 1);
  const FittedCage cage(std::move(control));

  CHECK(cage.of_children({}).empty());
  const std::vector<double> values = cage.of_children(std::array{1.0, 3.0});
  REQUIRE(values.size() == 2 * kChildren);
  CHECK(std::ranges::count(values, 3.0) == kChildren);
  CHECK(cage.sums_of_parts(values) == std::vector<double>{8, 24});

  // Each boundary face is divided in four, which have its group; faces inside have none.
  const std::vector<Index> of_parts = cage.groups_of_parts(groups);
  const MeshTopology fine(cage.level().mesh);
  REQUIRE(of_parts.size() == fine.num_faces());
  for (Index group = 1; group <= 10; ++group) CHECK(std::ranges::count(of_parts, group) == 4);
  for (const Index f : fine.boundary_faces()) CHECK(of_parts[f] > 0);
}

TEST_CASE("Parts of a cage's sharp edges have their caps", "[fitted_cage]") {
  constexpr double kCap = 0.5, kAngle = 90;
  VolumeMesh control = creased_lattice(1, 1, 1);
  REQUIRE(control.tags.creases.size() == 12);
  const CreaseEdge& first = control.tags.creases.front();
  const FittedCage cage(std::move(control));
  const QualityCaps caps = cage.caps_of_parts({{{{first.v0, first.v1}, kCap, kAngle}}, {{3, kCap}}});
  REQUIRE(caps.edges.size() == 2);
  const std::vector<Vec3>& points = cage.level().mesh.positions;
  double length = 0;
  for (const EdgeCap& edge : caps.edges) {
    CHECK(edge.cap == kCap);
    CHECK(edge.angle == kAngle);
    CHECK(edge.ends[0] < edge.ends[1]);
    length += (points[edge.ends[0]] - points[edge.ends[1]]).norm();
  }
  CHECK(length == Approx((cage.cage.positions[first.v0] - cage.cage.positions[first.v1]).norm()));
  REQUIRE(caps.vertices.size() == 1);
  CHECK(caps.vertices[0].vertex == 3);
}
