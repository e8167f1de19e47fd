// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/carried_groups.h"

#include "subvol/surface/boundary.h"
#include "tests/support/grouped_meshes.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

TriangleMesh surface_of(const VolumeMesh& mesh) { return triangulate(boundary_surface(mesh, MeshTopology(mesh))); }

/// A box with a group for each side.
TriangleMesh box_with_sides(const Vec3& size) {
  TriangleMesh box = surface_of(lattice(2, 2, 2));
  for (int side = 0; side < 6; ++side) box.face_groups.groups.push_back({"side " + std::to_string(side), side + 1, 2});
  for (const auto& t : box.triangles) {
    const Vec3 n = (box.positions[t[1]] - box.positions[t[0]]).cross(box.positions[t[2]] - box.positions[t[0]]);
    int axis;
    n.cwiseAbs().maxCoeff(&axis);
    box.face_groups.of_face.push_back(2 * axis + (n[axis] > 0));
  }
  for (Vec3& x : box.positions) x = x.cwiseProduct(size) / 2;
  return box;
}

VolumeMesh box_mesh(const Vec3& size, int n) {
  VolumeMesh mesh = lattice(n, n, n);
  for (Vec3& x : mesh.positions) x = x.cwiseProduct(size) / n;
  return mesh;
}

struct Carried {
  std::vector<CarriedGroup> areas;
  VolumeFaceGroups groups;
};

Carried carry(const TriangleMesh& target, const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  const CurvedBoundary boundary = linear_boundary(mesh, topology);
  const std::vector<Index> found = carried_groups(target, boundary, topology.boundary_faces().size());
  return {areas_of_groups(target, boundary, found), with_carried_groups(target, found, mesh.face_groups, topology)};
}

}  // namespace

TEST_CASE("each boundary face gets the group of the side that it lies on, also on thin plates and edges") {
  for (const Vec3& size : {Vec3(1, 1, 1), Vec3(4, 3, 0.01)}) {
    const TriangleMesh target = box_with_sides(size);
    VolumeMesh mesh = box_mesh(size, 5);
    jitter(mesh, 1e-4);  // no point lies exactly on the target
    const Carried carried = carry(target, mesh);
    REQUIRE(carried.areas.size() == 6);
    for (const CarriedGroup& group : carried.areas) {
      CHECK(group.faces == 25);
      CHECK(group.area == Approx(group.target_area).epsilon(0.03));
    }
    CHECK(warnings_of_groups(carried.areas).empty());
    CHECK(carried.groups.faces.size() == 150);
  }
}

TEST_CASE("a group that is smaller than a face keeps one, unless it is far away or another group would lose its last") {
  TriangleMesh target = box_with_sides({1, 1, 1});
  // A triangle in the corner of a side becomes a group of its own: a tenth as wide as a face of the mesh.
  const std::array<Index, 3> t = target.triangles[0];
  const Vec3 a = target.positions[t[0]];
  const auto first = static_cast<Index>(target.positions.size());
  target.positions.push_back(a + 0.02 * (target.positions[t[1]] - a));
  target.positions.push_back(a + 0.02 * (target.positions[t[2]] - a));
  target.triangles[0] = {first, t[1], t[2]};
  target.triangles.push_back({first, t[2], first + 1});
  target.triangles.push_back({t[0], first, first + 1});
  const Index side = target.face_groups.of_face[0];
  target.face_groups.of_face.push_back(side);
  target.face_groups.of_face.push_back(6);
  target.face_groups.groups.push_back({"pin", 7, 2});
  Carried carried = carry(target, box_mesh({1, 1, 1}, 3));
  CHECK(carried.areas[6].faces == 1);
  CHECK(carried.areas[side].faces == 8);
  CHECK(warnings_of_groups(carried.areas).size() == 2);             // both areas differ
  CHECK(carry(target, box_mesh({1, 1, 1}, 1)).areas[6].is_lost());  // the side has one face only

  for (Index v : {t[0], first, static_cast<Index>(first + 1)})  // the same triangle, far away
    target.positions.push_back(target.positions[v] + Vec3(0, 0, 5));
  target.triangles.back() = {first + 2, first + 3, first + 4};
  CHECK(carry(target, box_mesh({1, 1, 1}, 3)).areas[6].is_lost());
}

TEST_CASE("a target that is oriented inward or not at all gives the same groups") {
  TriangleMesh target = box_with_sides({1, 1, 1});
  const VolumeMesh mesh = box_mesh({1, 1, 1}, 3);
  const Carried outward = carry(target, mesh);
  for (auto& t : target.triangles) std::swap(t[0], t[1]);
  CHECK(carry(target, mesh).groups == outward.groups);
  for (std::size_t t = 0; t < target.triangles.size(); ++t)  // side by side, as CAD programs do
    if (target.face_groups.of_face[t] % 2 == 0) std::swap(target.triangles[t][0], target.triangles[t][1]);
  CHECK(carry(target, mesh).groups == outward.groups);
  target.triangles.push_back(target.triangles[0]);  // bounds no solid
  target.face_groups.of_face.push_back(target.face_groups.of_face[0]);
  CHECK(carry(target, mesh).groups == outward.groups);
}

TEST_CASE("groups that are lost, or too small or large, are told") {
  const TriangleMesh target = box_with_sides({1, 1, 1});
  VolumeMesh mesh = box_mesh({1, 1, 1}, 3);
  for (Vec3& x : mesh.positions) x.z() *= 0.9;
  std::vector<CarriedGroup> areas = carry(target, mesh).areas;
  std::vector<std::string> warnings = warnings_of_groups(areas);
  REQUIRE(warnings.size() == 4);
  CHECK_THAT(warnings[0], Catch::Contains("side 0 is 0.9, on the target it is 1 (-10.0 %)"));
  areas[2].faces = 0;
  CHECK_THAT(warnings_of_groups(areas)[2], Catch::Contains("side 2 is lost"));
}

TEST_CASE("the mesh's own groups stay where the target gives none") {
  TriangleMesh target = box_with_sides({1, 1, 1});
  for (Index& group : target.face_groups.of_face)
    if (group == 4) group = kNoIndex;  // the floor
  VolumeMesh mesh = with_floor_and_roof(lattice(1, 1, 1), 1);
  const VolumeFaceGroups groups = carry(target, mesh).groups;
  CHECK(groups.faces.size() == 6);
  CHECK(groups.groups[groups.faces[0].group] == Group{"floor", 7, 2});
  target.face_groups = {};
  CHECK(carry(target, mesh).groups == mesh.face_groups);
}
