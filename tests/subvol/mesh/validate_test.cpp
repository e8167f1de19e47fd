// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/validate.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"

#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

using namespace subvol;
using namespace subvol::test;
using Kind = MeshDefect::Kind;

namespace {

bool has(const std::vector<MeshDefect>& defects, Kind kind) {
  return std::any_of(defects.begin(), defects.end(), [&](const MeshDefect& d) { return d.kind == kind; });
}

/// Every defect is of this kind, and there is one.
bool only(const std::vector<MeshDefect>& defects, Kind kind) {
  return !defects.empty() &&
         std::all_of(defects.begin(), defects.end(), [&](const MeshDefect& d) { return d.kind == kind; });
}

Index add_vertex(VolumeMesh& mesh, double x, double y, double z) {
  mesh.positions.emplace_back(x, y, z);
  return static_cast<Index>(mesh.num_vertices() - 1);
}

/// A unit cube 0..7 with a second hex of these corners.
VolumeMesh cube_and(const std::array<Index, 8>& corners, std::vector<Vec3> more = {}) {
  VolumeMesh mesh = lattice(1, 1, 1);
  mesh.positions.insert(mesh.positions.end(), more.begin(), more.end());
  mesh.add_cell(CellKind::hex, corners);
  return mesh;
}

}  // namespace

TEST_CASE("sound meshes of every kind have no defects") {
  CHECK(validate(lattice(1, 1, 1)).empty());
  CHECK(validate(lattice(4, 3, 2)).empty());
  CHECK(validate(l_shape(2)).empty());
  CHECK(validate(fan(5, 360.0 * 5 / 6, 2)).empty());
  CHECK(validate(mixed_cells()).empty());
  CHECK(validate(voxels(3, 3, 1, [](int i, int j, int) { return i != 1 || j != 1; })).empty());
}

TEST_CASE("a mesh without cells or with arrays that do not fit says so and nothing else is looked at") {
  CHECK(only(validate(VolumeMesh{}), Kind::no_cells));
  VolumeMesh mesh = lattice(2, 1, 1);
  SECTION("references") { mesh.references = {1}; }
  SECTION("offsets") { mesh.cell_offsets.pop_back(); }
  SECTION("no offsets") { mesh.cell_offsets.clear(); }
  SECTION("kinds") { mesh.kinds.push_back(CellKind::tet); }
  SECTION("a kind that needs other numbers") { mesh.kinds[0] = CellKind::prism; }
  SECTION("no kind at all") { mesh.kinds[0] = static_cast<CellKind>(7); }
  SECTION("vertices") { mesh.cell_vertices.push_back(0); }
  CHECK(only(validate(mesh), Kind::size_mismatch));
}

TEST_CASE("indices out of range and coordinates that are not finite are found") {
  VolumeMesh mesh = lattice(2, 1, 1);
  SECTION("too large") {
    mesh.cell_vertices[9] = 12;
    CHECK(only(validate(mesh), Kind::index_out_of_range));
    CHECK(validate(mesh)[0].entity == 1);
  }
  SECTION("negative") {
    mesh.cell_vertices[0] = -1;
    CHECK(only(validate(mesh), Kind::index_out_of_range));
  }
  SECTION("nan") {
    mesh.positions[3].y() = std::numeric_limits<double>::quiet_NaN();
    CHECK(has(validate(mesh), Kind::not_finite));
    CHECK(validate(mesh)[0].entity == 3);
  }
  SECTION("infinity") {
    mesh.positions[0].x() = std::numeric_limits<double>::infinity();
    CHECK(has(validate(mesh), Kind::not_finite));
  }
}

TEST_CASE("a cell that names a vertex twice is found") {
  VolumeMesh mesh = lattice(1, 1, 1);
  mesh.cell_vertices[4] = mesh.cell_vertices[0];
  CHECK(has(validate(mesh), Kind::repeated_vertex));
}

TEST_CASE("the same cell twice is found, also when numbered differently") {
  const auto defects = validate(cube_and({3, 0, 1, 2, 7, 4, 5, 6}));
  CHECK(has(defects, Kind::duplicate_cell));
}

TEST_CASE("a face of three cells is found and named") {
  VolumeMesh mesh = lattice(1, 1, 2);
  for (int i = 0; i < 4; ++i) mesh.positions.push_back(mesh.positions[8 + i] + Vec3(0, 0.3, 0.2));
  mesh.add_cell(CellKind::hex, std::array<Index, 8>{4, 5, 7, 6, 12, 13, 15, 14});
  const auto defects = validate(mesh);
  REQUIRE(has(defects, Kind::face_of_many_cells));
  CHECK(defects[0].message == "face 4 5 6 7 belongs to the cells 0 1 2");
}

TEST_CASE("a quad against two triangles is not conforming") {
  VolumeMesh mesh = lattice(1, 1, 1);
  const Index apex = add_vertex(mesh, 0.5, 0.5, 2);
  mesh.add_cell(CellKind::tet, std::array<Index, 4>{4, 5, 6, apex});
  mesh.add_cell(CellKind::tet, std::array<Index, 4>{4, 6, 7, apex});
  CHECK(has(validate(mesh), Kind::nonconforming_face));
}

TEST_CASE("a vertex of all cells may have any number") {
  constexpr Index n = 2000;
  for (const bool first : {true, false}) {
    VolumeMesh mesh = prisms_round_axis(n, first);
    const Index axis = first ? 0 : 2 * n, rim = first ? 2 : 0;
    CHECK(validate(mesh).empty());
    const MeshTopology topology(mesh);
    CHECK(topology.num_faces() == 4 * n);
    CHECK(topology.num_edges() == 1 + 5 * n);
    CHECK(topology.boundary_faces().size() == 3 * n);
    CHECK(topology.num_edge_cells(topology.find_edge(axis, axis + 1)) == n);
    mesh.add_cell(CellKind::prism, std::array<Index, 6>{axis, rim, rim + 1, axis + 1, rim + n, rim + n + 1});
    CHECK(!validate(mesh).empty());
  }
}

TEST_CASE("two half hexes against a whole one leave hanging vertices, however the mesh lies in space") {
  VolumeMesh mesh = lattice(1, 1, 1);
  const Index a = add_vertex(mesh, 2, 0, 0), b = add_vertex(mesh, 2, 0.5, 0), c = add_vertex(mesh, 1, 0.5, 0);
  const Index d = add_vertex(mesh, 2, 0, 1), e = add_vertex(mesh, 2, 0.5, 1), f = add_vertex(mesh, 1, 0.5, 1);
  const Index g = add_vertex(mesh, 2, 1, 0), h = add_vertex(mesh, 2, 1, 1);
  mesh.add_cell(CellKind::hex, std::array<Index, 8>{1, a, b, c, 5, d, e, f});
  mesh.add_cell(CellKind::hex, std::array<Index, 8>{c, b, g, 2, f, e, h, 6});
  const Eigen::AngleAxisd turn(1.1, Vec3(1, 2, 3).normalized());
  for (Vec3& x : mesh.positions) x = 1e4 * (turn * x) + Vec3(7e4, -3e4, 1e4);
  const auto defects = validate(mesh);
  std::vector<Index> hanging;
  for (const MeshDefect& defect : defects)
    if (defect.kind == Kind::nonconforming_face) hanging.push_back(defect.entity);
  CHECK(hanging == std::vector<Index>{c, f});
}

TEST_CASE("a face cut into three is found as well") {
  VolumeMesh mesh = lattice(1, 1, 1);
  std::array<Index, 4> near0, near1, far0, far1;  // rows at y = 0, 1/3, 2/3, 1
  for (int i = 0; i < 4; ++i) {
    const bool inner = i == 1 || i == 2;
    near0[i] = inner ? add_vertex(mesh, 1, i / 3.0, 0) : (i == 0 ? 1 : 2);
    near1[i] = inner ? add_vertex(mesh, 1, i / 3.0, 1) : (i == 0 ? 5 : 6);
    far0[i] = add_vertex(mesh, 2, i / 3.0, 0);
    far1[i] = add_vertex(mesh, 2, i / 3.0, 1);
  }
  // The lattice numbers by rows: 0 000, 1 100, 2 110, 3 010 in cell order.
  for (int i = 0; i < 3; ++i)
    mesh.add_cell(CellKind::hex, std::array<Index, 8>{near0[i], far0[i], far0[i + 1], near0[i + 1], near1[i], far1[i],
                                                      far1[i + 1], near1[i + 1]});
  CHECK(has(validate(mesh), Kind::nonconforming_face));
}

TEST_CASE("a face whose corners two cells join in different orders is not conforming") {
  const auto defects = validate(cube_and({1, 2, 6, 5, 8, 9, 10, 11}, {{2, 0, 0}, {2, 1, 0}, {2, 1, 1}, {2, 0, 1}}));
  REQUIRE(defects.empty());  // 1 2 6 5 goes around the face
  CHECK(has(validate(cube_and({1, 6, 2, 5, 8, 9, 10, 11}, {{2, 0, 0}, {2, 1, 0}, {2, 1, 1}, {2, 0, 1}})),
            Kind::nonconforming_face));
}

TEST_CASE("cells that touch in an edge or a vertex only are not manifold") {
  CHECK(has(validate(voxels(2, 2, 1, [](int i, int j, int) { return i == j; })), Kind::nonmanifold_edge));
  const auto defects = validate(voxels(2, 2, 2, [](int i, int j, int k) { return i == j && j == k; }));
  CHECK(only(defects, Kind::nonmanifold_vertex));
  CHECK(defects.size() == 1);
}

TEST_CASE("two cells that see their face from the same side are inconsistent") {
  // The second hex is numbered left-handed.
  const auto defects = validate(cube_and({1, 2, 9, 8, 5, 6, 11, 10}, {{2, 0, 0}, {2, 1, 0}, {2, 0, 1}, {2, 1, 1}}));
  CHECK(has(defects, Kind::inconsistent_orientation));
  CHECK(has(defects, Kind::inverted_cell));
}

TEST_CASE("left-handed and flat cells are inverted, and only that") {
  VolumeMesh mirrored = mixed_cells();
  for (Vec3& x : mirrored.positions) x.x() = -x.x();
  CHECK(only(validate(mirrored), Kind::inverted_cell));
  CHECK(validate(mirrored).size() == mirrored.num_cells());

  VolumeMesh flat = lattice(2, 1, 1);
  for (Vec3& x : flat.positions) x.z() = 0;
  CHECK(only(validate(flat), Kind::inverted_cell));

  VolumeMesh one_corner = lattice(1, 1, 1);
  one_corner.positions[6] = Vec3(0.2, 0.2, 0.2);
  const auto defects = validate(one_corner);
  CHECK(only(defects, Kind::inverted_cell));
  CHECK(defects.size() == 1);
}

TEST_CASE("a flat tet on the boundary is inverted, not hanging") {
  VolumeMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 0, 1}};
  mesh.add_cell(CellKind::tet, std::array<Index, 4>{0, 1, 2, 3});
  CHECK(only(validate(mesh), Kind::inverted_cell));
}

TEST_CASE("tags off the boundary, out of order or without sharpness are bad") {
  VolumeMesh mesh = lattice(2, 2, 2);
  const auto vertex_at = [&](double x, double y, double z) {
    const auto it = std::find(mesh.positions.begin(), mesh.positions.end(), Vec3(x, y, z));
    return static_cast<Index>(it - mesh.positions.begin());
  };
  const Index center = vertex_at(1, 1, 1), face = vertex_at(1, 1, 0), corner = vertex_at(0, 0, 0);
  const Index edge = vertex_at(1, 0, 0);
  const auto crease = [](Index a, Index b, double s) { return CreaseEdge{std::min(a, b), std::max(a, b), s}; };
  mesh.tags.creases = {crease(corner, edge, 1)};
  mesh.tags.corners = {{corner, 2.5}};
  REQUIRE(validate(mesh).empty());
  SECTION("crease inside") { mesh.tags.creases = {crease(center, face, 1)}; }
  SECTION("crease that is no edge") { mesh.tags.creases = {crease(corner, face, 1)}; }
  SECTION("corner inside") { mesh.tags.corners = {{center, 1}}; }
  SECTION("zero sharpness") { mesh.tags.creases[0].sharpness = 0; }
  SECTION("nan sharpness") { mesh.tags.corners[0].sharpness = std::numeric_limits<double>::quiet_NaN(); }
  SECTION("backwards") { std::swap(mesh.tags.creases[0].v0, mesh.tags.creases[0].v1); }
  SECTION("twice") { mesh.tags.creases.push_back(mesh.tags.creases[0]); }
  SECTION("vertex out of range") { mesh.tags.creases[0].v1 = 27; }
  SECTION("negative vertex") { mesh.tags.corners[0].vertex = -1; }
  CHECK(only(validate(mesh), Kind::bad_tag));
}

TEST_CASE("an unused vertex is reported and changes nothing else") {
  VolumeMesh mesh = lattice(1, 1, 1);
  add_vertex(mesh, 9, 9, 9);
  const auto defects = validate(mesh);
  CHECK(only(defects, Kind::unused_vertex));
  CHECK(defects[0].entity == 8);
}

TEST_CASE("defects come in the order of their kinds and every kind has its own name") {
  VolumeMesh mesh = cube_and({3, 0, 1, 2, 7, 4, 5, 6});
  add_vertex(mesh, 9, 9, 9);
  mesh.positions[0].x() = std::numeric_limits<double>::quiet_NaN();
  const auto defects = validate(mesh);
  CHECK(std::is_sorted(defects.begin(), defects.end(), [](auto& a, auto& b) { return a.kind < b.kind; }));
  std::vector<std::string> names;
  for (int i = 0; i <= static_cast<int>(Kind::unused_vertex); ++i) names.push_back(to_string(static_cast<Kind>(i)));
  std::sort(names.begin(), names.end());
  CHECK(std::adjacent_find(names.begin(), names.end()) == names.end());
  CHECK(std::string(to_string(Kind::bad_tag)) == "bad_tag");
}
