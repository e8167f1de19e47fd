// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mesh_check.h"
#include "subvol/base/error.h"
#include "subvol/export/export.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

using namespace subvol;
using namespace subvol::internal;
using subvol::test::lattice;
using subvol::test::voxels;

namespace {

TriangleMesh boundary_triangles(const VolumeMesh& mesh) {
  return triangulate(boundary_surface(mesh, MeshTopology(mesh)));
}

bool has(const MeshCheck& check, MeshDefect::Kind kind) {
  return std::any_of(check.defects.begin(), check.defects.end(), [&](const MeshDefect& d) { return d.kind == kind; });
}

}  // namespace

TEST_CASE("a block of cubes passes every check, with its numbers", "[mesh_check]") {
  const VolumeMesh mesh = lattice(3, 2, 2);
  const TriangleMesh target = boundary_triangles(mesh);
  const MeshCheck check = check_mesh(mesh, &target);
  CHECK(check.valid());
  CHECK(check.defects.empty());
  CHECK(check.num_cells == 12);
  CHECK(check.num_cells_of_kind[static_cast<int>(CellKind::hex)] == 12);
  CHECK(check.num_boundary_faces == 32);
  CHECK(check.num_components == 1);
  CHECK(check.num_boundary_components == 1);
  CHECK(check.boundary_euler_number == 2);
  CHECK(check.euler_number == 1);
  CHECK(check.volume == Approx(12));
  CHECK(check.quality->min_scaled_jacobian == Approx(1));
  CHECK(check.intersecting_faces.empty());
  REQUIRE(check.distance);
  CHECK(check.distance->max() < 1e-14);
  CHECK(check.target_diagonal == Approx(std::sqrt(17.0)));
  const std::string text = to_text(check);
  CHECK(text.find("12 hex") != std::string::npos);
  CHECK(text.find("certified cells     12 of 12") != std::string::npos);
  CHECK(text.ends_with("\nvalid\n"));
}

TEST_CASE("a tag that is on no boundary edge is a defect, and the rest is looked at", "[mesh_check]") {
  VolumeMesh mesh = lattice(2, 1, 1);
  mesh.tags.creases = {{0, 9, kInfiniteSharpness}};
  const MeshCheck check = check_mesh(mesh);
  CHECK(has(check, MeshDefect::Kind::bad_tag));
  CHECK(!check.valid());
  CHECK(!check.subdivision_audit);
  CHECK(check.volume == Approx(2));
}

TEST_CASE("a ring and a hollow block have their topology", "[mesh_check]") {
  const MeshCheck ring = check_mesh(voxels(3, 3, 1, [](int i, int j, int) { return i != 1 || j != 1; }));
  CHECK(ring.valid());
  CHECK(ring.boundary_euler_number == 0);
  CHECK(ring.euler_number == 0);
  const MeshCheck hollow = check_mesh(voxels(3, 3, 3, [](int i, int j, int k) { return i != 1 || j != 1 || k != 1; }));
  CHECK(hollow.valid());
  CHECK(hollow.num_boundary_components == 2);
  CHECK(hollow.boundary_euler_number == 4);
  CHECK(hollow.euler_number == 2);
  CHECK(hollow.volume == Approx(26));
  const MeshCheck apart = check_mesh(voxels(3, 1, 1, [](int i, int, int) { return i != 1; }));
  CHECK(apart.valid());
  CHECK(apart.num_components == 2);
}

TEST_CASE("an inverted cell and a boundary that runs through itself are not valid", "[mesh_check]") {
  VolumeMesh pushed = lattice(2, 2, 2);
  for (Vec3& p : pushed.positions)
    if (p == Vec3(2, 2, 2)) p = Vec3(0.5, 0.5, 0.5);
  const MeshCheck inverted = check_mesh(pushed);
  CHECK_FALSE(inverted.valid());
  CHECK(inverted.quality->inverted_cells == 1);
  CHECK(inverted.quality->certificate.invalid == 1);
  REQUIRE(inverted.witnesses.size() == 1);
  const InversionWitness& witness = inverted.witnesses[0];
  CHECK(witness.cell == inverted.quality->certificate.invalid_cells[0]);
  CHECK(witness.determinant < 0);
  CHECK(witness.position.minCoeff() >= 0);
  CHECK(witness.position.maxCoeff() <= 2);
  CHECK(to_text(inverted).find("inverted at\n") != std::string::npos);
  CHECK(to_text(inverted).find("histogram ") != std::string::npos);

  // Two cubes of a bar bent round until its ends overlap: every cell is sound, the whole is not.
  VolumeMesh overlapping = voxels(3, 1, 1, [](int i, int, int) { return i != 1; });
  for (Vec3& p : overlapping.positions)
    if (p[0] > 1.5) p -= Vec3(1.5, 0.25, 0.25);
  const MeshCheck crossing = check_mesh(overlapping);
  CHECK(crossing.quality->certificate.all_certified());
  CHECK_FALSE(crossing.intersecting_faces.empty());
  CHECK_FALSE(crossing.valid());
  CHECK(to_text(crossing).ends_with("\nNOT VALID\n"));
}

TEST_CASE("a solid inside another one is not valid, one in its cavity is", "[mesh_check]") {
  const auto blocks = [](const VolumeMesh& outer, double size) {
    VolumeMesh mesh = outer;
    const auto first = static_cast<Index>(mesh.num_vertices());
    const VolumeMesh inner = lattice(1, 1, 1);
    for (const Vec3& p : inner.positions) mesh.positions.push_back(Vec3(1.5, 1.5, 1.5) + size * (p - Vec3(.5, .5, .5)));
    std::vector<Index> corners;
    for (const Index v : inner.cell(0)) corners.push_back(first + v);
    mesh.add_cell(inner.kinds[0], corners);
    return mesh;
  };
  const VolumeMesh solid = lattice(3, 3, 3);
  VolumeMesh hollow;
  hollow.positions = solid.positions;
  for (std::size_t c = 0; c < solid.num_cells(); ++c)
    if (c != 13) hollow.add_cell(solid.kinds[c], solid.cell(c));
  const MeshCheck inside = check_mesh(blocks(solid, 0.5), nullptr, {});
  CHECK(inside.intersecting_faces.empty());
  REQUIRE(inside.parts_inside_solids.size() == 1);
  CHECK((inside.parts_inside_solids[0] - Vec3(1.5, 1.5, 1.5)).norm() < 0.5);
  CHECK_FALSE(inside.valid());
  CHECK(to_text(inside).find("solid in a solid") != std::string::npos);
  CHECK(check_mesh(blocks(hollow, 0.5), nullptr, {}).valid());
  CHECK(check_mesh(hollow, nullptr, {}).valid());
}

TEST_CASE("distances to a target are told in length and in percent of the target's diagonal", "[mesh_check]") {
  const VolumeMesh mesh = lattice(1, 1, 1);
  TriangleMesh target = boundary_triangles(mesh);
  for (Vec3& p : target.positions) p = Vec3(0.5, 0.5, 0.5) + 1.2 * (p - Vec3(0.5, 0.5, 0.5));
  const MeshCheck check = check_mesh(mesh, &target);
  CHECK(check.distance->max() == Approx(0.1 * std::sqrt(3.0)));
  CHECK(check.max_distance_percent() == Approx(100 * 0.1 / 1.2));
  CHECK(check.mean_distance_percent() > 100 * 0.1 / (1.2 * std::sqrt(3.0)));
}

TEST_CASE("whatever is wrong with a mesh, its check returns", "[mesh_check]") {
  CHECK_FALSE(check_mesh(VolumeMesh{}).valid());
  VolumeMesh out_of_range = lattice(1, 1, 1);
  out_of_range.cell_vertices[3] = 99;
  CHECK_FALSE(check_mesh(out_of_range).valid());
  CHECK(has(check_mesh(out_of_range), MeshDefect::Kind::index_out_of_range));
  VolumeMesh not_finite = lattice(2, 1, 1);
  not_finite.positions[0][2] = std::numeric_limits<double>::quiet_NaN();
  const MeshCheck check = check_mesh(not_finite);
  CHECK_FALSE(check.valid());
  CHECK(check.has_topology);
  CHECK_FALSE(check.has_boundary_geometry);
  VolumeMesh twice = lattice(1, 1, 1);
  const std::vector<Index> vertices = twice.cell_vertices;
  twice.add_cell(CellKind::hex, vertices);
  twice.add_cell(CellKind::hex, vertices);
  CHECK_FALSE(check_mesh(twice).valid());
  CHECK_FALSE(to_text(check_mesh(twice)).empty());
  VolumeMesh closed = lattice(1, 1, 1);  // the same cell twice: there is no boundary
  closed.add_cell(CellKind::hex, vertices);
  const TriangleMesh surface = boundary_triangles(lattice(1, 1, 1));
  PointCloud points;
  points.points = surface.positions;
  for (const MeshCheck& found : {check_mesh(closed, &surface), check_mesh(closed, &points)}) {
    CHECK_FALSE(found.valid());
    CHECK(has(found, MeshDefect::Kind::duplicate_cell));
    CHECK(found.has_boundary_geometry);
    CHECK(found.volume == 0);
    CHECK_FALSE(found.distance);
    CHECK_FALSE(found.ended_early);
    CHECK_FALSE(to_text(found).empty());
  }
  VolumeMesh mirrored = lattice(2, 1, 1);  // its second cell has bottom and top exchanged
  std::swap_ranges(mirrored.cell_vertices.begin() + 8, mirrored.cell_vertices.begin() + 12,
                   mirrored.cell_vertices.begin() + 12);
  CHECK(has(check_mesh(mirrored), MeshDefect::Kind::inconsistent_orientation));
  CHECK(check_mesh(mirrored).quality->inverted_cells == 1);
  CHECK_THROWS_AS(check_mesh(lattice(1, 1, 1), nullptr, {.samples_per_direction = 1}), InputError);
}

TEST_CASE("A coefficient of a curved mesh that is not finite is a defect", "[mesh_check]") {
  const VolumeMesh mesh = lattice(2, 1, 1);
  for (const std::size_t node : {std::size_t{3}, mesh.num_vertices() + 2}) {
    HighOrderMesh curved(ElementSpace(mesh, Basis::legendre, 2), mesh);
    curved.coefficients[node].y() = std::numeric_limits<double>::quiet_NaN();
    const MeshCheck check = check_mesh(curved, CurvedBoundary{});
    CAPTURE(node);
    CHECK(has(check, MeshDefect::Kind::not_finite));
    CHECK_FALSE(check.valid());
    CHECK_FALSE(check.has_boundary_geometry);
  }
}

TEST_CASE("A mesh whose volume no number holds is refused by its check", "[mesh_check]") {
  for (const double size : {1e41, 1e-41}) {
    VolumeMesh mesh = lattice(1, 1, 1);
    for (Vec3& p : mesh.positions) p *= size;
    CHECK_THROWS_AS(check_mesh(mesh), InputError);
    const VolumeMesh unit = lattice(1, 1, 1);
    const TriangleMesh target = boundary_triangles(mesh);
    CHECK_THROWS_AS(check_mesh(unit, &target), InputError);
  }
}

TEST_CASE("A check that is ended states only what was looked at", "[mesh_check]") {
  const VolumeMesh mesh = lattice(1, 1, 1);
  const TriangleMesh target = boundary_triangles(mesh);
  const HighOrderMesh curved(ElementSpace(mesh, Basis::fourier, 2), mesh);
  const CurvedBoundary boundary = curved_boundary(curved, 1);
  const std::vector<std::string> parts{"quality", "topology", "self-intersections", "distance", ""};
  for (const bool linear : {true, false})
    for (const std::string& last : parts) {
      std::vector<std::string> told;
      const WorkProgress progress = [&](const char* part, double) {
        told.push_back(part);
        return part != last;
      };
      const MeshCheck check = linear ? check_mesh(mesh, &target, {.progress = progress})
                                     : check_mesh(curved, boundary, &target, {.progress = progress});
      CAPTURE(linear, last, to_text(check));
      const std::size_t done = told.size() - (last.empty() ? 0 : 1);
      CHECK(told == std::vector(parts.begin(), parts.begin() + static_cast<std::ptrdiff_t>(told.size())));
      CHECK(check.ended_early == !last.empty());
      CHECK(check.valid() == (done > 2));
      CHECK(check.quality.has_value() == (done > 0));
      CHECK(check.has_topology == (done > 1));
      CHECK(check.has_boundary_geometry == (done > 2));
      CHECK(check.chord_error == (done > 2 ? boundary.chord_error : 0) * (linear ? 0 : 1));
      CHECK(check.distance.has_value() == (done > 3));
    }
}

TEST_CASE("Options and targets that a check cannot work with are refused whatever the mesh", "[mesh_check]") {
  for (const VolumeMesh& mesh : {lattice(1, 1, 1), VolumeMesh{}}) {
    const TriangleMesh nothing, target = boundary_triangles(lattice(1, 1, 1));
    CHECK_THROWS_AS(check_mesh(mesh, nullptr, {.samples_per_direction = 1}), InputError);
    CHECK_THROWS_AS(check_mesh(mesh, &target, {.distance_samples = 0}), InputError);
    CHECK_THROWS_AS(check_mesh(mesh, &nothing), InputError);
    PointCloud cloud;
    CHECK_THROWS_AS(check_mesh(mesh, &cloud), InputError);
    cloud.points = {Vec3(0, 0, 0), Vec3(0, std::numeric_limits<double>::quiet_NaN(), 0)};
    CHECK_THROWS_AS(check_mesh(mesh, &cloud), InputError);
  }
}

TEST_CASE("refined triangles pass through the bilinear centers and stay watertight", "[boundary_triangles]") {
  VolumeMesh mesh = lattice(2, 2, 1);
  for (Vec3& p : mesh.positions) p += 0.2 * Vec3(std::sin(3 * p[1] + p[2]), std::sin(2 * p[0]), std::cos(p[0] * p[1]));
  const PolygonMesh boundary = boundary_surface(mesh, MeshTopology(mesh));
  std::vector<Index> polygon;
  const TriangleMesh triangles = refined_triangles(boundary, &polygon);
  CHECK(triangles.triangles.size() == 8 * boundary.num_faces());
  CHECK(polygon.size() == triangles.triangles.size());
  const std::size_t corners = boundary.positions.size(), edges = 2 * boundary.num_faces();
  CHECK(triangles.positions.size() == corners + edges + boundary.num_faces());
  Vec3 area = Vec3::Zero();
  for (const auto& [a, b, c] : triangles.triangles)
    area += (triangles.positions[b] - triangles.positions[a]).cross(triangles.positions[c] - triangles.positions[a]);
  CHECK(area.norm() < 1e-13);
  const ClosestPoint tree(triangles);
  for (std::size_t f = 0; f < boundary.num_faces(); ++f) {
    const auto corner = [&](int k) { return boundary.positions[boundary.face_vertices[boundary.face_offsets[f] + k]]; };
    const double bound = (corner(0) - corner(1) + corner(2) - corner(3)).norm() / 16;
    CHECK(tree.closest(0.25 * (corner(0) + corner(1) + corner(2) + corner(3))).distance < 1e-14);
    for (double u : {0.1, 0.25, 0.7})
      for (double v : {0.3, 0.5, 0.75}) {
        const Vec3 p = (1 - v) * ((1 - u) * corner(0) + u * corner(1)) + v * ((1 - u) * corner(3) + u * corner(2));
        CHECK(tree.closest(p).distance <= bound + 1e-14);
      }
  }
}

TEST_CASE("refined triangles of a tet are four to a face", "[boundary_triangles]") {
  VolumeMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.add_cell(CellKind::tet, std::vector<Index>{0, 1, 2, 3});
  const TriangleMesh triangles = refined_triangles(boundary_surface(mesh, MeshTopology(mesh)));
  CHECK(triangles.triangles.size() == 16);
  CHECK(triangles.positions.size() == 10);
  CHECK(check_mesh(mesh).volume == Approx(1 / 6.0));
  CHECK(check_mesh(mesh).valid());
}

TEST_CASE("a check tells its parts in their order and ends where it is told to", "[mesh_check]") {
  const VolumeMesh mesh = lattice(2, 2, 2);
  const TriangleMesh target = triangulate(boundary_surface(mesh, MeshTopology(mesh)));
  const std::vector<std::string> all{"quality", "topology", "self-intersections", "distance"};
  for (std::size_t end = 0; end <= all.size(); ++end) {
    std::vector<std::string> told;
    double last = -1;
    const auto progress = [&](const char* part, double share) {
      CHECK(share > last);
      last = share;
      told.push_back(part);
      return told.size() <= end;
    };
    const MeshCheck check = check_mesh(mesh, &target, {.progress = progress});
    CHECK(told == std::vector<std::string>(all.begin(), all.begin() + std::min(end + 1, all.size())));
    CHECK(check.quality.has_value() == (end >= 1));
    CHECK(check.has_topology == (end >= 2));
    CHECK(check.has_boundary_geometry == (end >= 3));
    CHECK(check.distance.has_value() == (end >= 4));
    CHECK(check.valid() == (end >= 3));
    CHECK(last < 1);
  }
}

TEST_CASE("checks of published templates agree with what is known of them", "[mesh_check][data]") {
  const auto folder = test::require_data();
  if (!folder) return;
  struct Known {
    const char* name;
    double min_scaled_jacobian, mean_distance;
  };
  // Figures of INDEX.tsv, found by another program: least scaled Jacobian, and the average of the two one-sided means
  // of the distance per diagonal, quads cut by a diagonal. Four digits are given.
  for (const Known& known : {Known{"bone87", 0.469, 0.0142}, {"hanger139", 0.674, 0.0022}, {"rod59", 0.239, 0.0123}}) {
    INFO(known.name);
    const VolumeMesh mesh = read_volume_mesh(*folder / "fit" / known.name / "template.mesh");
    const TriangleMesh target = read_triangle_mesh(*folder / "fit" / known.name / "target.off");
    const MeshCheck check = check_mesh(mesh, &target, {.quad_triangles = QuadTriangles::diagonal});
    CHECK(check.valid());
    CHECK(check.quality->min_scaled_jacobian == Approx(known.min_scaled_jacobian).margin(0.001));
    const double average = (check.distance->mean_a_to_b + check.distance->mean_b_to_a) / 2 / check.target_diagonal;
    CHECK(average == Approx(known.mean_distance).margin(0.0001));
  }
}
