// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/export/read_back.h"
#include "subvol/export/volume_writer.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/elements/element_space.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/nodal_mesh.h"
#include "subvol/mesh/validate.h"
#include "subvol/subdivision/subdivision.h"
#include "subvol/surface/boundary.h"
#include "subvol/templates/cell_split.h"
#include "subvol/templates/refine.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <fstream>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;
using Catch::Contains;

namespace {

VolumeMesh grouped_mesh() {
  VolumeMesh mesh = with_floor_and_roof(mixed_cells_with_pyramid(), 1);
  mesh.references.assign(mesh.num_cells(), 4);
  mesh.references[1] = 9;
  return mesh;
}

/// The cells by kind, corners and reference, whatever their order.
std::multiset<std::vector<Index>> cells_of(const VolumeMesh& mesh) {
  std::multiset<std::vector<Index>> cells;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    std::vector<Index> cell(mesh.cell(c).begin(), mesh.cell(c).end());
    cell.push_back(static_cast<Index>(mesh.kinds[c]));
    cell.push_back(mesh.references.empty() ? 0 : mesh.references[c]);
    cells.insert(std::move(cell));
  }
  return cells;
}

std::vector<Vec3> corners_of(const VolumeMesh& mesh, std::size_t c) {
  std::vector<Vec3> corners;
  for (const Index v : mesh.cell(c)) corners.push_back(mesh.positions[v]);
  return corners;
}

std::string with_text(const TemporaryFolder& folder, const char* name, const std::string& text) {
  std::ofstream(folder / name) << text;
  return folder / name;
}

}  // namespace

TEST_CASE("Meshes with pyramids are sound, and lattices of them fill their cubes") {
  for (const VolumeMesh& mesh : {mixed_cells_with_pyramid(), pyramid_lattice(2)}) {
    CHECK(validate(mesh).empty());
    const MeshCheck check = check_mesh(mesh);
    CHECK(check.valid());
    CHECK(check.quality->certificate.all_certified());
    CHECK(check.euler_number == 1);
  }
  const VolumeMesh lattice = pyramid_lattice(2);
  CHECK(triangulate(boundary_surface(lattice, MeshTopology(lattice))).triangles.size() == 2 * 24);
  CHECK_THAT(to_text(check_mesh(mixed_cells_with_pyramid())),
             Contains("1 hex, 1 prism, 1 tet") && Contains("1 pyramid"));
}

TEST_CASE("A pyramid is refuted where its base folds over") {
  VolumeMesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0.3, 0.3, 0}, {0, 1, 0}, {0.3, 0.3, 1}};
  mesh.add_cell(CellKind::pyramid, std::array<Index, 5>{0, 1, 2, 3, 4});
  const MeshCheck check = check_mesh(mesh);
  CHECK(check.quality->inverted_cells == 1);
  REQUIRE(check.witnesses.size() == 1);
  CHECK(check.witnesses[0].determinant < 0);
  CHECK((check.witnesses[0].position - Vec3(0.3, 0.3, 0)).norm() < 1e-12);
  CHECK(validate(mesh).size() == 1);
}

TEST_CASE("Pyramids come back from every format, with their references and the groups of their faces", "[export]") {
  const VolumeMesh mesh = grouped_mesh();
  const TemporaryFolder folder;
  for (const char* extension : {".mesh", ".vtk", ".vtu", ".msh", ".inp", ".bdf", ".mfem", ".e"}) {
    INFO(extension);
    if (std::string(extension) == ".e" && !has_exodus()) continue;
    const auto path = folder / ("a" + std::string(extension)).c_str();
    if (std::string(extension) == ".mesh" || std::string(extension) == ".vtk")
      write_volume_mesh(path, mesh);
    else
      write_volume(path, mesh);
    CHECK_NOTHROW(require_written(path, mesh));
    const VolumeMesh found = read_volume_mesh(path);
    CHECK(found.positions == mesh.positions);
    CHECK(cells_of(found) == cells_of(mesh));
    const bool holds_groups = std::string(extension) != ".vtk" && std::string(extension) != ".bdf";
    if (!holds_groups) continue;
    for (const GroupedFace& face : mesh.face_groups.faces)  // MFEM has a group of all other faces of the boundary
      CHECK(std::ranges::any_of(found.face_groups.faces, [&](const GroupedFace& f) { return f.face == face.face; }));
  }
}

TEST_CASE("Mirrored pyramids are turned over as other cells are") {
  VolumeMesh mesh = pyramid_lattice(1);
  for (Vec3& p : mesh.positions) p[0] = -p[0];
  const TemporaryFolder folder;
  for (const char* name : {"a.mesh", "a.vtk"}) {
    write_volume_mesh(folder / name, mesh);
    std::vector<std::string> warnings;
    const VolumeMesh found = read_volume_mesh(folder / name, {.warnings = &warnings});
    CHECK(validate(found).empty());
    REQUIRE(warnings.size() == 2);
    CHECK_THAT(warnings[0], Contains("numbered anew"));
    CHECK_THAT(warnings[1], Contains("pyramids, which cannot be subdivided or fitted: 6"));
  }
}

TEST_CASE("Curved pyramids are refused with the reason") {
  const TemporaryFolder folder;
  const auto refusal = [](const std::string& path) {
    try {
      read_nodal_mesh(path);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string nodes = "*NODE\n1, 0, 0, 0\n";
  CHECK_THAT(refusal(with_text(folder, "a.inp", nodes + "*ELEMENT, TYPE=C3D13\n1, 1\n")), Contains("no polynomials"));
  CHECK_THAT(
      refusal(with_text(folder, "a.vtk",
                        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 double\n0 0 0\n"
                        "CELLS 1 14\n13 0 0 0 0 0 0 0 0 0 0 0 0 0\nCELL_TYPES 1\n27\n")),
      Contains("a.vtk:9") && Contains("curved pyramid"));
}

TEST_CASE("What cannot use pyramids says so and names the way out") {
  const VolumeMesh mesh = mixed_cells_with_pyramid();
  const std::vector<char> marked(mesh.num_vertices(), 1);
  const TriangleMesh target = triangulate(boundary_surface(mesh, MeshTopology(mesh)));
  const auto has_reason = Contains("pyramids in the mesh: 1, the first is cell 1. 'subvol template split --into tets'");
  CHECK_THROWS_WITH(subdivide(mesh), has_reason);
  CHECK_THROWS_WITH(refine_locally(mesh, marked, WarpedParts::refused), Contains("is no hex"));
  CHECK_THROWS_WITH(fit_subdivision_volume(target, mesh, {}), has_reason);
  CHECK_THROWS_WITH(fit_high_order(target, mesh, {}), has_reason);
  CHECK_THROWS_AS(ElementSpace(mesh, Basis::legendre, 2), InputError);
}

TEST_CASE("Pyramids are cut into two tets each") {
  const VolumeMesh mesh = mixed_cells_with_pyramid();
  const VolumeMesh tets = split_into_tets(mesh);
  CHECK(tets.num_cells() == 6 + 2 + 3 + 1);
  CHECK(check_mesh(tets).valid());
  double volume = 0;
  for (std::size_t c = 0; c < tets.num_cells(); ++c) volume += min_bernstein(CellKind::tet, corners_of(tets, c)) / 6;
  CHECK(volume == Approx(1 + 0.8 / 3 + 0.5 + 0.8 / 6));
}
