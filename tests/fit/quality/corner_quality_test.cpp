// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/quality/corner_quality.h"

#include "subvol/fit/quality/quality.h"

#include <catch2/catch.hpp>

#include <cmath>

using namespace subvol;

namespace {

VolumeMesh cell(CellKind kind, std::vector<Vec3> positions) {
  VolumeMesh mesh;
  mesh.positions = std::move(positions);
  std::vector<Index> corners;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) corners.push_back(static_cast<Index>(i));
  mesh.add_cell(kind, corners);
  return mesh;
}

VolumeMesh cube() {
  return cell(CellKind::hex, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}});
}

}  // namespace

TEST_CASE("A cell with a coordinate that is not finite is as poor as can be", "[quality]") {
  VolumeMesh mesh = cube();
  mesh.positions[6].y() = std::nan("");
  CHECK(measure_corner_quality(mesh).cell_minima[0] == -1);
}

TEST_CASE("Ideal cells have corner scaled Jacobians of 1", "[quality]") {
  const double h = std::sqrt(3.0) / 2;
  const VolumeMesh prism =
      cell(CellKind::prism, {{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}, {0, 0, 7}, {1, 0, 7}, {0.5, h, 7}});
  const VolumeMesh tet = cell(CellKind::tet, {{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}, {0.5, h / 3, std::sqrt(2.0 / 3)}});
  const VolumeMesh pyramid =
      cell(CellKind::pyramid, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, std::sqrt(0.5)}});
  for (const VolumeMesh& mesh : {cube(), prism, tet, pyramid}) {
    const CornerQuality quality = measure_corner_quality(mesh);
    CHECK(quality.min_scaled_jacobian == Approx(1).epsilon(1e-12));
    CHECK(quality.mean_scaled_jacobian == Approx(1).epsilon(1e-12));
  }
  CHECK(measure_corner_quality({}).min_scaled_jacobian == 1);
}

TEST_CASE("The corner scaled Jacobian of a hex is that of its worst corner", "[quality]") {
  VolumeMesh mesh = cube();
  mesh.positions[6] = {0.9, 0.8, 0.7};
  CHECK(measure_corner_quality(mesh).min_scaled_jacobian ==
        Approx(measure_quality(mesh, 2).min_scaled_jacobian).epsilon(1e-9));
  mesh.positions[6] = {-1, -1, -1};
  CHECK(measure_corner_quality(mesh).min_scaled_jacobian < 0);
  mesh.positions[6] = mesh.positions[5];
  CHECK(measure_corner_quality(mesh).min_scaled_jacobian <= 1e-12);
}

TEST_CASE("The corner scaled Jacobian of a right prism is the sine of its least angle over that of 60 degrees",
          "[quality]") {
  const VolumeMesh prism = cell(CellKind::prism, {{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 0, 1}, {0, 1, 1}});
  CHECK(measure_corner_quality(prism).min_scaled_jacobian == Approx(1 / std::sqrt(5.0) * 2 / std::sqrt(3.0)));
}
