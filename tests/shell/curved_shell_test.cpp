// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/curved_shell.h"

#include "subvol/base/error.h"
#include "subvol/export/export.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/io/surface_io.h"
#include "subvol/surface/boundary.h"
#include "tests/support/require_data.h"
#include "tests/support/shell_fixtures.h"
#include "tests/support/surface_fixtures.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <numeric>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

CurvedBoundary fine_boundary(const HighOrderMesh& mesh) { return curved_boundary(mesh, 0.01); }

/// The guarantees, by means that share nothing with the shell's own: `check_mesh` and a dense grid of points; and the
/// surface as it was.
void check_valid(const ShellResult& shell, const CurvedShell& curved) {
  CHECK(curved.valid());
  CHECK(check_mesh(curved.mesh, fine_boundary(curved.mesh)).valid());
  const ShellLayers& layers = shell.layers;
  const BoundarySamples base = sheet_samples(layers, curved.mesh.space, layers.inside, 3);
  const ElementSpace linear = curved.mesh.space.with_orders(EntityOrders::uniform(curved.mesh.space.topology(), 1));
  const std::vector<Vec3> found = base.positions.apply(curved.mesh.coefficients),
                          flat = point_map(linear, base.points).apply(shell.mesh.positions);
  for (std::size_t i = 0; i < found.size(); ++i) REQUIRE((found[i] - flat[i]).norm() < 1e-12);
}

double mean_outside(const ShellLayers& layers, const std::vector<double>& strands) {
  return std::accumulate(strands.begin() + static_cast<std::ptrdiff_t>(layers.num_columns()), strands.end(), 0.0) /
         static_cast<double>(layers.num_columns());
}

}  // namespace

TEST_CASE("On a flat surface curved layers stay straight, whatever its faces", "[shell]") {
  for (const Faces faces : {Faces::triangles, Faces::quads, Faces::mixed})
    for (const Basis basis : {Basis::legendre, Basis::fourier}) {
      const ShellResult shell = make_shell(plane(faces), {.thickness = 0.1, .side = ShellSide::both, .layers = 2});
      const CurvedShell curved = curve_shell(shell, {.order = 3, .basis = basis});
      check_valid(shell, curved);
      for (std::size_t i = 0; i < curved.mesh.coefficients.size(); ++i)
        REQUIRE(
            (curved.mesh.coefficients[i] - (i < shell.mesh.num_vertices() ? shell.mesh.positions[i] : Vec3(0, 0, 0)))
                .norm() < 1e-9);
      CHECK(curved.quality.min_scaled_jacobian == Approx(1).epsilon(1e-9));
      CHECK(curved.thickness.achieved[0] == Approx(0.1).epsilon(1e-9));
    }
}

TEST_CASE("A sphere's curved shell is as thick as its energy says", "[shell][slow]") {
  // One layer of order 2: r(s) = 1 + h s + b s (1 - s) from the surface outward, and
  // E(h, b) = mean over the quadrature's heights s of ln^2(r'(s)/d)/2 + ln^2 r(s).
  const double d = 0.4;
  const ShellResult shell = make_shell(as_polygons(cube_surface(12, true)), {.thickness = d});
  const CurvedShell curved = curve_shell(shell, {.order = 2});
  check_valid(shell, curved);
  const int n = std::max(5, points_for_order(2));
  const auto energy_of = [&](double h, double b) {
    double sum = 0;
    for (int k = 0; k < n; ++k) {
      const double s = double(k) / (n - 1), slope = h + b * (1 - 2 * s);
      const double weight = (k == 0 || k == n - 1 ? 0.5 : 1.0) / (n - 1);
      sum += weight * (std::pow(std::log(slope / d), 2) / 2 + std::pow(std::log(1 + h * s + b * s * (1 - s)), 2));
    }
    return sum;
  };
  double h = d, b = 0, least = energy_of(h, b);
  for (double step = 0.05; step > 1e-6; step /= 2)
    for (bool better = true; better;) {
      better = false;
      for (const auto& [dh, db] : {std::pair{step, 0.0}, {-step, 0.0}, {0.0, step}, {0.0, -step}})
        if (const double tried = energy_of(h + dh, b + db); tried < least)
          least = tried, h += dh, b += db, better = true;
    }
  CHECK(mean_outside(shell.layers, curved.thickness.achieved) == Approx(h).epsilon(0.005));
}

TEST_CASE("Curved cells bend round sharp edges, valid on every side, and lower the energy", "[shell][slow]") {
  const std::vector<Vec3> u = profile({{0, 2, 0}, {0, 0, 0}, {1, 0, 0}, {1, 2, 0}}, 4),
                          l = profile({{0, 2, 0}, {0, 0, 0}, {2, 0, 0}}, 4);
  for (const auto* points : {&u, &l})
    for (const Faces faces : {Faces::triangles, Faces::quads})
      for (const ShellSide side : {ShellSide::outward, ShellSide::both}) {
        const ShellResult shell =
            make_shell(drawn_profile(*points, faces), {.thickness = 0.3, .side = side, .layers = 1});
        const CurvedShell curved = curve_shell(shell, {.order = points == &l ? 3 : 2, .boundary = fine_boundary});
        INFO("points " << points->size() << ", side " << static_cast<int>(side));
        check_valid(shell, curved);
        const ElementSpace& space = curved.mesh.space;
        const std::vector<int> grid_points(space.num_cells(), 5);
        const HighOrderEnergy energy(space, shell_reference(shell.layers, shell.limited), grid_points);
        CHECK(energy.value(curved.mesh.coefficients) <
              0.97 * energy.value(HighOrderMesh(space, shell.mesh).coefficients));
      }
}

TEST_CASE("Sheets of a curved shell run like the surface, with its edges", "[shell]") {
  const ShellResult shell =
      make_shell(as_polygons(cube_surface(3, true)), {.thickness = 0.2, .side = ShellSide::both, .layers = 1});
  const CurvedShell curved = curve_shell(shell, {.order = 2});
  for (int sheet = 0; sheet < 3; ++sheet) {
    const BoundarySamples samples = sheet_samples(shell.layers, curved.mesh.space, sheet, 4);
    const std::vector<Vec3> x = samples.positions.apply(curved.mesh.coefficients);
    CHECK(samples.triangles.size() == 16 * shell.layers.surface.num_faces());
    CHECK(samples.crease_edges.size() == 4 * shell.layers.topology.num_edges());
    for (const auto& [a, b, c] : samples.triangles) REQUIRE((x[b] - x[a]).cross(x[c] - x[a]).dot(x[a]) > 0);
  }
}

TEST_CASE("A curved shell has the same bits for one thread and for two", "[shell][slow]") {
  const ShellResult shell =
      make_shell(as_polygons(cube_surface(5, false)), {.thickness = 0.5, .side = ShellSide::both, .layers = 2});
  test::ThreadGuard guard;
  guard.use(1);
  const CurvedShell one = curve_shell(shell, {.order = 2});
  guard.use(2);
  const CurvedShell two = curve_shell(shell, {.order = 2});
  CHECK(one.mesh.coefficients == two.mesh.coefficients);
}

TEST_CASE("A shell whose curving is stopped is valid", "[shell][slow]") {
  const ShellResult shell = make_shell(as_polygons(cube_surface(5, false)), {.thickness = 0.5, .layers = 2});
  const CurvedShell curved =
      curve_shell(shell, {.order = 2, .control = {.progress = [](const FitProgress&) { return false; }}});
  CHECK(curved.report.stop_reason == StopReason::cancelled);
  check_valid(shell, curved);
}

TEST_CASE("A curved shell says when the steps allowed were not enough", "[shell][slow]") {
  const ShellResult shell = make_shell(as_polygons(cube_surface(5, false)), {.thickness = 0.5, .layers = 2});
  const CurvedShell curved = curve_shell(shell, {.order = 2, .control = {.max_iterations = 1}});
  CHECK(curved.report.stop_reason == StopReason::iteration_limit);
  check_valid(shell, curved);
  CHECK(curve_shell(shell, {.order = 2}).report.stop_reason == StopReason::converged);
}

TEST_CASE("Shells that cannot be curved are refused", "[shell]") {
  ShellResult shell = make_shell(plane(Faces::quads), {.thickness = 0.1});
  CHECK_THROWS_AS(curve_shell(shell, {.order = 0}), InputError);
  CHECK_THROWS_AS(curve_shell(shell, {.order = kMaxOrder + 1}), InputError);
  CHECK_THROWS_AS(curve_shell(shell, {.control = {.max_iterations = -1}}), InputError);
  shell.failures.intersecting.push_back({0, 1});
  CHECK_THROWS_AS(curve_shell(shell, {}), InputError);
}

TEST_CASE("A real surface gets a valid curved shell", "[shell][data][slow]") {
  const auto data = require_data();
  if (!data) return;
  const PolygonMesh surface = read_polygon_mesh(*data / "shell/bumpy_cube/surface.off");
  Vec3 low = surface.positions[0], high = low;
  for (const Vec3& p : surface.positions) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const ShellResult shell = make_shell(surface, {.thickness = 0.02 * (high - low).norm()});
  check_valid(shell, curve_shell(shell, {.order = 2}));
}
