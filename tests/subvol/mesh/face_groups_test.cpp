// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/face_groups.h"

#include "subvol/mesh/features.h"
#include "subvol/mesh/inherited_groups.h"
#include "subvol/subdivision/subdivision.h"
#include "subvol/surface/boundary.h"
#include "subvol/templates/cell_sheet.h"
#include "subvol/templates/cell_split.h"
#include "subvol/templates/pillow.h"
#include "subvol/templates/refine.h"
#include "subvol/templates/vertex_merge.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// Checks that every boundary face with all corners at height 0 is in "floor", and those at the top in "roof".
void check_floor_and_roof(const VolumeMesh& mesh, double height) {
  const MeshTopology topology(mesh);
  const std::vector<Index> groups = groups_of_boundary(mesh.face_groups, topology);
  REQUIRE(groups.size() == topology.boundary_faces().size());
  std::size_t num_grouped = 0;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    double low = 1e300, high = -1e300;
    for (const Index v : topology.face(topology.boundary_faces()[i])) {
      low = std::min(low, mesh.positions[v].z());
      high = std::max(high, mesh.positions[v].z());
    }
    const std::string name = groups[i] == kNoIndex ? "" : mesh.face_groups.groups[groups[i]].name;
    CHECK(name == (high == 0 ? "floor" : low == height ? "roof" : ""));
    num_grouped += !name.empty();
  }
  CHECK(num_grouped > 0);
}

}  // namespace

TEST_CASE("names that are not UTF-8 are read as Latin-1") {
  std::vector<Group> groups = {{"wall", 1, 2}, {"d\xC3\xBCse", 2, 2}, {"d\xFCse", 3, 2}, {"\xE9", 4, 2}, {"", 5, 2}};
  make_names_utf8(groups);
  CHECK(groups[0].name == "wall");
  CHECK(groups[1].name == "d\xC3\xBCse");
  CHECK(groups[2].name == "d\xC3\xBCse");
  CHECK(groups[3].name == "\xC3\xA9");
  CHECK(groups[4].name.empty());
}

TEST_CASE("a face is found by its corners in any order") {
  const VolumeMesh mesh = with_floor_and_roof(lattice(2, 1, 1), 1);
  const std::array<Index, 4> floor{3, 1, 0, 2}, wall{0, 1, 5, 4};
  CHECK(group_of(mesh.face_groups, floor) == 0);
  CHECK(group_of(mesh.face_groups, wall) == kNoIndex);
  CHECK(face_key(std::array<Index, 3>{5, 2, 9}) == FaceKey{2, 5, 9, kNoIndex});
  check_floor_and_roof(mesh, 1);
}

TEST_CASE("the boundary, its triangles and its polygons have the groups of the faces") {
  const VolumeMesh mesh = with_floor_and_roof(lattice(2, 1, 1), 1);
  const PolygonMesh boundary = boundary_surface(mesh, MeshTopology(mesh));
  REQUIRE(boundary.face_groups.of_face.size() == boundary.num_faces());
  const TriangleMesh triangles = triangulate(boundary);
  REQUIRE(triangles.face_groups.of_face.size() == triangles.triangles.size());
  CHECK(std::count(triangles.face_groups.of_face.begin(), triangles.face_groups.of_face.end(), 0) == 4);
  CHECK(as_polygons(triangles).face_groups == triangles.face_groups);
  CHECK(boundary_surface(lattice(1, 1, 1), MeshTopology(lattice(1, 1, 1))).face_groups.of_face.empty());
}

TEST_CASE("subdivision and edits of templates keep the groups of faces") {
  const VolumeMesh mesh = with_floor_and_roof(lattice(3, 3, 2), 2);
  VolumeMesh creased = mesh;  // stays a box
  creased.tags = features_by_angle(mesh, 40);
  check_floor_and_roof(subdivide(creased, BoundaryRule::averaging).fine, 2);
  check_floor_and_roof(split_into_tets(mesh), 2);
  check_floor_and_roof(split_into_prisms(mesh, 0, 1), 2);
  check_floor_and_roof(split_into_prisms(mesh, 0, 4), 2);
  check_floor_and_roof(split_sheet(mesh, 0, 1, 3), 2);
  check_floor_and_roof(split_sheet(mesh, 0, 4, 2), 2);
  std::vector<char> marked(mesh.num_vertices(), 0);
  marked[0] = 1;
  check_floor_and_roof(refine_at(mesh, marked), 2);
  check_floor_and_roof(pillow(mesh), 2);
  check_floor_and_roof(collapse_sheet(mesh, 0, 1), 2);
}

TEST_CASE("two meshes beside each other keep their groups apart") {
  const VolumeMesh a = with_floor_and_roof(lattice(1, 1, 1), 1);
  VolumeMesh b = a;
  for (Vec3& x : b.positions) x.x() += 1;
  b.face_groups.groups[1].name = "ceiling";
  const VolumeMesh both = glue(joined(a, b), 1e-6);
  REQUIRE(both.face_groups.groups.size() == 3);
  CHECK(both.face_groups.groups[0] == Group{"floor", 1, 2});
  CHECK(both.face_groups.groups[2] == Group{"ceiling", 3, 2});
  CHECK(both.face_groups.faces.size() == 4);
}

TEST_CASE("groups of vertices that are gone, and numbers that are taken") {
  const VolumeMesh mesh = with_floor_and_roof(lattice(1, 1, 1), 1);
  std::vector<Index> number{0, 1, 2, 3, kNoIndex, 4, 5, 6};
  CHECK(renumbered(mesh.face_groups, number).faces.size() == 1);
  CHECK(free_number(std::vector<Group>{{"", 1, 2}, {"", 3, 2}, {"", 2, 2}}) == 4);
  CHECK(label_of({"", 7, 2}) == "group 7");
  CHECK(label_of({"a\xff\xc3\xa4", 7, 2}) == "a?\xc3\xa4");
}
