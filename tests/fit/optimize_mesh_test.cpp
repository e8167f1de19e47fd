// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/optimize_mesh.h"
#include "subvol/base/error.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// A lattice of n^3 cubes, each cut into cells of one kind: 1 hex, 2 prisms, 6 tets, 6 pyramids.
VolumeMesh cut_lattice(int n, CellKind kind) {
  VolumeMesh cubes = test::lattice(n, n, n);
  if (kind == CellKind::hex) return cubes;
  if (kind == CellKind::pyramid) return test::pyramid_lattice(n);
  VolumeMesh mesh;
  mesh.positions = cubes.positions;
  for (std::size_t c = 0; c < cubes.num_cells(); ++c) {
    const auto v = cubes.cell(c);
    if (kind == CellKind::prism) {
      mesh.add_cell(kind, std::array<Index, 6>{v[0], v[1], v[2], v[4], v[5], v[6]});
      mesh.add_cell(kind, std::array<Index, 6>{v[0], v[2], v[3], v[4], v[6], v[7]});
    } else {
      for (const auto& [a, b] : {std::array{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}})
        mesh.add_cell(kind, std::array<Index, 4>{v[0], v[a], v[b], v[6]});
    }
  }
  return mesh;
}

/// Throws inner vertices anywhere into a box.
VolumeMesh scrambled(VolumeMesh mesh, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, size);
  const MeshTopology topology(mesh);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (!topology.is_boundary_vertex(static_cast<Index>(v)))
      for (int d = 0; d < 3; ++d) mesh.positions[v][d] = uniform(random);
  return mesh;
}

TriangleMesh refined_surface(const VolumeMesh& mesh) {
  return refined_triangles(boundary_surface(mesh, MeshTopology(mesh)));
}

}  // namespace

TEST_CASE("A scrambled lattice of each kind gets back the lattice's quality") {
  constexpr int kSize = 4;
  for (const CellKind kind : {CellKind::hex, CellKind::prism, CellKind::tet, CellKind::pyramid})
    for (const bool fixed : {true, false}) {
      const unsigned seed = fixed ? 1 : 2;
      INFO(cell_topology(kind).name << ", seed " << seed << ", fixed " << fixed);
      const VolumeMesh lattice = cut_lattice(kSize, kind), start = scrambled(lattice, kSize, seed);
      REQUIRE(validate(lattice).empty());
      REQUIRE(test::count_inverted(start) > start.num_cells() / 5);
      const OptimizeResult result = optimize_mesh(start, nullptr, {.fixed_boundary = fixed});
      CHECK(result.uncertified.empty());
      CHECK(certify(result.mesh).all_certified());
      CHECK(result.report.stop_reason == StopReason::converged);
      const QualityReport wanted = measure_quality(lattice), found = measure_quality(result.mesh);
      CHECK(found.mean_scaled_jacobian > 0.98 * wanted.mean_scaled_jacobian);
      // Cut cubes have no ideal cells: where the boundary may slide too, the best mean is not at the lattice.
      CHECK(found.min_scaled_jacobian > 0.9 * wanted.min_scaled_jacobian);
    }
}

TEST_CASE("Optimization: fixed boundary vertices stay bit by bit; the others slide along their surface") {
  constexpr int kSize = 4;
  const VolumeMesh lattice = test::lattice(kSize, kSize, kSize);
  VolumeMesh start = lattice;
  const MeshTopology topology(start);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  for (Vec3& p : start.positions)
    for (int d = 0; d < 3; ++d)
      if (p[d] > 0 && p[d] < kSize) p[d] += uniform(random);  // vertices stay on faces and edges of the cube

  const OptimizeResult fixed = optimize_mesh(start, nullptr, {.fixed_boundary = true});
  for (std::size_t v = 0; v < start.num_vertices(); ++v)
    if (topology.is_boundary_vertex(static_cast<Index>(v))) CHECK(fixed.mesh.positions[v] == start.positions[v]);

  const OptimizeResult sliding = optimize_mesh(start, nullptr, {});
  const TriangleMesh surface = refined_surface(lattice);
  const MeshCheck check = check_mesh(sliding.mesh, &surface);
  CHECK(check.valid());
  CHECK(check.max_distance_percent() < 0.1);
  CHECK(measure_quality(sliding.mesh).min_scaled_jacobian > measure_quality(fixed.mesh).min_scaled_jacobian);
  CHECK(measure_quality(sliding.mesh).min_scaled_jacobian > 0.95);
  for (std::size_t v = 0; v < start.num_vertices(); ++v) {
    int on = 0;
    for (int d = 0; d < 3; ++d) on += lattice.positions[v][d] == 0 || lattice.positions[v][d] == kSize;
    if (on == 3) CHECK((sliding.mesh.positions[v] - lattice.positions[v]).norm() < 1e-12);
  }
}

TEST_CASE("Optimization keeps creases that the mesh's tags name, whatever their angle") {
  constexpr int kSize = 4;
  constexpr double kLine = 1.5;
  VolumeMesh mesh = test::lattice(kSize, kSize, kSize);
  std::vector<Index> line;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v) {
    Vec3& p = mesh.positions[v];
    if (p.y() != 2 || p.z() != kSize) continue;
    p.y() = kLine;  // a line across the top that even cells would leave
    line.push_back(static_cast<Index>(v));
  }
  std::sort(line.begin(), line.end(), [&](Index a, Index b) { return mesh.positions[a].x() < mesh.positions[b].x(); });
  const auto farthest_from_line = [&] {
    const OptimizeResult result = optimize_mesh(mesh, nullptr, {.sizes = CellSizes::uniform});
    CHECK(result.uncertified.empty());
    double farthest = 0;
    for (const Index v : line) farthest = std::max(farthest, std::abs(result.mesh.positions[v].y() - kLine));
    return farthest;
  };
  CHECK(farthest_from_line() > 0.2);
  for (std::size_t i = 0; i + 1 < line.size(); ++i)
    mesh.tags.creases.push_back({std::min(line[i], line[i + 1]), std::max(line[i], line[i + 1])});
  std::sort(mesh.tags.creases.begin(), mesh.tags.creases.end(),
            [](const CreaseEdge& a, const CreaseEdge& b) { return std::pair(a.v0, a.v1) < std::pair(b.v0, b.v1); });
  CHECK(farthest_from_line() < 0.005 * kSize * std::sqrt(3.0));  // the largest distance asked for
}

TEST_CASE("Graded meshes stay graded with local sizes, and become even with uniform ones") {
  constexpr int kSize = 6;
  VolumeMesh graded = test::lattice(kSize, kSize, kSize);
  for (Vec3& p : graded.positions) p.x() = kSize * (std::pow(1.4, p.x()) - 1) / (std::pow(1.4, kSize) - 1);
  const auto farthest_move = [&](CellSizes sizes) {
    const OptimizeResult result = optimize_mesh(graded, nullptr, {.sizes = sizes});
    CHECK(result.uncertified.empty());
    double farthest = 0;
    for (std::size_t v = 0; v < graded.num_vertices(); ++v)
      farthest = std::max(farthest, (result.mesh.positions[v] - graded.positions[v]).norm());
    return farthest;
  };
  CHECK(farthest_move(CellSizes::local) < 0.01);
  CHECK(farthest_move(CellSizes::uniform) > 0.3);
}

TEST_CASE("Without a target, optimization keeps the volume of a curved body") {
  constexpr int kLength = 24, kWidth = 4;
  VolumeMesh bar = test::lattice(kLength, kWidth, kWidth);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.2, 0.2);
  const MeshTopology topology(bar);
  for (std::size_t v = 0; v < bar.num_vertices(); ++v) {
    Vec3& p = bar.positions[v];
    if (p.x() > 0 && p.x() < kLength) p.x() += uniform(random);
    if (!topology.is_boundary_vertex(static_cast<Index>(v))) p += Vec3(0, uniform(random), uniform(random));
    const double angle = 0.1 * p.x(), radius = 12 - p.y();
    p = Vec3(radius * std::sin(angle), -radius * std::cos(angle), p.z());
  }
  const OptimizeResult result = optimize_mesh(bar, nullptr, {});
  CHECK(measure_quality(result.mesh).min_scaled_jacobian > measure_quality(bar).min_scaled_jacobian + 0.2);
  CHECK(result.uncertified.empty());
  CHECK(result.report.warnings.empty());
  CHECK(region_volumes(result.mesh)[0] == Approx(region_volumes(bar)[0]).epsilon(1e-6));
}

TEST_CASE("Optimization says which cells stay inverted") {
  // A vertex of the boundary on the wrong side of its neighbors: no inner vertex can help.
  VolumeMesh mesh = test::lattice(3, 3, 3);
  const Index corner = 0;
  REQUIRE(mesh.positions[corner] == Vec3(0, 0, 0));
  mesh.positions[corner] = Vec3(1.5, 1.5, 1.5);
  const OptimizeResult result = optimize_mesh(mesh, nullptr, {.fixed_boundary = true});
  CHECK(result.report.stop_reason == StopReason::stalled);
  CHECK(result.uncertified == certify(result.mesh).not_certified);
  REQUIRE_FALSE(result.uncertified.empty());
  CHECK(result.uncertified[0] == 0);
  for (const Vec3& p : result.mesh.positions) CHECK(p.allFinite());
}

TEST_CASE("Optimization tells if a named plane inside the mesh is bent") {
  VolumeMesh mesh = test::lattice(4, 4, 4);
  const MeshTopology topology(mesh);
  mesh.face_groups.groups = {{"mid plane", 1, 2}};
  for (std::size_t f = 0; f < topology.num_faces(); ++f) {
    const auto corners = topology.face(static_cast<Index>(f));
    if (std::all_of(corners.begin(), corners.end(), [&](Index v) { return mesh.positions[v].x() == 2; }))
      mesh.face_groups.faces.push_back({face_key(corners), 0});
  }
  normalize(mesh.face_groups);
  REQUIRE(mesh.face_groups.faces.size() == 16);
  const auto warnings_of = [](const VolumeMesh& given) { return optimize_mesh(given, nullptr, {}).report.warnings; };
  CHECK(warnings_of(mesh).empty());
  for (Vec3& p : mesh.positions)
    if ((p.array() > 0.5).all() && (p.array() < 3.5).all() && p.x() != 2) p += Vec3(0.3, 0.2 * p.y(), -0.2);
  const std::vector<std::string> warnings = warnings_of(mesh);
  CHECK(std::ranges::any_of(warnings, [](const std::string& text) {
    return text.find("'mid plane' inside the mesh left their planes") != std::string::npos;
  }));
}

TEST_CASE("Two tangled regions become valid, also if their volumes cannot be kept", "[slow]") {
  for (const unsigned seed : {3u, 13u, 17u, 18u}) {
    CAPTURE(seed);
    VolumeMesh mesh = test::lattice(4, 4, 4);
    std::mt19937 random(seed);
    const auto unit = [&] { return static_cast<double>(random()) / 4294967296.0; };
    for (Vec3& p : mesh.positions) {
      const bool is_inner = (p.array() > 0.5).all() && (p.array() < 3.5).all();
      for (int i = 0; i < 3; ++i) {
        const double move = unit() + unit() + unit() - 1.5;
        if (is_inner) p[i] += 0.96 * move;
      }
    }
    mesh.references.assign(mesh.num_cells(), 1);
    std::fill(mesh.references.begin() + 32, mesh.references.end(), 2);
    CHECK(certify(mesh).not_certified.size() > 20);
    CHECK(optimize_mesh(mesh, nullptr, {}).uncertified.empty());
  }
}

TEST_CASE("Optimization draws the boundary to a target, and keeps references and tags") {
  VolumeMesh mesh = test::lattice(3, 3, 3);
  mesh.references.assign(mesh.num_cells(), 7);
  test::tag_creases(mesh, 40);
  VolumeMesh larger = test::lattice(3, 3, 3);
  for (Vec3& p : larger.positions) p = 1.05 * p - Vec3(0.05, 0.05, 0.05);
  const TriangleMesh target = refined_surface(larger);
  const OptimizeResult result = optimize_mesh(mesh, &target, {});
  const MeshCheck check = check_mesh(result.mesh, &target);
  CHECK(check.valid());
  CHECK(check.mean_distance_percent() < 0.05);
  CHECK(check.max_distance_percent() < 0.5);
  CHECK(result.mesh.references == mesh.references);
  CHECK(result.mesh.tags == mesh.tags);
}

TEST_CASE("Optimization gives the same bits for any number of threads, and can be cancelled") {
  const VolumeMesh start = scrambled(test::lattice(4, 4, 4), 4, 9);
  test::ThreadGuard guard;
  guard.use(1);
  const OptimizeResult one = optimize_mesh(start, nullptr, {});
  guard.use(4);
  const OptimizeResult four = optimize_mesh(start, nullptr, {});
  CHECK(one.mesh.positions == four.mesh.positions);

  const OptimizeResult cancelled =
      optimize_mesh(start, nullptr, {.control = {.progress = [](const FitProgress&) { return false; }}});
  CHECK(cancelled.report.stop_reason == StopReason::cancelled);
  CHECK(cancelled.report.stages.back().mean_distance_percent < 0);  // nobody goes on from there: not measured
  CHECK(cancelled.uncertified == certify(cancelled.mesh).not_certified);
}

TEST_CASE("Optimization refuses options out of range and meshes that are not sound") {
  const VolumeMesh mesh = test::lattice(2, 2, 2);
  const TriangleMesh target = refined_surface(mesh);
  CHECK_THROWS_AS(optimize_mesh(mesh, &target, {.fixed_boundary = true}), InputError);
  CHECK_THROWS_AS(optimize_mesh(mesh, nullptr, {.lambda = 0.0}), InputError);
  CHECK_THROWS_AS(optimize_mesh(mesh, nullptr, {.crease_angle_degrees = 181}), InputError);
  CHECK_THROWS_AS(optimize_mesh(mesh, nullptr, {.mean_tolerance_percent = -1}), InputError);
  VolumeMesh broken = mesh;
  broken.positions[3].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(optimize_mesh(broken, nullptr, {}), InputError);
  CHECK_THROWS_AS(optimize_mesh(VolumeMesh{}, nullptr, {}), InputError);
}

TEST_CASE("Most cells of a real mesh inverted: all become valid, and the boundary stays", "[slow]") {
  const auto data = test::require_data();
  if (!data) return;
  const VolumeMesh start = read_volume_mesh(*data / "optimize" / "block_stress" / "input.mesh", {.check = false});
  const TriangleMesh surface = refined_surface(start);
  const OptimizeResult result = optimize_mesh(start, nullptr, {});
  const MeshCheck check = check_mesh(result.mesh, &surface);
  CHECK(check.valid());
  CHECK(check.quality->min_scaled_jacobian >= 0.2);
  CHECK(check.quality->mean_scaled_jacobian >= 0.83);
  CHECK(check.mean_distance_percent() <= 0.05);
  CHECK(check.max_distance_percent() <= 0.5);
}

TEST_CASE("A mesh that cannot be made better comes back bit for bit, a valid one never gets worse") {
  const VolumeMesh perfect = test::lattice(4, 3, 2);
  for (const bool fixed : {false, true}) {
    OptimizeOptions options;
    options.fixed_boundary = fixed;
    CHECK(optimize_mesh(perfect, nullptr, options).mesh.positions == perfect.positions);
  }
  // A slanted box: its planar faces hold its cells in their shape.
  VolumeMesh slanted = perfect;
  for (Vec3& p : slanted.positions) p.x() += 0.4 * p.y();
  const QualityReport before = measure_quality(slanted);
  const QualityReport after = measure_quality(optimize_mesh(slanted, nullptr, {}).mesh);
  CHECK(after.min_scaled_jacobian >= before.min_scaled_jacobian - 1e-6);
  CHECK(after.certificate.all_certified());
}
