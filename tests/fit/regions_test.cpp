// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/export/export.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/fits/flat_faces.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/region_surface.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>

namespace subvol::test {

using namespace internal;

namespace {

constexpr double kMostVolumeChange = 1e-3;  // what people with several materials accept

/// A cube of 4^3 cells; the 2^3 cells in its middle are another material.
VolumeMesh cube_in_cube() {
  VolumeMesh mesh = lattice(4, 4, 4);
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i) {
        const auto inside = [](int a) { return a == 1 || a == 2; };
        mesh.references.push_back(inside(i) && inside(j) && inside(k) ? 2 : 1);
      }
  return mesh;
}

/// Two layers on each other; the interface between them is a wave along x with the given height.
VolumeMesh wavy_layers(double height) {
  VolumeMesh mesh = lattice(8, 3, 4);
  for (int k = 0; k < 4; ++k)
    for (int c = 0; c < 24; ++c) mesh.references.push_back(k < 2 ? 1 : 2);
  for (Vec3& p : mesh.positions)
    p.z() += height * (1 - std::abs(p.z() - 2) / 2) * std::sin(p.x() * std::acos(-1.0) / 4);
  return mesh;
}

/// Moves the vertices inside regions only.
void jitter_inside(VolumeMesh& mesh, double amount) {
  const MeshTopology topology(mesh);
  const InterfaceMarks marks = mark_interfaces(topology, find_interfaces(mesh, topology));
  VolumeMesh moved = mesh;
  jitter(moved, amount);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (!topology.is_boundary_vertex(static_cast<Index>(v)) && !marks.vertices[v])
      mesh.positions[v] = moved.positions[v];
}

double volume_change(const VolumeMesh& mesh, const VolumeMesh& start) {
  const std::vector<double> now = region_volumes(mesh), before = region_volumes(start);
  double largest = 0;
  for (std::size_t r = 0; r < now.size(); ++r) largest = std::max(largest, std::abs(now[r] / before[r] - 1));
  return largest;
}

TriangleMesh own_boundary(const VolumeMesh& mesh) { return fan_triangles(boundary_surface(mesh, MeshTopology(mesh))); }

/// Returns the largest distance of the vertices of the inner cube from its planes.
double distance_from_inner_cube(const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  double largest = 0;
  for (const Index f : find_interfaces(mesh, topology).faces)
    for (const Index v : topology.face(f)) {
      const Vec3 p = mesh.positions[v] - Vec3(2, 2, 2);
      largest = std::max(largest, std::abs(p.cwiseAbs().maxCoeff() - 1));
    }
  return largest;
}

}  // namespace

TEST_CASE("optimize keeps a cube of another material in a cube, and its volume", "[regions]") {
  const VolumeMesh sound = cube_in_cube();
  VolumeMesh mesh = sound;
  jitter_inside(mesh, 0.25);
  // A vertex of the interface slides within its plane.
  *std::ranges::find(mesh.positions, Vec3(2, 2, 1)) += Vec3(0.3, -0.2, 0);
  const OptimizeResult result = optimize_mesh(mesh, nullptr, {});
  CHECK(result.uncertified.empty());
  CHECK(measure_quality(result.mesh).min_scaled_jacobian > measure_quality(mesh).min_scaled_jacobian + 0.1);
  CHECK(distance_from_inner_cube(result.mesh) <= 1e-9);
  CHECK(volume_change(result.mesh, sound) <= 1e-9);
}

TEST_CASE("optimize keeps a wavy interface", "[regions]") {
  const VolumeMesh sound = wavy_layers(0.4);
  VolumeMesh mesh = sound;
  jitter_inside(mesh, 0.2);
  const OptimizeResult result = optimize_mesh(mesh, nullptr, {});
  CHECK(result.uncertified.empty());
  CHECK(measure_quality(result.mesh).min_scaled_jacobian > measure_quality(mesh).min_scaled_jacobian);
  CHECK(volume_change(result.mesh, sound) <= kMostVolumeChange);
  double height = 0;
  const MeshTopology topology(result.mesh);
  for (const Index f : find_interfaces(result.mesh, topology).faces)
    for (const Index v : topology.face(f)) height = std::max(height, result.mesh.positions[v].z() - 2);
  CHECK(height == Approx(0.4).epsilon(0.02));
}

TEST_CASE("a fixed boundary fixes interfaces, too", "[regions]") {
  VolumeMesh mesh = wavy_layers(0.3);
  jitter_inside(mesh, 0.2);
  OptimizeOptions options;
  options.fixed_boundary = true;
  const OptimizeResult result = optimize_mesh(mesh, nullptr, options);
  const MeshTopology topology(mesh);
  for (const Index f : find_interfaces(mesh, topology).faces)
    for (const Index v : topology.face(f)) CHECK((result.mesh.positions[v] - mesh.positions[v]).norm() <= 1e-12);
}

TEST_CASE("a fit of a template with regions keeps flat interfaces flat and volumes", "[regions]") {
  const VolumeMesh mesh = cube_in_cube();
  FitOptions options;
  options.levels = 1;
  options.crease_angle_degrees = 40;
  const FitResult result = fit_subdivision_volume(own_boundary(mesh), mesh, options);
  CHECK(certify(result.mesh).all_certified());
  CHECK(distance_from_inner_cube(result.mesh) <= 1e-9);
  CHECK(distance_from_inner_cube(result.cage) <= 1e-9);
  CHECK(volume_change(result.mesh, mesh) <= kMostVolumeChange);
  options.correspondence = Correspondence::voronoi;
  CHECK_THROWS_AS(fit_subdivision_volume(own_boundary(mesh), mesh, options), InputError);
}

TEST_CASE("a fit of a template with regions draws interfaces to those of the target", "[regions][slow]") {
  // The inner cube of the target is larger than that of the template, and not in the middle.
  VolumeMesh wanted = cube_in_cube();
  for (Vec3& p : wanted.positions)
    for (double& x : p) x = x == 1 ? 0.8 : x == 2 ? 1.9 : x;
  const TriangleMesh target = surface_of_regions(wanted).mesh;
  FitOptions options;
  options.levels = 2;
  options.crease_angle_degrees = 40;
  const FitResult result = fit_subdivision_volume(target, cube_in_cube(), options);
  CHECK(certify(result.mesh).all_certified());
  const std::vector<double> now = region_volumes(result.mesh), aim = region_volumes(wanted);
  REQUIRE(now.size() == 2);
  for (std::size_t r = 0; r < 2; ++r) CHECK(now[r] == Approx(aim[r]).epsilon(kMostVolumeChange));
  CHECK(region_volumes(cube_in_cube())[1] != Approx(aim[1]).epsilon(0.05));
}

TEST_CASE("interfaces that bulge are fitted by their subdivision surface", "[regions][slow]") {
  const VolumeMesh mesh = wavy_layers(0.3);
  for (const FittedSurface surface : {FittedSurface::limit, FittedSurface::mesh}) {
    FitOptions options;
    options.levels = 1;
    options.crease_angle_degrees = 40;
    options.surface = surface;
    const FitResult result = fit_subdivision_volume(own_boundary(mesh), mesh, options);
    CHECK(certify(result.mesh).all_certified());
    CHECK(volume_change(result.mesh, mesh) <= kMostVolumeChange);
  }
}

TEST_CASE("a curved fit keeps the interfaces of its template", "[regions]") {
  const VolumeMesh mesh = cube_in_cube();
  HighOrderFitOptions options;
  options.order = 2;
  const HighOrderFitResult result = fit_high_order(own_boundary(mesh), mesh, options);
  const BoundarySamples samples = make_sheet_samples(result.mesh.space, mesh, 3);
  const std::vector<Vec3> points = samples.positions.apply(result.mesh.coefficients);
  const MeshTopology& topology = result.mesh.space.topology();
  double largest = 0;
  for (std::size_t t = 0; t < samples.triangles.size(); ++t)
    if (!topology.is_boundary_face(samples.triangle_faces[t]))
      for (const Index i : samples.triangles[t])
        largest = std::max(largest, std::abs((points[i] - Vec3(2, 2, 2)).cwiseAbs().maxCoeff() - 1));
  CHECK(largest <= 5e-3);
}

TEST_CASE("samples of sheets lie on the boundary and on interfaces, whose normals point to the larger reference",
          "[regions]") {
  const VolumeMesh mesh = cube_in_cube();
  const ElementSpace space(mesh, Basis::legendre, 1);
  const BoundarySamples samples = make_sheet_samples(space, mesh, 2);
  const std::vector<Vec3> points = samples.positions.apply(mesh.positions);
  CHECK(samples.triangles.size() == (96 + 24) * 8);
  for (std::size_t t = 0; t < samples.triangles.size(); ++t) {
    const auto& [a, b, c] = samples.triangles[t];
    const Vec3 normal = (points[b] - points[a]).cross(points[c] - points[a]);
    const double outward = normal.dot(points[a] + points[b] + points[c] - 3 * Vec3(2, 2, 2));
    CHECK((outward > 0) == space.topology().is_boundary_face(samples.triangle_faces[t]));
  }
}

TEST_CASE("regions are measured: volumes, areas, interfaces, quality", "[regions]") {
  VolumeMesh mesh = cube_in_cube();
  mesh.regions = {{"core", 2, 3}};
  const QualityReport quality = measure_quality(mesh);
  const RegionReport report = measure_regions(mesh, &quality);
  REQUIRE(report.regions.size() == 2);
  CHECK(report.regions[0].volume == Approx(56));
  CHECK(report.regions[1].volume == Approx(8));
  CHECK(report.regions[1].name == "core");
  CHECK(report.regions[0].area == Approx(96));
  CHECK(report.regions[1].area == 0);
  CHECK(report.regions[1].num_cells == 8);
  CHECK(report.regions[1].min_scaled_jacobian == Approx(1));
  REQUIRE(report.interfaces.size() == 1);
  CHECK(report.interfaces[0].references == std::array{1, 2});
  CHECK(report.interfaces[0].num_faces == 24);
  CHECK(report.interfaces[0].area == Approx(24));
  const MeshCheck check = check_mesh(mesh);
  CHECK(check.regions);
  CHECK(to_text(check).find("region core") != std::string::npos);
  mesh.references.clear();
  CHECK_FALSE(check_mesh(mesh).regions);
  CHECK(region_volumes(mesh) == std::vector<double>{64});
}

TEST_CASE("regions of curved cells are measured: volumes are integrals of det J", "[regions]") {
  PointSource source(21);
  const VolumeMesh mesh = mixed_cells();
  const std::vector<int> references{1, 2, 2, 3};
  REQUIRE(mesh.num_cells() == references.size());
  for (const Basis basis : kBothBases)
    for (const int order : {1, 2, 3, 5}) {
      CAPTURE(to_string(basis), order);
      const HighOrderMesh curved = random_mesh(ElementSpace(mesh, basis, order), source);
      const RegionReport report = measure_regions(curved, {references, {}}, nullptr);
      std::vector<double> wanted(3, 0.0);
      for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
        constexpr int kPoints = 12;
        const CellKind kind = mesh.kinds[c];
        const Quadrature rule = make_quadrature(kind, QuadratureRule::gauss_lobatto, kPoints);
        const double size = kind == CellKind::tet ? 1.0 / 6 : kind == CellKind::prism ? 0.5 : 1;
        for (std::size_t q = 0; q < rule.points.size(); ++q)
          wanted[references[c] - 1] += size * rule.weights[q] * curved.jacobian(c, rule.points[q]).determinant();
      }
      REQUIRE(report.regions.size() == 3);
      const double tolerance = basis == Basis::legendre || order == 1 ? 1e-12 : 1e-3;
      for (std::size_t r = 0; r < 3; ++r)
        CHECK(report.regions[r].volume == Approx(wanted[r]).margin(tolerance).epsilon(tolerance));
    }
}

TEST_CASE("regions of curved cells are those of linear ones at order 1", "[regions]") {
  VolumeMesh mesh = cube_in_cube();
  mesh.regions = {{"core", 2, 3}};
  const HighOrderMesh curved(ElementSpace(mesh, Basis::legendre, 2), mesh);
  const MeshCheck check = check_mesh(curved, curved_boundary(curved, 1), static_cast<const TriangleMesh*>(nullptr),
                                     {.labels = {mesh.references, mesh.regions}});
  const QualityReport quality = measure_quality(mesh);
  const RegionReport wanted = measure_regions(mesh, &quality);
  REQUIRE(check.regions);
  for (std::size_t r = 0; r < 2; ++r) {
    const RegionQuality &found = check.regions->regions[r], &of_linear = wanted.regions[r];
    CHECK(found.name == of_linear.name);
    CHECK(found.num_cells == of_linear.num_cells);
    CHECK(found.volume == Approx(of_linear.volume));
    CHECK(found.area == Approx(of_linear.area).margin(1e-12));
    CHECK(found.min_scaled_jacobian == Approx(1));
  }
  REQUIRE(check.regions->interfaces.size() == 1);
  CHECK(check.regions->interfaces[0].num_faces == 24);
  CHECK(check.regions->interfaces[0].area == Approx(24));
  const std::vector<int> too_few(3, 1);
  CHECK_THROWS_AS(measure_regions(curved, {too_few, {}}, nullptr), InputError);
}

TEST_CASE("a curved fit lowers lambda until the regions have their volumes", "[regions][slow]") {
  // The inner cube of the target is larger than that of the template, and not in the middle.
  VolumeMesh wanted = cube_in_cube();
  for (Vec3& p : wanted.positions)
    for (double& x : p) x = x == 1 ? 0.8 : x == 2 ? 1.9 : x;
  HighOrderFitOptions options;
  options.order = 2;
  options.lambda_close = 1;
  const VolumeMesh mesh = cube_in_cube();
  const HighOrderFitResult result = fit_high_order(surface_of_regions(wanted).mesh, mesh, options);
  const RegionReport report = measure_regions(result.mesh, {mesh.references, {}}, nullptr);
  const std::vector<double> aim = region_volumes(wanted);
  for (std::size_t r = 0; r < 2; ++r) CHECK(report.regions[r].volume == Approx(aim[r]).epsilon(kMostVolumeChange));
}

TEST_CASE("meshes of several materials that people reported keep their regions", "[regions][data][slow]") {
  const auto folder = require_data();
  if (!folder) return;
  for (const char* name : {"19-wavy.mesh", "50-nested_two_materials.mesh"}) {
    const VolumeMesh mesh = read_volume_mesh(*folder / "reported" / name);
    CAPTURE(name);
    const OptimizeResult optimized = optimize_mesh(mesh, nullptr, {});
    CHECK(volume_change(optimized.mesh, mesh) <= kMostVolumeChange);
    CHECK(measure_quality(optimized.mesh).min_scaled_jacobian >= measure_quality(mesh).min_scaled_jacobian);
    FitOptions options;
    options.levels = 1;
    options.crease_angle_degrees = 40;
    const FitResult fit = fit_subdivision_volume(own_boundary(mesh), mesh, options);
    CHECK(certify(fit.mesh).all_certified());
    CHECK(volume_change(fit.mesh, mesh) <= kMostVolumeChange);
  }
}

}  // namespace subvol::test
