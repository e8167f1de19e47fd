// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/winding_number.h"

#include "subvol/base/error.h"
#include "tests/support/region_fixtures.h"
#include "tests/support/surface_fixtures.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>
#include <utility>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("winding numbers agree with the sum over all triangles", "[surface]") {
  test::RandomPoints random(11);
  for (const TriangleMesh& surface : {test::cube_surface(12, true), test::triangle_soup(500, 0.3, 4)}) {
    const WindingNumber winding(surface);
    for (const Vec3& p : random.points(200, 1.5)) {
      double sum = 0;
      for (const auto& t : surface.triangles) {
        const Vec3 a = surface.positions[t[0]] - p, b = surface.positions[t[1]] - p, c = surface.positions[t[2]] - p;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
      }
      CHECK(std::abs(winding.at(p) - sum / (4 * std::numbers::pi)) < 0.01);
    }
  }
  const WindingNumber ball(test::cube_surface(12, true));
  CHECK(ball.at(Vec3(0.1, 0.2, 0)) == Approx(1).margin(0.01));
  CHECK(ball.at(Vec3(2, 0, 0)) == Approx(0).margin(0.01));
  CHECK_THROWS_AS(WindingNumber(TriangleMesh{}), InputError);
}

TEST_CASE("winding numbers at centers of symmetry", "[surface]") {
  const TriangleMesh octahedron{
      .positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
      .triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  TriangleMesh inward = octahedron, several;
  for (auto& t : inward.triangles) std::swap(t[1], t[2]);
  for (int copy = 0; copy < 5; ++copy) {  // all in one place, and all in one leaf or beside it
    const auto first = static_cast<Index>(several.positions.size());
    several.positions.insert(several.positions.end(), octahedron.positions.begin(), octahedron.positions.end());
    for (const auto& [a, b, c] : octahedron.triangles) several.triangles.push_back({first + a, first + b, first + c});
  }
  CHECK(WindingNumber(octahedron).at(Vec3::Zero()) == Approx(1));
  CHECK(WindingNumber(inward).at(Vec3::Zero()) == Approx(-1));
  CHECK(WindingNumber(several).at(Vec3::Zero()) == Approx(5));
  CHECK(WindingNumber(test::box_surface(Vec3::Zero(), Vec3::Ones())).at(Vec3::Constant(0.5)) == Approx(1));
  CHECK(WindingNumber(octahedron).at(Vec3(0, 0, 3)) == Approx(0).margin(0.01));
}
