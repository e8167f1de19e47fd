// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/audit.h"
#include "subvol/io/mesh_io.h"
#include "subvol/subdivision/subdivision.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

namespace subvol::test {

TEST_CASE("the audit counts smooth edges of one cell and forgets them once creased", "[audit]") {
  VolumeMesh cube = lattice(1, 1, 1);
  SubdivisionAudit found = audit(cube);
  CHECK(found.num_boundary_edges == 12);
  CHECK(found.flattened_edges.size() == 12);
  CHECK(found.warnings.size() == 1);
  tag_creases(cube, 40);
  found = audit(cube);
  CHECK(found.flattened_edges.empty());
  CHECK(found.reflex_creases.empty());
  CHECK(found.folding_corners.empty());
  CHECK(found.warnings.empty());
}

TEST_CASE("the audit finds reflex creases and the corners where they end", "[audit]") {
  VolumeMesh mesh = l_shape(2);
  tag_creases(mesh, 40);
  const SubdivisionAudit found = audit(mesh);
  CHECK(found.can_subdivide());
  CHECK(found.reflex_creases.size() == 2);
  REQUIRE(found.folding_corners.size() == 2);
  for (Index v : found.folding_corners) CHECK(mesh.positions[v].head<2>() == Eigen::Vector2d(1, 1));
  for (const auto& [a, b] : found.reflex_creases) CHECK(mesh.positions[a].head<2>() == mesh.positions[b].head<2>());
  CHECK(found.folding_edges.size() == 4);
  mesh.tags = unfolding_tags(mesh, found);
  CHECK(audit(mesh).folding_corners.empty());
}

TEST_CASE("creases where the audit finds folds keep the cells of a short reflex crease positive", "[audit]") {
  VolumeMesh mesh = fan(3, 270, 2);
  for (int k = 0; k <= 2; ++k)
    for (int ray = 1; ray < 3; ++ray) mesh.positions[8 * k + 1 + 2 * ray].head<2>() *= 0.4;
  tag_creases(mesh, 40);
  const auto inverted_after = [](VolumeMesh control, int levels) {
    for (int level = 0; level < levels; ++level) control = subdivide(control).fine;
    return count_inverted(control);
  };
  CHECK(inverted_after(mesh, 4) > 0);
  mesh.tags = unfolding_tags(mesh, audit(mesh));
  CHECK(inverted_after(mesh, 4) == 0);
}

TEST_CASE("creased templates stay positive after the audit's remedy", "[audit][data]") {
  const auto folder = require_data();
  if (!folder) return;
  for (const char* name : {"hanger139", "cad_fandisk49", "cad_cube17", "doubletorus17"}) {
    VolumeMesh mesh = read_volume_mesh(*folder / "fit" / name / "template.mesh");
    tag_creases(mesh, 40);
    mesh.tags = unfolding_tags(mesh, audit(mesh));
    for (int level = 1; level <= 3; ++level) {
      mesh = subdivide(mesh).fine;
      CAPTURE(name, level);
      CHECK(count_inverted(mesh) == 0);
    }
  }
}

TEST_CASE("the audit names boundary edges and vertices that are no manifold", "[audit]") {
  const SubdivisionAudit edge = audit(voxels(2, 2, 1, [](int i, int j, int) { return i == j; }));
  CHECK(!edge.can_subdivide());
  CHECK(edge.nonmanifold_edges.size() == 1);
  const SubdivisionAudit vertex = audit(voxels(2, 2, 2, [](int i, int j, int k) { return i == j && j == k; }));
  CHECK(!vertex.can_subdivide());
  CHECK(vertex.nonmanifold_edges.empty());
  CHECK(vertex.nonmanifold_vertices.size() == 1);
}

}  // namespace subvol::test
