// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/shell_layers.h"

#include "subvol/base/error.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/shell/shell.h"
#include "subvol/surface/boundary.h"
#include "tests/support/shell_fixtures.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <map>
#include <string>

using namespace subvol;
using namespace subvol::test;

namespace {

double sum_of(double first, double growth, int layers) {
  double sum = 0;
  for (int k = 0; k < layers; ++k) sum += first * std::pow(growth, k);
  return sum;
}

/// Number of faces of each group, by name.
std::map<std::string, std::size_t> faces_by_group(const VolumeMesh& mesh) {
  std::map<std::string, std::size_t> counts;
  const MeshTopology topology(mesh);
  const VolumeFaceGroups found = groups_of_faces(mesh.face_groups, topology);
  CHECK(found.faces.size() == mesh.face_groups.faces.size());
  for (const GroupedFace& face : found.faces) ++counts[mesh.face_groups.groups[face.group].name];
  return counts;
}

}  // namespace

TEST_CASE("The growth of layers follows from their thickness and the first height", "[shell]") {
  for (const double growth : {0.3, 0.8, 1.0, 1.2, 3.0, 50.0})
    for (const int layers : {2, 3, 10})
      CHECK(growth_of_layers(sum_of(0.01, growth, layers), 0.01, layers) == Approx(growth).epsilon(1e-9));
  CHECK(growth_of_layers(0.4, 0.4, 1) == 1);
  CHECK_THROWS_WITH(growth_of_layers(1, 0.1, 1), Catch::Contains("one layer is as thick as the shell"));
  CHECK_THROWS_WITH(growth_of_layers(1, 1, 3), Catch::Contains("no room for 2 more"));
  CHECK_THROWS_WITH(growth_of_layers(1, 1e-6, 2), Catch::Contains("ask for more layers"));
  CHECK_THROWS_AS(growth_of_layers(1, 0, 2), InputError);
  CHECK_THROWS_AS(growth_of_layers(1, std::nan(""), 2), InputError);
}

TEST_CASE("The number of layers follows from their thickness, the first height and the growth", "[shell]") {
  for (const double growth : {0.9, 1.0, 1.3, 2.0})
    for (const int layers : {1, 2, 7}) CHECK(number_of_layers(sum_of(0.02, growth, layers), 0.02, growth) == layers);
  CHECK(number_of_layers(1, 0.45, 1) == 2);
  CHECK_THROWS_WITH(number_of_layers(1, 2, 1.2), Catch::Contains("is thicker than the shell"));
  CHECK_THROWS_WITH(number_of_layers(1, 0.1, 0.5), Catch::Contains("0.2 at most"));
}

TEST_CASE("Faces of a shell are in groups: those of the surface, its sheets and its rim", "[shell]") {
  PolygonMesh patch = plane(Faces::quads);  // 6 x 4 quads, 20 border edges
  const auto outward = faces_by_group(make_shell(patch, {.thickness = 0.1, .layers = 2}).mesh);
  CHECK(outward == std::map<std::string, std::size_t>{{"wall", 24}, {"outer", 24}, {"rim", 40}});
  const auto inward = faces_by_group(make_shell(patch, {.thickness = 0.1, .side = ShellSide::inward}).mesh);
  CHECK(inward == std::map<std::string, std::size_t>{{"wall", 24}, {"inner", 24}, {"rim", 20}});
  patch.face_groups = {{{"hot", 4}, {"outer", 1}}, std::vector<Index>(24, 0)};
  patch.face_groups.of_face[3] = 1;
  patch.face_groups.of_face[4] = kNoIndex;
  const ShellResult both = make_shell(patch, {.thickness = 0.1, .side = ShellSide::both});
  CHECK(faces_by_group(both.mesh) ==
        std::map<std::string, std::size_t>{
            {"hot", 22}, {"outer", 1}, {"wall", 1}, {"inner", 24}, {"shell outer", 24}, {"rim", 40}});
  CHECK(both.mesh.face_groups.groups[0].number == 4);
  std::map<int, int> numbers;
  for (const Group& group : both.mesh.face_groups.groups) ++numbers[group.number];
  CHECK(numbers.size() == 6);
  const auto closed = faces_by_group(make_shell(as_polygons(cube_surface(2, true)), {.thickness = 0.1}).mesh);
  CHECK(closed == std::map<std::string, std::size_t>{{"wall", 48}, {"outer", 48}});
}

TEST_CASE("Corner scaled Jacobians of a shell are those that other programs compute", "[shell]") {
  // A flat grid of right triangles: against the references all is perfect, against the equilateral prism it is not.
  const ShellResult shell = make_shell(plane(Faces::triangles), {.thickness = 0.1});
  CHECK(shell.quality.min_scaled_jacobian == Approx(1).epsilon(1e-9));
  double least = 1;
  for (std::size_t c = 0; c < shell.mesh.num_cells(); ++c) {
    const auto cell = shell.mesh.cell(c);
    for (const int top : {0, 3})
      for (int k = 0; k < 3; ++k) {
        const auto at = [&](int i) -> const Vec3& { return shell.mesh.positions[cell[i]]; };
        const Vec3 u = at(top + (k + 1) % 3) - at(top + k), v = at(top + (k + 2) % 3) - at(top + k),
                   w = at(3 - top + k) - at(top + k);
        const double jacobian = (top == 0 ? 1 : -1) * u.cross(v).dot(w) / (u.norm() * v.norm() * w.norm());
        least = std::min(least, 2 / std::sqrt(3.0) * jacobian);
      }
  }
  CHECK(shell.corner_quality.min_scaled_jacobian == Approx(least).epsilon(1e-9));
}

TEST_CASE("Groups of a shell have names of their own, whatever the names of the surface are", "[shell]") {
  PolygonMesh patch = plane(Faces::quads);
  patch.face_groups = {{{"outer", 1}, {"shell outer", 2}, {"shell outer 2", 3}}, std::vector<Index>(24, 0)};
  patch.face_groups.of_face[3] = 1;
  patch.face_groups.of_face[4] = 2;
  CHECK(faces_by_group(make_shell(patch, {.thickness = 0.1}).mesh) ==
        std::map<std::string, std::size_t>{
            {"outer", 22}, {"shell outer", 1}, {"shell outer 2", 1}, {"shell outer 3", 24}, {"rim", 20}});
}
