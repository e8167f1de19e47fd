// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/point_jacobians.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("Scaled Jacobians at the points of a rule are those of the columns there", "[point_jacobians]") {
  constexpr double kLeastLength = 1e-9;
  test::RandomPoints random(3);
  for (const CellKind kind : {CellKind::hex, CellKind::prism, CellKind::tet, CellKind::pyramid})
    for (const int points : {2, 3, 5}) {
      const ElementRule rule = make_element_rule(kind, points);
      const PointJacobians jacobians(rule);
      for (int trial = 0; trial < 20; ++trial) {
        std::vector<Vec3> corners = random.points(static_cast<std::size_t>(cell_topology(kind).num_vertices));
        if (trial == 0) std::fill(corners.begin(), corners.end(), corners[0]);  // all lengths vanish
        if (trial == 1) corners[1] = corners[0];
        std::array<double, PointJacobians::kMostPointJacobians> values;
        jacobians.evaluate(corners.data(), kLeastLength, values.data());
        double least = 2;
        for (std::size_t q = 0; q < rule.num_points(); ++q) {
          std::array<Vec3, 3> d{Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
          for (const ElementRule::Entry& entry : rule.point(q))
            for (int k = 0; k < 3; ++k) d[k] += entry.gradient[k] * corners[entry.vertex];
          double value = d[0].dot(d[1].cross(d[2]));
          for (const Vec3& column : d) value /= std::max(column.norm(), kLeastLength);
          CHECK(values[q] == Approx(value).margin(1e-12));
          least = std::min(least, values[q]);
        }
        CHECK(jacobians.least(corners.data(), kLeastLength) == least);
      }
    }
}
