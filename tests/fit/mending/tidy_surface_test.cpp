// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/tidy_surface.h"

#include "subvol/fit/mending/surface_repair.h"
#include "subvol/surface/welded_surface.h"
#include "tests/support/region_fixtures.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using namespace subvol;
using namespace subvol::test;

namespace {

/// Returns the sentences of a repair as one text.
std::string done(const SurfaceRepair& repair) {
  std::string text;
  for (const std::string& sentence : repair.done) text += sentence + '\n';
  return text;
}

double volume_of(const TriangleMesh& surface) { return internal::signed_volume_of(internal::welded(surface).mesh); }

/// Returns a box whose faces have grids of their own, of so many squares a side, so that edges meet edges of other
/// lengths. Each face is a group.
TriangleMesh box_of_grids(const std::array<int, 6>& counts) {
  TriangleMesh box;
  const auto add_face = [&](const Vec3& origin, const Vec3& u, const Vec3& v, int n, int group) {
    const auto first = static_cast<Index>(box.positions.size());
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        box.positions.push_back(origin + static_cast<double>(i) / n * u + static_cast<double>(j) / n * v);
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const Index a = first + j * (n + 1) + i, b = a + 1, c = b + n + 1, d = c - 1;
        box.triangles.push_back({a, b, c});
        box.triangles.push_back({a, c, d});
        box.face_groups.of_face.insert(box.face_groups.of_face.end(), 2, group);
      }
    box.face_groups.groups.push_back({"face " + std::to_string(group), group + 1, 2});
  };
  const Vec3 x(2, 0, 0), y(0, 3, 0), z(0, 0, 4);
  add_face({0, 0, 0}, y, x, counts[0], 0);
  add_face({0, 0, 4}, x, y, counts[1], 1);
  add_face({0, 0, 0}, x, z, counts[2], 2);
  add_face({0, 3, 0}, z, x, counts[3], 3);
  add_face({0, 0, 0}, z, y, counts[4], 4);
  add_face({2, 0, 0}, y, z, counts[5], 5);
  return box;
}

}  // namespace

TEST_CASE("Triangles that disagree with their part are turned, and that is told", "[mending]") {
  TriangleMesh cube = cube_surface(4, false);
  for (const std::size_t t : {3u, 40u, 41u, 77u}) std::swap(cube.triangles[t][0], cube.triangles[t][1]);
  const SurfaceRepair repair = repair_surface(cube);
  CHECK(repair.is_fillable);
  CHECK(done(repair) == "target: 4 triangles disagree with their parts about the outside: turned\n");
  CHECK(std::abs(volume_of(repair.surface)) == Approx(8));
}

TEST_CASE("Triangles that are there more than once are dropped, and that is told", "[mending]") {
  TriangleMesh cube = cube_surface(4, false);
  for (const std::size_t t : {5u, 60u}) {
    const auto [a, b, c] = cube.triangles[t];
    cube.triangles.push_back({b, c, a});
  }
  const SurfaceRepair repair = repair_surface(cube);
  CHECK(repair.is_fillable);
  CHECK(done(repair) == "target: 2 triangles repeat others: dropped\n");
  CHECK(repair.surface.triangles.size() == cube.triangles.size() - 2);
}

TEST_CASE("Long chains of T-junctions are cut at once", "[mending]") {
  const TriangleMesh box = box_of_grids({20, 21, 20, 19, 21, 20});
  const std::optional<internal::TidySurface> tidy = internal::tidy_surface(box, diagnose(box));
  REQUIRE(tidy);
  CHECK(tidy->done.size() == 1);
  CHECK(diagnose(tidy->surface).is_fillable());
}

TEST_CASE("Triangles are cut at T-junctions", "[mending]") {
  const TriangleMesh box = box_of_grids({1, 3, 5, 2, 7, 4});
  const SurfaceRepair repair = repair_surface(box);
  CHECK(repair.is_fillable);
  CHECK(done(repair).find("lie on open edges of triangles, which are cut there") != std::string::npos);
  CHECK(repair.done.size() == 1);
  CHECK(diagnose(repair.surface).is_fillable());
  CHECK(std::abs(volume_of(repair.surface)) == Approx(24));
  std::vector<double> areas(6, 0);
  for (std::size_t t = 0; t < repair.surface.triangles.size(); ++t) {
    const auto& [a, b, c] = repair.surface.triangles[t];
    const std::vector<Vec3>& p = repair.surface.positions;
    areas[repair.surface.face_groups.of_face[t]] += 0.5 * (p[b] - p[a]).cross(p[c] - p[a]).norm();
  }
  CHECK(areas[0] == Approx(6));
  CHECK(areas[3] == Approx(8));
  CHECK(areas[5] == Approx(12));
}

TEST_CASE("A surface with real holes only is left as it is", "[mending]") {
  TriangleMesh cube = cube_surface(4, false);
  cube.triangles.resize(cube.triangles.size() - 3);
  CHECK_FALSE(internal::tidy_surface(cube, diagnose(cube)));
  CHECK_FALSE(internal::tidy_surface(cube_surface(2, true), diagnose(cube_surface(2, true))));
}
