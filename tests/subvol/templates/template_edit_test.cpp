// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/template_edit.h"
#include "subvol/base/error.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/shell/extrude.h"
#include "subvol/surface/boundary.h"
#include "subvol/templates/carve.h"
#include "subvol/templates/cell_sheet.h"
#include "subvol/templates/cell_split.h"
#include "subvol/templates/pillow.h"
#include "subvol/templates/vertex_merge.h"
#include "subvol/templates/voxel_grid.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <numbers>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using test::check_mesh_is;
using test::euler_number;
using test::volume_of;

namespace {

Index vertex_at(const VolumeMesh& mesh, const Vec3& place) {
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if ((mesh.positions[v] - place).norm() < 1e-9) return static_cast<Index>(v);
  return kNoIndex;
}

VolumeMesh tagged_lattice(int nx, int ny, int nz) {
  VolumeMesh mesh = test::lattice(nx, ny, nz);
  mesh.tags = features_by_angle(mesh, 40);
  return mesh;
}

}  // namespace

TEST_CASE("A grid fills its box by counts and by size", "[templates]") {
  const VolumeMesh mesh = voxel_mesh(box_grid(Vec3(-1, 0, 2), Vec3(1, 3, 3), {4, 3, 1}));
  CHECK(mesh.num_cells() == 12);
  CHECK(mesh.num_vertices() == 5 * 4 * 2);
  check_mesh_is(mesh, 1, 6);
  CHECK(box_grid(Vec3(-1, 0, 2), Vec3(1, 3, 3), 0.45).cells == std::array{4, 7, 2});
  CHECK(box_grid(Vec3(0, 0, 0), Vec3(1, 1, 1), 10).cells == std::array{1, 1, 1});
  CHECK_THROWS_AS(box_grid(Vec3(0, 0, 0), Vec3(1, 1, 0), {1, 1, 1}), InputError);
  CHECK_THROWS_AS(box_grid(Vec3(0, 0, 0), Vec3(1, 1, 1), {1, 0, 1}), InputError);
  CHECK_THROWS_AS(box_grid(Vec3(0, 0, 0), Vec3(1, 1, 1), {100000, 100000, 100000}), InputError);
  CHECK_THROWS_AS(box_grid(Vec3(0, 0, 0), Vec3(1, 1, 1), 0.0), InputError);
  CHECK_THROWS_WITH(box_grid(Vec3(0, 0, 0), Vec3(1, 1, 1), 1e-300), Catch::Contains("with size 1e-300"));
  CHECK_THROWS_AS(box_grid(Vec3::Constant(-1.5e308), Vec3::Constant(1.5e308), {1, 1, 1}), InputError);
}

TEST_CASE("Carving keeps the cells inside a surface, in a box or on a list", "[templates]") {
  const VolumeMesh grid = voxel_mesh(box_grid(Vec3::Constant(-1.2), Vec3::Constant(1.2), {8, 8, 8}));
  const TriangleMesh ball = test::cube_surface(10, true);
  const std::vector<char> inside = cells_inside(grid, ball);
  for (std::size_t c = 0; c < grid.num_cells(); ++c) {
    Vec3 center = Vec3::Zero();
    for (Index v : grid.cell(c)) center += grid.positions[v] / 8;
    // A cell has the half diagonal 0.26; the ball's triangles lie within 0.05 of the sphere.
    if (center.norm() < 0.68) CHECK(inside[c]);
    if (center.norm() > 1.27) CHECK(!inside[c]);
  }
  const VolumeMesh carved = carve(grid, [&](std::size_t c) { return inside[c] != 0; });
  check_mesh_is(carved, 1, 0.027 * static_cast<double>(carved.num_cells()));
  CHECK(volume_of(carved) == Approx(4 * std::numbers::pi / 3).epsilon(0.15));

  const VolumeMesh lattice = tagged_lattice(3, 3, 3);
  const std::vector<char> low = cells_in_box(lattice, Vec3(0, 0, 0), Vec3(3, 3, 2));
  const VolumeMesh slab = carve(lattice, [&](std::size_t c) { return low[c] != 0; });
  check_mesh_is(slab, 1, 18);
  CHECK(slab.tags.corners.size() == 4);  // those above have gone
  const std::vector<char> center = cells_listed(lattice, std::array<Index, 1>{13});
  check_mesh_is(carve(lattice, [&](std::size_t c) { return center[c] == 0; }), 2, 26);

  CHECK_THROWS_AS(carve(lattice, [](std::size_t) { return false; }), InputError);
  CHECK_THROWS_AS(carve(lattice, [](std::size_t c) { return c == 0 || c == 4; }), InputError);   // along an edge
  CHECK_THROWS_AS(carve(lattice, [](std::size_t c) { return c == 0 || c == 13; }), InputError);  // at a vertex
  // Numbers are those of the whole lattice: cells 13 and 26 share its vertex (2, 2, 2) of 4 x 4 x 4.
  CHECK_THROWS_WITH(carve(lattice, [](std::size_t c) { return c == 13 || c == 26; }), Catch::Contains("vertex 42"));
  CHECK_THROWS_AS(cells_listed(lattice, std::array<Index, 1>{27}), InputError);
  CHECK_THROWS_AS(cells_inside(lattice, ball, 0), InputError);
}

TEST_CASE("A pillow adds a cell per boundary face and moves nothing that was there", "[templates]") {
  const VolumeMesh lattice = tagged_lattice(2, 3, 2);
  const VolumeMesh pillowed = pillow(lattice);
  CHECK(pillowed.num_cells() == lattice.num_cells() + 2 * (6 + 6 + 4));
  check_mesh_is(pillowed, 1, 12);
  CHECK(pillowed.tags == lattice.tags);
  CHECK(std::equal(lattice.positions.begin(), lattice.positions.end(), pillowed.positions.begin()));
  for (std::size_t c = 0; c < pillowed.num_cells(); ++c) CHECK(test::min_scaled_jacobian(pillowed, c) > 0.15);
  // The layer is one cell thick: taking its sheet out undoes it, but for places.
  const Index corner = vertex_at(lattice, Vec3(0, 0, 0)), inner = pillowed.cell(0)[0];
  const VolumeMesh again = collapse_sheet(pillowed, corner, inner);
  check_mesh_is(again, 1, 12);
  CHECK(again.num_cells() == lattice.num_cells());
}

TEST_CASE("A pillow around some cells, and of prisms and tets", "[templates]") {
  const VolumeMesh lattice = test::lattice(3, 3, 3);
  const VolumeMesh around_center = pillow(lattice, std::array<Index, 1>{13});
  CHECK(around_center.num_cells() == 27 + 6);
  check_mesh_is(around_center, 1, 27);
  const VolumeMesh mixed = pillow(test::mixed_cells());
  CHECK(validate(mixed).empty());
  CHECK(euler_number(mixed) == 1);
  CHECK(volume_of(mixed) == Approx(volume_of(test::mixed_cells())));

  CHECK_THROWS_AS(pillow(VolumeMesh{}), InputError);
  CHECK_THROWS_AS(pillow(lattice, std::array<Index, 1>{27}), InputError);
  CHECK_THROWS_AS(pillow(lattice, std::array<Index, 2>{1, 1}), InputError);
  CHECK_THROWS_AS(pillow(lattice, std::array<Index, 2>{0, 13}), InputError);  // they touch at a vertex
}

TEST_CASE("Collapsing a sheet moves no interface between regions and removes no region", "[templates]") {
  VolumeMesh layers = test::lattice(1, 1, 4);  // regions 1, 1, 2, 2 from below
  layers.references = {1, 1, 2, 2};
  const auto at = [&](double z) { return vertex_at(layers, Vec3(0, 0, z)); };
  const auto heights = [](const VolumeMesh& mesh) {
    std::set<double> found;
    for (const Vec3& p : mesh.positions) found.insert(p.z());
    return found;
  };
  // Below and above the interface, and given from either side.
  CHECK(heights(collapse_sheet(layers, at(1), at(2))) == std::set<double>{0, 2, 3, 4});
  CHECK(heights(collapse_sheet(layers, at(2), at(1))) == std::set<double>{0, 2, 3, 4});
  CHECK(heights(collapse_sheet(layers, at(3), at(2))) == std::set<double>{0, 1, 2, 4});
  layers.references = {1, 2, 3, 3};
  CHECK_THROWS_WITH(collapse_sheet(layers, at(1), at(2)), Catch::Contains("no cell of region 2 would be left"));
}

TEST_CASE("Splitting a sheet and collapsing a part of it are inverse", "[templates]") {
  const VolumeMesh lattice = tagged_lattice(2, 2, 3);
  const Index a = vertex_at(lattice, Vec3(0, 0, 1)), b = vertex_at(lattice, Vec3(0, 0, 2));
  const VolumeMesh split = split_sheet(lattice, a, b, 3);
  CHECK(split.num_cells() == 4 * 5);
  check_mesh_is(split, 1, 12);
  CHECK(split.tags.creases.size() == lattice.tags.creases.size() + 4 * 2);
  const Index n = static_cast<Index>(lattice.num_vertices());  // first new vertex, on a-b
  const VolumeMesh half_way = collapse_sheet(split, a, n);
  const VolumeMesh back = collapse_sheet(half_way, a, vertex_at(half_way, Vec3(0, 0, 1 + 2.0 / 3)));
  check_mesh_is(back, 1, 12);
  CHECK(back.cell_vertices == lattice.cell_vertices);
  CHECK(back.positions == lattice.positions);
  CHECK(back.tags == lattice.tags);
  CHECK(sheet_edges(MeshTopology(lattice), a, b).size() == 9);

  CHECK_THROWS_AS(split_sheet(lattice, a, a), InputError);
  CHECK_THROWS_AS(split_sheet(lattice, a, 10000), InputError);
  CHECK_THROWS_AS(split_sheet(lattice, a, b, 1), InputError);
  const VolumeMesh mixed = test::mixed_cells();
  CHECK_THROWS_AS(split_sheet(mixed, 0, 3), InputError);  // runs into triangles of a prism
  check_mesh_is(split_sheet(mixed, 0, 4), 1, volume_of(mixed));
  CHECK(split_sheet(mixed, 0, 4).num_cells() == mixed.num_cells() + 3);
}

TEST_CASE("Collapsing faces and edges keeps conformity or is refused", "[templates]") {
  const VolumeMesh lattice = test::lattice(4, 4, 2);
  const VolumeMesh folded =
      collapse_face(lattice, vertex_at(lattice, Vec3(1, 1, 0)), vertex_at(lattice, Vec3(2, 2, 0)));
  CHECK(folded.num_cells() == lattice.num_cells() - 2);
  check_mesh_is(folded, 1, 32);
  CHECK_THROWS_AS(collapse_face(lattice, 0, 1), InputError);
  CHECK_THROWS_AS(collapse_edge(lattice, 0, 1), InputError);  // hexes around one edge become nothing known

  const VolumeMesh tets = split_into_tets(test::lattice(3, 3, 3));
  const Index p = vertex_at(tets, Vec3(1, 1, 1)), q = vertex_at(tets, Vec3(2, 1, 1));
  const MeshTopology topology(tets);
  REQUIRE(topology.find_edge(p, q) != kNoIndex);
  const VolumeMesh fewer = collapse_edge(tets, p, q);
  CHECK(fewer.num_cells() ==
        tets.num_cells() - static_cast<std::size_t>(topology.num_edge_cells(topology.find_edge(p, q))));
  check_mesh_is(fewer, 1, 27);
  CHECK_THROWS_AS(collapse_sheet(test::lattice(1, 1, 1), 0, 1), InputError);  // nothing would be left
}

TEST_CASE("Merging glues coincident faces and keeps tags that stay on the boundary", "[templates]") {
  VolumeMesh left = tagged_lattice(2, 2, 2), right = left;
  for (Vec3& p : right.positions) p.x() += 2;
  right.references.assign(right.num_cells(), 7);
  const VolumeMesh both = joined(left, right);
  CHECK(both.num_cells() == 16);
  CHECK(both.references.front() == 0);
  CHECK(both.references.back() == 7);
  const VolumeMesh glued = glue(both, 1e-9);
  check_mesh_is(glued, 1, 16);
  CHECK(glued.num_vertices() == 2 * 27 - 9);
  CHECK(validate(glued).empty());
  CHECK(glue(glued, 1e-9).num_vertices() == glued.num_vertices());
  CHECK_THROWS_AS(glue(both, 2), InputError);
  CHECK_THROWS_AS(glue(both, -1), InputError);
  CHECK_THROWS_AS(glue(joined(left, left), 1e-9), InputError);  // the same cells twice
}

TEST_CASE("Regions of two meshes stay apart if their names differ", "[templates]") {
  VolumeMesh wall = test::lattice(1, 1, 1), far = test::lattice(1, 1, 2);
  wall.references = {1};
  wall.regions = {{"wall", 1, 3}};
  far.references = {1, 2};
  far.regions = {{"air", 1, 3}, {"water", 2, 3}};
  const VolumeMesh both = joined(wall, far);
  CHECK(both.references == std::vector<int>{1, 3, 2});
  CHECK(both.regions == std::vector<Group>{{"wall", 1, 3}, {"air", 3, 3}, {"water", 2, 3}});
  CHECK(joined(wall, wall).references == std::vector<int>{1, 1});
  far.regions.clear();  // numbers without names mean the same in both
  CHECK(joined(wall, far).references == std::vector<int>{1, 1, 2});
}

TEST_CASE("Merging refuses a distance at which cells would go or change their kind", "[templates]") {
  VolumeMesh thin = test::lattice(1, 1, 1), apart = test::lattice(2, 2, 2);
  for (Vec3& p : thin.positions) p.z() *= 0.005;
  for (Vec3& p : apart.positions) p.x() += 5;
  const VolumeMesh both = joined(apart, thin);
  CHECK(glue(both, 0.004).num_cells() == 9);
  CHECK_THROWS_WITH(glue(both, 0.06), Catch::Contains("corners of cell 8") && Catch::Contains("0.06"));
  VolumeMesh wedge = test::lattice(1, 1, 1);  // nearly a prism
  for (Vec3& p : wedge.positions)
    if (p.x() > 0) p.z() *= 0.005;
  CHECK_THROWS_AS(glue(wedge, 0.06), InputError);
  CHECK(glue(wedge, 0.004).kinds == wedge.kinds);
}

TEST_CASE("Merging takes boundaries of many vertices in one plane", "[templates][slow]") {
  const VolumeMesh below = test::lattice(300, 300, 1);
  VolumeMesh above = below;
  for (Vec3& p : above.positions) p.z() += 1;
  const VolumeMesh glued = glue(joined(below, above), 1e-6);
  CHECK(glued.num_cells() == 2 * 300 * 300);
  CHECK(glued.num_vertices() == 3 * 301 * 301);
  CHECK(volume_of(glued) == Approx(2 * 300 * 300));
}

TEST_CASE("Hexes become tets and prisms without new vertices", "[templates]") {
  VolumeMesh lattice = tagged_lattice(3, 2, 2);
  test::jitter(lattice, 0.1);
  const double volume = volume_of(lattice);
  const VolumeMesh tets = split_into_tets(lattice);
  CHECK(validate(tets).empty());
  CHECK(euler_number(tets) == 1);
  CHECK(tets.num_vertices() == lattice.num_vertices());
  CHECK(volume_of(tets) == Approx(volume).epsilon(0.05));  // the quads were warped
  CHECK(validate(split_into_tets(test::mixed_cells())).empty());

  const VolumeMesh straight = tagged_lattice(3, 2, 2);
  check_mesh_is(split_into_tets(straight), 1, 12);
  for (const Vec3& along : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}) {
    const VolumeMesh prisms =
        split_into_prisms(straight, vertex_at(straight, Vec3(0, 0, 0)), vertex_at(straight, along));
    CHECK(prisms.num_cells() == 24);
    check_mesh_is(prisms, 1, 12);
  }
  const VolumeMesh column = test::lattice(1, 1, 2000);
  const VolumeMesh prisms =
      split_into_prisms(column, vertex_at(column, Vec3(0, 0, 0)), vertex_at(column, Vec3(0, 0, 1)));
  CHECK(prisms.num_cells() == 4000);
  check_mesh_is(prisms, 1, 2000);
  CHECK_THROWS_AS(split_into_prisms(straight, 0, 100), InputError);
  CHECK_THROWS_AS(split_into_prisms(test::mixed_cells(), 0, 1), InputError);
}

TEST_CASE("Extruding stacks hexes on quads and prisms on triangles", "[templates]") {
  PolygonMesh plate;  // a quad and a triangle
  plate.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0), Vec3(2, 0.5, 0)};
  plate.face_vertices = {0, 1, 2, 3, 1, 4, 2};
  plate.face_offsets = {0, 4, 7};
  const VolumeMesh up = extrude(plate, {.thickness = 2, .layers = 2, .direction = Vec3(0, 0, 3)});
  CHECK(up.num_cells() == 4);
  check_mesh_is(up, 1, 2 * 1.5);
  CHECK(up.references == std::vector<int>{1, 1, 2, 2});
  const VolumeMesh leaning = extrude(plate, {.thickness = std::sqrt(2.0), .direction = Vec3(1, 0, 1)});
  check_mesh_is(leaning, 1, 1.5);
  check_mesh_is(extrude(plate, {.thickness = 1}), 1, 1.5);
  CHECK(up.face_groups.empty());
  plate.face_groups = {{{"square", 3, 2}}, {0, kNoIndex}};
  const VolumeFaceGroups groups = extrude(plate, {.thickness = 1}).face_groups;
  REQUIRE(groups.groups.size() == 4);  // and "wall" for the triangle, "outer" for the top, "rim" for the walls
  CHECK(groups.groups[0] == Group{"square", 3, 2});
  const std::array<Index, 4> square{0, 1, 2, 3};
  CHECK(std::ranges::find(groups.faces, GroupedFace{face_key(square), 0}) != groups.faces.end());
  CHECK_THROWS_AS(extrude(plate, {.thickness = 0}), InputError);
  CHECK_THROWS_AS(extrude(plate, {.thickness = 1, .layers = 0}), InputError);
  CHECK_THROWS_AS(extrude(plate, {.thickness = 1, .direction = Vec3(0, 0, -1)}), InputError);
  CHECK_THROWS_AS(extrude(plate, {.thickness = 1, .direction = Vec3(0, 0, 0)}), InputError);
}

TEST_CASE("Layers carry groups of inner faces and creases of interfaces up to the old boundary", "[templates]") {
  VolumeMesh mesh = voxel_mesh(box_grid(Vec3::Zero(), Vec3::Constant(4), {4, 4, 4}));
  const auto vertex_at = [&](double x, double y, double z) {
    for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
      if (mesh.positions[v] == Vec3(x, y, z)) return static_cast<Index>(v);
    return kNoIndex;
  };
  mesh.face_groups.groups = {{"middle", 1, 2}, {"floor", 2, 2}};
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto corners = mesh.cell(c);
    const Vec3& low = mesh.positions[corners[0]];
    mesh.references.push_back(low.z() < 2 ? 1 : low.x() < 2 ? 2 : 3);  // three sheets meet in a line
    const FaceKey bottom = face_key(std::array{corners[0], corners[1], corners[2], corners[3]});
    if (low.z() == 2) mesh.face_groups.faces.push_back({bottom, 0});
    if (low.z() == 0) mesh.face_groups.faces.push_back({bottom, 1});
  }
  normalize(mesh.face_groups);
  for (int i = 0; i < 4; ++i) mesh.tags.creases.push_back({vertex_at(i, 1, 2), vertex_at(i + 1, 1, 2), 2.0});
  mesh.tags.creases.push_back({vertex_at(0, 0, 0), vertex_at(1, 0, 0), 1.0});
  mesh.tags.corners.push_back({vertex_at(2, 2, 2), 3.0});
  normalize_tags(mesh.tags);
  REQUIRE(validate(mesh).empty());
  std::vector<Index> half, core;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const Vec3& low = mesh.positions[mesh.cell(c)[0]];
    if (low.x() < 2) half.push_back(static_cast<Index>(c));
    if (low.minCoeff() >= 1 && low.maxCoeff() <= 2) core.push_back(static_cast<Index>(c));
  }
  for (const VolumeMesh& made : {pillow(mesh), pillow(mesh, half), pillow(mesh, core), pillow_regions(mesh)}) {
    CHECK(validate(made).empty());
    const MeshTopology topology(made);
    std::array<double, 2> area{};
    for (std::size_t f = 0; f < topology.num_faces(); ++f) {
      const auto face = topology.face(static_cast<Index>(f));
      const Index group = group_of(made.face_groups, face);
      if (group == kNoIndex) continue;
      const auto p = [&](std::size_t i) { return made.positions[face[i]]; };
      area[static_cast<std::size_t>(group)] += 0.5 * (p(2) - p(0)).cross(p(3) - p(1)).norm();
    }
    CHECK(area[0] == Approx(16));
    CHECK(area[1] == Approx(16));
    double length = 0;
    for (const CreaseEdge& crease : made.tags.creases)
      if (crease.sharpness == 2.0) length += (made.positions[crease.v0] - made.positions[crease.v1]).norm();
    CHECK(length == Approx(4).epsilon(0.02));
    CHECK(made.tags.corners.size() == 1);
  }
}
