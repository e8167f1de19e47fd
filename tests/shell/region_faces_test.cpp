// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/region_faces.h"

#include "subvol/surface/boundary.h"
#include "subvol/surface/triangle_geometry.h"
#include "tests/support/region_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <map>
#include <utility>

using namespace subvol;
using namespace subvol::internal;

namespace {

double enclosed_volume(const PolygonMesh& surface, const std::vector<char>& is_left_out) {
  std::vector<Index> face;
  const TriangleMesh mesh = triangulate(surface, &face);
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (is_left_out[face[t]]) continue;
    const auto& [a, b, c] = mesh.triangles[t];
    sum += mesh.positions[a].dot(mesh.positions[b].cross(mesh.positions[c])) / 6;
  }
  return sum;
}

}  // namespace

TEST_CASE("faces of a region close it and face outward, whatever way the given ones face", "[shell][regions]") {
  TriangleMesh slabs = test::slabs_surface(3);
  for (std::size_t t = 0; t < slabs.triangles.size(); t += 3) std::swap(slabs.triangles[t][1], slabs.triangles[t][2]);
  const PolygonMesh surface = as_polygons(slabs);
  CHECK(has_inner_sheets(surface));
  const auto regions = find_regions(slabs);
  REQUIRE(regions);
  for (const Group& region : regions->regions) {
    const RegionFaces faces = faces_of_region(surface, *regions, region.number);
    CHECK(enclosed_volume(faces.surface, faces.is_left_out) == Approx(1.0 / 3));
    CHECK(faces.num_left_out == surface.num_faces() - 12);
  }
  const RegionFaces outer = faces_of_region(surface, *regions, kOutsideRegion);
  CHECK(enclosed_volume(outer.surface, outer.is_left_out) == Approx(1));
  CHECK(outer.num_left_out == 4);
}

TEST_CASE("of two faces in one place, a region has one", "[shell][regions]") {
  const TriangleMesh two =
      test::together(test::box_surface({0, 0, 0}, {1, 1, 1}), test::box_surface({1, 0, 0}, {2, 1, 1}));
  const auto regions = find_regions(two);
  REQUIRE(regions);
  const PolygonMesh surface = as_polygons(two);
  for (const Group& region : regions->regions) {
    const RegionFaces faces = faces_of_region(surface, *regions, region.number);
    CHECK(enclosed_volume(faces.surface, faces.is_left_out) == Approx(1));
  }
  CHECK(!has_inner_sheets(as_polygons(test::ball_surface({0, 0, 0}, 1, 4))));
}

TEST_CASE("of two quads in one place, a region has one that its others share vertices with", "[shell][regions]") {
  // Two cubes, each with its own quad between them; the second one's starts at each of its corners in turn.
  PolygonMesh one;
  for (int v = 0; v < 8; ++v) one.positions.push_back(Vec3(v & 1, (v >> 1) & 1, (v >> 2) & 1));
  one.face_vertices = {0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5};
  one.face_offsets = {0, 4, 8, 12, 16, 20, 24};
  for (std::size_t turn = 0; turn < 4; ++turn) {
    CAPTURE(turn);
    PolygonMesh two;
    for (int cube = 0; cube < 2; ++cube) {
      const auto first = static_cast<Index>(two.positions.size());
      for (const Vec3& p : one.positions) two.positions.push_back(p + Vec3(cube, 0, 0));
      for (std::size_t f = 0; f < one.num_faces(); ++f) {
        for (std::size_t k = 0; k < 4; ++k)
          two.face_vertices.push_back(first + one.face_vertices[4 * f + (k + (cube == 1 ? turn : 0)) % 4]);
        two.face_offsets.push_back(two.face_vertices.size());
      }
    }
    const auto regions = find_regions(triangulate(two));
    if (!regions) continue;
    for (const Group& region : regions->regions) {
      const RegionFaces faces = faces_of_region(two, *regions, region.number);
      CHECK(enclosed_volume(faces.surface, faces.is_left_out) == Approx(1));
      std::map<std::pair<Index, Index>, int> num_faces;
      for (std::size_t f = 0; f < two.num_faces(); ++f)
        for (std::size_t k = 0; k < 4 && !faces.is_left_out[f]; ++k)
          ++num_faces[std::minmax(faces.surface.face_vertices[4 * f + k],
                                  faces.surface.face_vertices[4 * f + (k + 1) % 4])];
      CHECK(num_faces.size() == 12);
      for (const auto& [edge, count] : num_faces) CHECK(count == 2);
    }
  }
}
