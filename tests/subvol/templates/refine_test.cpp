// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/refine.h"

#include "subvol/base/error.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/mesh/features.h"
#include "tests/support/mesh_checks.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

using namespace subvol;
using test::check_mesh_is;

namespace {

/// The mesh refined at the vertices listed, and what must hold of it whatever they are.
VolumeMesh refined_at(const VolumeMesh& mesh, const std::vector<Index>& vertices) {
  std::vector<char> marked(mesh.num_vertices(), 0);
  for (Index v : vertices) marked[v] = 1;
  VolumeMesh refined = refine_at(mesh, marked);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v) CHECK(refined.positions[v] == mesh.positions[v]);
  return refined;
}

}  // namespace

TEST_CASE("Each pattern of marks has its number of parts, wherever it lies in the hex", "[refine]") {
  const VolumeMesh cube = test::lattice(1, 1, 1);
  const CellTopology& hex = cell_topology(CellKind::hex);
  const auto check_parts = [&](const std::vector<Index>& vertices, std::size_t parts) {
    const VolumeMesh refined = refined_at(cube, vertices);
    CHECK(refined.num_cells() == parts);
    check_mesh_is(refined, 1, 1);
    CHECK(measure_quality(refined).min_scaled_jacobian > 0.1);
  };
  const auto cell = cube.cell(0);
  for (Index v : cell) check_parts({v}, 4);
  for (const auto& e : hex.edges) check_parts({cell[e[0]], cell[e[1]]}, 11);
  for (const auto& f : hex.faces) check_parts({cell[f[0]], cell[f[1]], cell[f[2]], cell[f[3]]}, 22);
  check_parts({cell.begin(), cell.end()}, 27);
  for (const auto& f : hex.faces) {
    check_parts({cell[f[0]], cell[f[2]]}, 22);
    check_parts({cell[f[0]], cell[f[1]], cell[f[2]]}, 22);
  }
  check_parts({cell[0], cell[6]}, 27);
}

TEST_CASE("Refining stays conforming for any marks", "[refine]") {
  std::mt19937 random(5);
  const VolumeMesh grid = test::lattice(5, 4, 3), bent = test::fan(5, 360, 2);
  for (int round = 0; round < 20; ++round)
    for (const VolumeMesh* mesh : {&grid, &bent}) {
      std::vector<Index> vertices;
      for (int i = 0; i < 1 + round / 5; ++i) vertices.push_back(static_cast<Index>(random() % mesh->num_vertices()));
      const VolumeMesh refined = refined_at(*mesh, vertices);
      check_mesh_is(refined, 1, test::volume_of(*mesh));
      CHECK(refined.num_cells() > mesh->num_cells());
    }
  CHECK(refined_at(grid, {}).cell_vertices == grid.cell_vertices);
}

TEST_CASE("Refining all cells cuts each in 27 equal ones", "[refine]") {
  const VolumeMesh mesh = test::lattice(3, 2, 2);
  const std::vector<char> all(mesh.num_cells(), 1);
  const VolumeMesh refined = refine_at(mesh, vertices_of(mesh, all));
  CHECK(refined.num_cells() == 27 * mesh.num_cells());
  CHECK(refined.num_vertices() == 10 * 7 * 7);
  check_mesh_is(refined, 1, 12);
  CHECK(measure_quality(refined).min_scaled_jacobian == Approx(1));
}

TEST_CASE("Refining carries references and cuts creases", "[refine]") {
  VolumeMesh mesh = test::lattice(3, 1, 1);
  mesh.references = {7, 8, 9};
  mesh.tags = features_by_angle(mesh, 40);
  std::vector<char> chosen = {1, 0, 0};
  const VolumeMesh refined = refine_at(mesh, vertices_of(mesh, chosen));
  CHECK(refined.num_cells() == 27 + 22 + 1);
  CHECK(refined.references.size() == refined.num_cells());
  CHECK(std::count(refined.references.begin(), refined.references.end(), 7) == 27);
  CHECK(std::count(refined.references.begin(), refined.references.end(), 9) == 1);
  CHECK(refined.tags.corners.size() == mesh.tags.corners.size());
  // Eight edges around the first cube's end in three each, and the four that leave it in three, two, one parts.
  CHECK(mesh.tags.creases.size() == 20);
  CHECK(refined.tags.creases.size() == 4 * 3 + 4 * 3 + 4 * 2 + 4 * 1 + 4 * 1);
  CHECK(refined.tags.creases == features_by_angle(refined, 40).creases);
}

TEST_CASE("Refining refuses what it cannot cut", "[refine]") {
  const VolumeMesh mixed = test::mixed_cells();
  CHECK_THROWS_AS(refine_at(mixed, std::vector<char>(mixed.num_vertices(), 1)), InputError);
  CHECK_THROWS_AS(refine_at(mixed, std::vector<char>(3, 1)), InputError);
  CHECK_NOTHROW(refine_at(mixed, std::vector<char>(mixed.num_vertices(), 0)));
  VolumeMesh folded = test::lattice(1, 1, 1);
  std::swap(folded.positions[6], folded.positions[0]);
  CHECK_THROWS_AS(refine_at(folded, std::vector<char>(8, 1)), InputError);
}

TEST_CASE("Thin cells are those between two sides", "[refine]") {
  const VolumeMesh plate = test::lattice(4, 4, 1), block = test::lattice(3, 3, 2);
  const std::vector<char> thin = thin_cells(plate), thick = thin_cells(block);
  CHECK(std::count(thin.begin(), thin.end(), 1) == 16);
  CHECK(std::count(thick.begin(), thick.end(), 1) == 0);
}

TEST_CASE("Hexes are refined beside pyramids, and marks on a pyramid are refused", "[templates]") {
  VolumeMesh mesh = test::lattice(2, 2, 2);
  const auto apex = static_cast<Index>(mesh.num_vertices());
  mesh.positions.push_back(Vec3::Zero());
  // On the face of the last cell that lies opposite to its first corner along its last axis.
  const std::vector<Index> cell(mesh.cell(mesh.num_cells() - 1).begin(), mesh.cell(mesh.num_cells() - 1).end());
  for (std::size_t i = 4; i < 8; ++i) mesh.positions.back() += mesh.positions[cell[i]] / 4;
  mesh.positions.back() += mesh.positions[cell[4]] - mesh.positions[cell[0]];
  mesh.add_cell(CellKind::pyramid, std::array<Index, 5>{cell[4], cell[5], cell[6], cell[7], apex});
  REQUIRE(validate(mesh).empty());
  std::vector<char> marked(mesh.num_vertices(), 0);
  marked[mesh.cell(0)[0]] = 1;
  const VolumeMesh refined = refine_at(mesh, marked);
  CHECK(validate(refined).empty());
  CHECK(refined.num_cells() == 7 + 4 + 1);
  marked[apex] = 1;
  CHECK_THROWS_WITH(refine_at(mesh, marked), Catch::Contains("is no hex"));
}
