// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/export/export.h"
#include "subvol/export/gltf_writer.h"
#include "subvol/fit/elements/map_projection.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/glb_reader.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include <map>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using subvol_tests::GlbFile;

namespace {

/// Cells of all kinds, bent smoothly.
HighOrderMesh bent(const VolumeMesh& straight, Basis basis, int order, double amount = 0.15) {
  const HighOrderMesh linear(ElementSpace(straight, basis, 1), straight);
  return project_map(ElementSpace(straight, basis, order), [&](std::size_t c, const Vec3& at) {
    const Vec3 x = linear.position(c, at);
    return Vec3(x + amount * Vec3(std::sin(2 * x[1]), std::sin(2 * x[2] + 1), std::cos(2 * x[0])));
  });
}

double patch_share(int t) { return static_cast<double>(t) / PatchSurface::kPatchSideUnits; }

bool is_closed(const TriangleMesh& mesh) {
  std::map<std::array<Index, 2>, int> balance;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const Index a = t[k], b = t[(k + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  return std::all_of(balance.begin(), balance.end(), [](const auto& entry) { return entry.second == 0; });
}

}  // namespace

TEST_CASE("patches lie on the curved boundary and have its normals") {
  for (const Basis basis : kBothBases) {
    const HighOrderMesh mesh = bent(mixed_cells(), basis, 4);
    const MeshTopology& topology = mesh.space.topology();
    const HighOrderPatches patches(mesh, 30);
    const std::vector<int> t{0, PatchSurface::kPatchSideUnits / 4, PatchSurface::kPatchSideUnits};
    std::vector<Vec3> positions(9), normals(9);
    for (std::size_t p = 0; p < patches.num_patches(); ++p) {
      patches.evaluate(static_cast<Index>(p), t, t, positions.data(), normals.data());
      const auto [face, corner] = patches.face_corner(static_cast<Index>(p));
      const Index f = topology.boundary_faces()[face];
      const auto vertices = topology.face(f);
      const std::size_t c = topology.face_cells(f)[0];
      const auto cell = mesh.space.vertices(c);
      std::vector<Vec3> canonical;
      for (const Index v : vertices)
        canonical.push_back(
            canonical_vertices(mesh.space.kind(c))[std::find(cell.begin(), cell.end(), v) - cell.begin()]);
      Vec3 center = Vec3::Zero();
      for (const Vec3& x : canonical) center += x / static_cast<double>(canonical.size());
      const std::size_t n = canonical.size(), k = static_cast<std::size_t>(corner);
      const auto at = [&](double u, double v) {
        return Vec3((1 - u) * (1 - v) * canonical[k] + u * (1 - v) * (canonical[k] + canonical[(k + 1) % n]) / 2 +
                    u * v * center + (1 - u) * v * (canonical[k] + canonical[(k + n - 1) % n]) / 2);
      };
      CHECK((positions[0] - mesh.coefficients[vertices[k]]).norm() < 1e-14);
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < 3; ++i) {
          const Vec3 point = at(patch_share(t[i]), patch_share(t[j]));
          CHECK((positions[3 * j + i] - mesh.position(c, point)).norm() < 1e-13);
          // n da = det J J^-T N dA
          const Vec3 outward = (canonical[1] - canonical[0]).cross(canonical[n - 1] - canonical[0]);
          const Mat3 jacobian = mesh.jacobian(c, point);
          const Vec3 expected = (jacobian.determinant() * jacobian.inverse().transpose() * outward).normalized();
          CHECK((normals[3 * j + i] - expected).norm() < 1e-12);
        }
    }
  }
  CHECK_THROWS_AS(HighOrderPatches(bent(mixed_cells(), Basis::fourier, 2), 181), InputError);
}

TEST_CASE("the curved boundary is tessellated closed and within the chord error") {
  const HighOrderMesh mesh = bent(mixed_cells(), Basis::legendre, 4);
  double coarse_volume = 0;
  for (const double percent : {0.5, 0.005}) {
    const CurvedBoundary boundary = curved_boundary(mesh, percent);
    HighOrderPatches patches(mesh, 180);
    CHECK(boundary.chord_error <= percent / 100 * patches.bounding_box_diagonal());
    CHECK(boundary.faces.size() == boundary.triangles.triangles.size());
    CHECK(is_closed(boundary.triangles));
    const MeshCheck check = check_mesh(mesh, boundary);
    CHECK(check.num_intersecting_triangle_pairs == 0);
    if (coarse_volume > 0) CHECK(std::abs(check.volume - coarse_volume) < 0.02);
    coarse_volume = check.volume;
  }
  // Against the integral over the cells.
  double volume = 0;
  for (std::size_t c = 0; c < mesh.space.num_cells(); ++c) {
    const Quadrature rule = make_quadrature(mesh.space.kind(c), QuadratureRule::gauss_lobatto, 12);
    const double size = mesh.space.kind(c) == CellKind::hex ? 1 : mesh.space.kind(c) == CellKind::prism ? 0.5 : 1.0 / 6;
    for (std::size_t q = 0; q < rule.points.size(); ++q)
      volume += size * rule.weights[q] * mesh.jacobian(c, rule.points[q]).determinant();
  }
  CHECK(coarse_volume == Approx(volume).epsilon(2e-4));
}

TEST_CASE("the scene of a high-order mesh has its curved surface and curved edges") {
  const HighOrderMesh mesh = bent(mixed_cells(), Basis::fourier, 3);
  const std::vector<double> minima{0.9, 0.8, 0.7, -0.1};
  const SurfaceSceneOptions options{.name = "bent", .max_chord_percent = 0.05, .source = "bent.vtu"};
  const Scene scene = surface_scene(mesh, minima, options);
  REQUIRE(scene.nodes.size() == 2);
  const ScenePrimitive &surface = scene.nodes[0].primitive, &wire = scene.nodes[1].primitive;
  CHECK(scene.nodes[0].name == "surface");
  CHECK(scene.nodes[1].name == "wireframe");
  CHECK(wire.topology == ScenePrimitive::Topology::lines);
  for (const Vec3& n : surface.normals) CHECK(n.norm() == Approx(1));
  REQUIRE(surface.attributes.size() == 1);
  CHECK(surface.attributes[0].name == "_SCALED_JACOBIAN");
  for (const double expected : minima)
    CHECK(std::find(surface.attributes[0].values.begin(), surface.attributes[0].values.end(), expected) !=
          surface.attributes[0].values.end());
  const MeshTopology& topology = mesh.space.topology();
  std::size_t num_boundary_edges = 0;
  for (std::size_t e = 0; e < topology.num_edges(); ++e)
    num_boundary_edges += topology.is_boundary_edge(static_cast<Index>(e));
  CHECK(wire.indices.size() / 2 > 2 * num_boundary_edges);
  const std::string bytes = gltf_bytes(scene, GltfContainer::glb);
  CHECK(GlbFile(bytes).attribute<float>("surface", "NORMAL").size() == 3 * surface.positions.size());
  CHECK(bytes == gltf_bytes(surface_scene(mesh, minima, options), GltfContainer::glb));
  CHECK(surface_scene(mesh, {}, options).nodes[0].primitive.colors.empty());
  CHECK_THROWS_AS(surface_scene(mesh, std::vector<double>{1}, options), InputError);
  CHECK_THROWS_AS(surface_scene(mesh, minima, {.max_chord_percent = 0}), InputError);
}

TEST_CASE("edges of curved cells are creases only where their faces meet sharply") {
  // A block bent gently: its own 12 edges are sharp, those between cells are not.
  const HighOrderMesh mesh = bent(lattice(2, 2, 2), Basis::legendre, 4, 0.05);
  const auto num_vertices = [&](double angle) {
    HighOrderPatches patches(mesh, angle);
    return tessellate(patches, 1).positions.size();  // the coarsest: the quads of one refinement
  };
  const std::size_t welded = 6 * 16 * 1 + 2;  // V = Q + 2 with Q = 6 * 4 * 4
  CHECK(num_vertices(180) == welded);
  CHECK(num_vertices(30) == 6 * 25);
  CHECK(num_vertices(0) > 6 * 25);
}

TEST_CASE("curved cells of linear shape have the quality of linear ones") {
  VolumeMesh straight = mixed_cells();
  jitter(straight, 0.1);
  for (const Basis basis : kBothBases) {
    const ElementSpace space(straight, basis, 3);
    const QualityReport curved = measure_quality(HighOrderMesh(space, straight), 5);
    const QualityReport linear = measure_quality(straight, 5);
    CHECK(curved.num_samples == linear.num_samples);
    CHECK(curved.mean_scaled_jacobian == Approx(linear.mean_scaled_jacobian));
    for (std::size_t c = 0; c < 4; ++c) CHECK(curved.cell_minima[c] == Approx(linear.cell_minima[c]));
    CHECK(curved.histogram == linear.histogram);
    REQUIRE(curved.worst_cells.size() == 4);
    CHECK(curved.worst_cells[0].cell == linear.worst_cells[0].cell);
  }
}

TEST_CASE("an inverted curved cell is found between its corners") {
  const VolumeMesh cube = single_cell(CellKind::hex);
  HighOrderMesh mesh(ElementSpace(cube, Basis::fourier, 4), cube);
  CHECK(measure_quality(mesh).min_scaled_jacobian == Approx(1));
  CHECK(measure_quality(mesh).num_samples == 11 * 11 * 11);
  const Index node = static_cast<Index>(mesh.space.cell_nodes(0));
  mesh.coefficients[node] = Vec3(8, 0, 0);  // the middle swings out; corners stay right-handed
  const QualityReport report = measure_quality(mesh);
  CHECK(report.inverted_cells == 1);
  CHECK(report.min_scaled_jacobian < 0);
  mesh.coefficients[node].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(measure_quality(mesh).min_scaled_jacobian == -1);
  CHECK_THROWS_AS(measure_quality(mesh, 1), InputError);
}

TEST_CASE("the check of a curved mesh says what it is made of") {
  const HighOrderMesh mesh = bent(mixed_cells(), Basis::fourier, 3);
  const CurvedBoundary boundary = curved_boundary(mesh, 0.01);
  const MeshCheck check = check_mesh(mesh, boundary, &boundary.triangles);
  CHECK(check.defects.empty());
  REQUIRE(check.orders);
  CHECK(check.orders->min_order == 3);
  CHECK(check.orders->num_nodes == mesh.coefficients.size());
  CHECK(check.orders->num_full_order_nodes == check.orders->num_nodes);
  REQUIRE(check.distance);
  CHECK(check.distance->max() < 1e-12);
  CHECK(check.boundary_euler_number == 2);
  CHECK(check.quality->inverted_cells == 0);
  const std::string text = to_text(check);
  CHECK(text.find("3 to 3, fourier basis") != std::string::npos);
  CHECK(text.find("within") != std::string::npos);

  HighOrderMesh tangled = mesh;  // a face pushed through the opposite one
  for (const Index f : mesh.space.topology().boundary_faces()) {
    if (mesh.space.face_shape(f) != EntityShape::quad) continue;
    tangled.coefficients[mesh.space.face_nodes(f)] += Vec3(30, 30, 30);
    break;
  }
  const MeshCheck bad = check_mesh(tangled, curved_boundary(tangled, 0.1));
  CHECK(bad.num_intersecting_triangle_pairs > 0);
  CHECK_FALSE(bad.valid());
}
