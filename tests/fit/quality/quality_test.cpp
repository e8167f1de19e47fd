// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/quality/quality.h"
#include "subvol/base/error.h"
#include "subvol/fit/elements/element_rule.h"
#include "tests/support/threads.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <limits>
#include <numeric>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

VolumeMesh one_cell(CellKind kind, std::vector<Vec3> corners) {
  VolumeMesh mesh;
  mesh.positions = std::move(corners);
  std::vector<Index> vertices(mesh.positions.size());
  std::iota(vertices.begin(), vertices.end(), 0);
  mesh.add_cell(kind, vertices);
  return mesh;
}

VolumeMesh box(double x, double y, double z) {
  return one_cell(CellKind::hex,
                  {{0, 0, 0}, {x, 0, 0}, {x, y, 0}, {0, y, 0}, {0, 0, z}, {x, 0, z}, {x, y, z}, {0, y, z}});
}

VolumeMesh ideal_prism(double height) {
  const double h = std::sqrt(3.0) / 2;
  return one_cell(CellKind::prism,
                  {{0, 0, 0}, {1, 0, 0}, {0.5, h, 0}, {0, 0, height}, {1, 0, height}, {0.5, h, height}});
}

VolumeMesh ideal_tet() {
  return one_cell(CellKind::tet,
                  {{0, 0, 0}, {1, 0, 0}, {0.5, std::sqrt(3.0) / 2, 0}, {0.5, std::sqrt(3.0) / 6, std::sqrt(6.0) / 3}});
}

VolumeMesh ideal_pyramid() {
  return one_cell(CellKind::pyramid, {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.5, 0.5, std::sqrt(0.5)}});
}

VolumeMesh transformed(VolumeMesh mesh, const Mat3& map, const Vec3& shift) {
  for (Vec3& p : mesh.positions) p = map * p + shift;
  return mesh;
}

constexpr double kTolerance = 1e-12;  // some hundred roundings of numbers near 1

}  // namespace

TEST_CASE("ideal cells have scaled Jacobian one wherever they lie", "[quality]") {
  const Mat3 rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (const VolumeMesh& mesh :
       {box(1, 1, 1), box(0.1, 3, 70), ideal_prism(1), ideal_prism(9), ideal_tet(), ideal_pyramid()}) {
    for (const double scale : {1e-3, 1.0, 1e3}) {
      const QualityReport report = measure_quality(transformed(mesh, scale * rotation, Vec3(0.1, -2, 5)));
      CHECK(report.min_scaled_jacobian == Approx(1).epsilon(1e-9));
      CHECK(report.mean_scaled_jacobian == Approx(1).epsilon(1e-9));
      CHECK(report.inverted_cells == 0);
      CHECK(report.certificate.certified == 1);
      CHECK(report.histogram.back() == 1);
    }
  }
}

TEST_CASE("mean scaled Jacobians are those of the cells, whatever the number of samples", "[quality]") {
  for (VolumeMesh mesh : {box(1, 1, 1), ideal_prism(1)}) {
    mesh.positions.back() += Vec3(0.4, -0.3, 0.5);
    const double fine = measure_quality(mesh, 81).mean_scaled_jacobian;
    CHECK(fine < 0.98);
    for (const int n : {5, 9}) CHECK(std::abs(measure_quality(mesh, n).mean_scaled_jacobian - fine) < 0.1 / (n * n));
  }
}

TEST_CASE("scaled Jacobians of sheared and rectangular cells have their closed forms", "[quality]") {
  for (const double angle : {0.3, 1.0, 1.5, 2.5}) {
    Mat3 shear = Mat3::Identity();
    shear(0, 1) = std::cos(angle);
    shear(1, 1) = std::sin(angle);
    const QualityReport report = measure_quality(transformed(box(1, 1, 1), shear, Vec3::Zero()));
    CHECK(std::abs(report.min_scaled_jacobian - std::sin(angle)) < kTolerance);
    CHECK(std::abs(report.mean_scaled_jacobian - std::sin(angle)) < kTolerance);
  }
  // The right-angled corner tet: F = A^-1, columns of length 1, 2/sqrt3 and sqrt(3/2), det sqrt2.
  const VolumeMesh tet = one_cell(CellKind::tet, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  const Vec3 e1(1, 0, 0), e2 = Vec3(-1, 2, 0) / std::sqrt(3.0), e3 = Vec3(-1, -1, 3) / std::sqrt(6.0);
  const double expected = e1.dot(e2.cross(e3)) / (e1.norm() * e2.norm() * e3.norm());
  CHECK(std::abs(measure_quality(tet).min_scaled_jacobian - expected) < kTolerance);
  const VolumeMesh prism =
      one_cell(CellKind::prism, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}});
  CHECK(std::abs(measure_quality(prism).min_scaled_jacobian - e1.cross(e2).norm() / e2.norm()) < kTolerance);
}

TEST_CASE("mirrored and flat cells count as inverted, and the worst come first", "[quality]") {
  VolumeMesh mesh = box(1, 1, 1);
  const std::vector<Vec3> corners = mesh.positions;
  for (int c = 1; c < 30; ++c) {
    std::vector<Index> vertices(8);
    for (int v = 0; v < 8; ++v) {
      vertices[v] = static_cast<Index>(mesh.positions.size());
      Vec3 p = corners[v];
      if (c == 17) p[2] = -p[2];
      if (c == 4) p[2] = 0;
      mesh.positions.push_back(p);
    }
    mesh.add_cell(CellKind::hex, vertices);
  }
  const QualityReport report = measure_quality(mesh);
  CHECK(report.num_cells == 30);
  CHECK(report.num_samples == 30 * 125);
  CHECK(report.inverted_cells == 2);
  CHECK(report.min_scaled_jacobian == Approx(-1));
  REQUIRE(report.worst_cells.size() == 10);
  CHECK(report.worst_cells[0].cell == 17);
  CHECK(report.worst_cells[1].cell == 4);
  CHECK(report.worst_cells[1].value == 0);
  CHECK(report.worst_cells[2].cell == 0);
  CHECK(report.worst_cells[0].center.isApprox(Vec3(0.5, 0.5, -0.5)));
  CHECK(report.histogram[0] == 1);
  CHECK(report.histogram[10] == 1);
  CHECK(report.histogram[19] == 28);
  CHECK(report.certificate.invalid_cells == std::vector<Index>{17});
  CHECK(report.certificate.not_certified == std::vector<Index>{4, 17});
}

TEST_CASE("quality has the same bits for one and two threads, in lanes and alone", "[quality]") {
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> shift(-0.2, 0.2);
  VolumeMesh mesh;
  std::vector<double> alone;
  for (int c = 0; c < 203; ++c) {
    VolumeMesh cell = c % 50 == 3 ? ideal_prism(1) : box(1, 1, 1);
    for (Vec3& p : cell.positions) p += Vec3(shift(engine), shift(engine), shift(engine));
    alone.push_back(measure_quality(cell).min_scaled_jacobian);
    std::vector<Index> vertices(cell.positions.size());
    std::iota(vertices.begin(), vertices.end(), static_cast<Index>(mesh.positions.size()));
    mesh.positions.insert(mesh.positions.end(), cell.positions.begin(), cell.positions.end());
    mesh.add_cell(cell.kinds[0], vertices);
  }
  test::ThreadGuard guard;
  guard.use(1);
  const QualityReport one = measure_quality(mesh);
  guard.use(2);
  const QualityReport two = measure_quality(mesh);
  CHECK(one.cell_minima == two.cell_minima);
  CHECK(one.mean_scaled_jacobian == two.mean_scaled_jacobian);
  for (std::size_t c = 0; c < alone.size(); ++c) CHECK(std::abs(one.cell_minima[c] - alone[c]) < kTolerance);
}

TEST_CASE("quality is defined for odd input and refuses too few samples", "[quality]") {
  CHECK(measure_quality(VolumeMesh{}).num_cells == 0);
  CHECK_THROWS_AS(measure_quality(box(1, 1, 1), 1), InputError);
  VolumeMesh mesh = box(1, 1, 1);
  mesh.positions[6][1] = std::numeric_limits<double>::quiet_NaN();
  const QualityReport report = measure_quality(mesh);
  CHECK(report.min_scaled_jacobian == -1);
  CHECK(report.inverted_cells == 1);
  CHECK(report.certificate.certified == 0);
}

TEST_CASE("against a reference of their own cells have quality 1 in that shape, and against the ideal one the usual",
          "[quality]") {
  Mat3 shape;
  shape << 1.2, 0.3, -0.1, 0.1, 0.8, 0.2, -0.2, 0.1, 0.1;
  for (VolumeMesh mesh : {box(1, 1, 1), ideal_prism(1), ideal_tet()}) {
    const Mat3 ideal = ideal_matrix(mesh.kinds[0]);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> shift(-0.1, 0.1);
    VolumeMesh shaken = mesh;
    for (Vec3& p : shaken.positions) p += Vec3(shift(random), shift(random), shift(random));
    const QualityReport usual = measure_quality(shaken);
    const QualityReport same = measure_quality(shaken, 5, [&](Index, const Vec3&) { return Mat3(3 * ideal); });
    CHECK(same.min_scaled_jacobian == Approx(usual.min_scaled_jacobian).epsilon(1e-12));
    CHECK(same.mean_scaled_jacobian == Approx(usual.mean_scaled_jacobian).epsilon(1e-12));
    for (Vec3& p : mesh.positions) p = shape * p;
    const QualityReport own = measure_quality(mesh, 5, [&](Index, const Vec3&) { return Mat3(shape * ideal); });
    CHECK(own.min_scaled_jacobian == Approx(1).epsilon(1e-12));
    CHECK(measure_quality(mesh).min_scaled_jacobian < 0.9);
  }
}
