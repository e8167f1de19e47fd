// SPDX-License-Identifier: GPL-3.0-or-later
// Borders between groups on smooth surfaces are feature curves where it is asked for.

#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/target/carried_groups.h"
#include "subvol/io/surface_io.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <map>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// A unit sphere of 8 * 4^levels triangles, in two groups above and below z = 0.
TriangleMesh grouped_sphere(int levels) {
  TriangleMesh mesh{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                    {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::array<Index, 2>, Index> middles;
    const auto middle = [&](Index a, Index b) {
      const auto [known, is_new] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<Index>(mesh.positions.size()));
      if (is_new) mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]).normalized());
      return known->second;
    };
    std::vector<std::array<Index, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  mesh.face_groups.groups = {{"north", 1, 2}, {"south", 2, 2}};
  for (const auto& t : mesh.triangles)
    mesh.face_groups.of_face.push_back(
        (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]])[2] > 0 ? 0 : 1);
  return mesh;
}

/// Largest |z| of the vertices between the groups that a mesh gets, and the number of these.
std::pair<double, std::size_t> border_of(const TriangleMesh& target, const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  const std::vector<Index> groups =
      carried_groups(target, linear_boundary(mesh, topology), topology.boundary_faces().size());
  std::map<Index, std::set<Index>> at_vertex;
  for (std::size_t i = 0; i < groups.size(); ++i)
    for (const Index v : topology.face(topology.boundary_faces()[i])) at_vertex[v].insert(groups[i]);
  double farthest = 0;
  std::size_t count = 0;
  for (const auto& [v, found] : at_vertex)
    if (found.size() > 1) farthest = std::max(farthest, std::abs(mesh.positions[v][2])), ++count;
  return {farthest, count};
}

}  // namespace

TEST_CASE("keep_groups: borders are the edges between triangles of different groups", "[fit]") {
  TriangleMesh sphere = grouped_sphere(1);
  const auto borders = group_borders(sphere, sphere);
  CHECK(borders.size() == 8);  // the equator
  for (const auto& edge : borders)
    for (const Index v : edge) CHECK(sphere.positions[v][2] == 0);
  TriangleMesh plain = sphere;
  plain.face_groups = {};
  CHECK(group_borders(plain, plain).empty());
  CHECK(group_borders(plain, sphere) == borders);
  CHECK(feature_curves(sphere, 180, borders).curves.size() == 1);
  sphere.face_groups.of_face[0] = kNoIndex;  // a triangle of no group has a border with its neighbors
  CHECK(group_borders(sphere, sphere).size() > borders.size());
}

TEST_CASE("keep_groups: an automatic fit of a smooth surface follows the border of its groups", "[fit][slow]") {
  const TriangleMesh sphere = grouped_sphere(4);
  AutomaticFitOptions options;
  options.cells = 2000;
  const AutomaticFitResult plain = fit_automatically(sphere, options);
  options.keeps_groups = true;
  const AutomaticFitResult kept = fit_automatically(sphere, options);
  const auto [away, some] = border_of(sphere, plain.mesh);
  const auto [near, count] = border_of(sphere, kept.mesh);
  CAPTURE(away, some, near, count);
  CHECK(count > 8);
  CHECK(near < 0.012);  // 0.35 % of the diagonal
  CHECK(kept.trials[kept.chosen].least_scaled_jacobian > 0.4);
  CHECK(kept.missed_edges.empty());
}

TEST_CASE("keep_groups: a rounded cube keeps all of its faces", "[fit][data][slow]") {
  const auto data = require_data();
  if (!data) return;
  const TriangleMesh cube = read_triangle_mesh(*data / "auto" / "cad" / "s12o_cube_rounded_1.obj");
  AutomaticFitOptions options;
  options.cells = 3000;
  options.keeps_groups = true;
  const AutomaticFitResult kept = fit_automatically(cube, options);
  const MeshTopology topology(kept.mesh);
  const CurvedBoundary boundary = linear_boundary(kept.mesh, topology);
  const std::vector<Index> groups = carried_groups(cube, boundary, topology.boundary_faces().size());
  const std::vector<CarriedGroup> areas = areas_of_groups(cube, boundary, groups);
  CHECK(areas.size() == 26);
  CHECK(warnings_of_groups(areas).empty());
}
