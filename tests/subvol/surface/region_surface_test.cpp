// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/region_surface.h"

#include "subvol/surface/solid_topology.h"
#include "subvol/surface/welded_surface.h"
#include "tests/support/region_fixtures.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <numeric>
#include <random>

using namespace subvol;
using test::ball_surface;
using test::box_surface;
using test::together;
using test::turned;

namespace {

/// Turns about half of the triangles.
TriangleMesh disordered(TriangleMesh mesh) {
  std::mt19937 random(7);
  for (auto& t : mesh.triangles)
    if (random() % 2 == 0) std::swap(t[1], t[2]);
  return mesh;
}

bool are(const std::vector<double>& values, const std::vector<double>& expected) {
  return std::ranges::equal(values, expected, [](double a, double b) { return a == Approx(b); });
}

}  // namespace

TEST_CASE("Sheets that divide a box make regions, whatever way their triangles face", "[regions]") {
  const TriangleMesh slabs = test::slabs_surface(5);
  for (const TriangleMesh& given : {slabs, turned(slabs), disordered(slabs)}) {
    const auto found = find_regions(given);
    REQUIRE(found);
    REQUIRE(found->regions.size() == 5);
    CHECK(found->mesh.triangles.size() == slabs.triangles.size());
    for (const double volume : found->volumes) CHECK(volume == Approx(0.2));
    CHECK(region_pairs(*found).size() == 5 + 4);
    for (std::size_t t = 0; t < found->sides.size(); ++t) {
      const auto& [behind, front] = found->sides[t];
      CHECK(behind != kOutsideRegion);
      CHECK((front == kOutsideRegion || behind < front));
    }
    for (const Group& region : found->regions) {
      const SolidBoundary solid = solid_boundary(boundary_of_region(*found, region.number));
      CHECK(solid.topology == BettiNumbers{1, 0, 0});
      CHECK(solid.flipped_triangles == 0);
    }
    const SolidBoundary whole = solid_boundary(outer_surface(*found));
    CHECK(whole.volume == Approx(1));
    CHECK(whole.flipped_triangles == 0);
    std::vector<Index> inner;
    CHECK(inner_surface(*found, inner).triangles.size() == 8);
    CHECK(curve_edges(*found).size() == 16);
  }
  CHECK(!find_regions(slabs, RegionRule::merge));
}

TEST_CASE("A part inside another is a region unless it faces inward", "[regions]") {
  const TriangleMesh outer = box_surface({-2, -2, -2}, {2, 2, 2}), inner = box_surface({-1, -1, -1}, {1, 1, 1});
  CHECK(!find_regions(outer));
  CHECK(!find_regions(together(outer, turned(inner))));
  CHECK(!find_regions(together(turned(outer), inner)));
  CHECK(!find_regions(together(outer, box_surface({3, -1, -1}, {4, 1, 1}))));
  const auto nested = find_regions(together(outer, inner));
  REQUIRE(nested);
  CHECK(are(nested->volumes, {56, 8}));
  REQUIRE(nested->notes.size() == 1);
  CHECK(nested->notes[0].find("--regions merge") != std::string::npos);
  CHECK(find_regions(together(disordered(outer), disordered(inner))));
  const auto twice = find_regions(together(together(outer, turned(inner)), inner));
  REQUIRE(twice);
  CHECK(are(twice->volumes, {56, 8}));
  const auto kept = find_regions(together(outer, turned(inner)), RegionRule::keep);
  REQUIRE(kept);
  CHECK(are(kept->volumes, {56, 8}));
  // A solid that floats in a void is no region of its own; a region inside that solid is.
  const TriangleMesh hollow = together(outer, turned(inner));
  CHECK(!find_regions(together(hollow, box_surface({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}))));
  const auto deep = find_regions(together(together(hollow, box_surface({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5})),
                                          box_surface({-0.25, -0.25, -0.25}, {0.25, 0.25, 0.25})));
  REQUIRE(deep);
  REQUIRE(deep->volumes.size() == 3);
  CHECK(deep->volumes[0] == Approx(56));
  CHECK(deep->volumes[1] == Approx(0.875));
  CHECK(deep->volumes[2] == Approx(0.125));
}

TEST_CASE("Solids that share a face, each with its own copy, are two regions", "[regions]") {
  const auto found = find_regions(together(box_surface({0, 0, 0}, {1, 1, 1}), box_surface({1, 0, 0}, {3, 1, 1})));
  REQUIRE(found);
  CHECK(are(found->volumes, {1, 2}));
  CHECK(std::count_if(found->sides.begin(), found->sides.end(), [](const auto& sides) {
          return sides == std::array<int, 2>{1, 2};
        }) == 8);
}

TEST_CASE("Layers of a cylinder and a membrane inside one of them", "[regions]") {
  TriangleMesh layered = test::layered_cylinder({0.4, 0.7, 1}, 2, 48);
  auto found = find_regions(layered);
  REQUIRE(found);
  REQUIRE(found->volumes.size() == 3);
  const double unit = 2 * 0.5 * 48 * std::sin(2 * std::numbers::pi / 48);
  std::vector<double> volumes = found->volumes;
  std::sort(volumes.begin(), volumes.end());
  CHECK(volumes[0] == Approx(0.16 * unit));
  CHECK(volumes[1] == Approx((0.49 - 0.16) * unit));
  CHECK(volumes[2] == Approx((1 - 0.49) * unit));
  layered.triangles.pop_back();  // an open surface divides nothing
  CHECK(!find_regions(layered));
}

TEST_CASE("The sheets of a mesh with references are a surface with its regions", "[regions]") {
  VolumeMesh mesh = test::lattice(4, 2, 2);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    Vec3 center = Vec3::Zero();
    for (const Index v : mesh.cell(c)) center += mesh.positions[v] / 8;
    mesh.references.push_back(center.x() < 1 ? 9 : 4);
  }
  mesh.regions = {{"left", 9, 3}};
  RegionSurface surface = surface_of_regions(mesh);
  CHECK(surface.regions == std::vector<Group>{{"", 4, 3}, {"left", 9, 3}});
  CHECK(are(surface.volumes, {12, 4}));
  CHECK(find_regions(surface.mesh)->volumes.size() == 2);
  for (int& reference : mesh.references) reference -= 4;
  CHECK(surface_of_regions(mesh).regions.front().number == 1);
}

TEST_CASE("Regions get the names of groups that bound them alone", "[regions]") {
  TriangleMesh surface = together(box_surface({-2, -2, -2}, {2, 2, 2}), ball_surface({0, 0, 0}, 1, 4));
  surface.face_groups.groups = {{"shell", 1, 2}, {"core", 2, 2}};
  surface.face_groups.of_face.assign(surface.triangles.size(), 1);
  std::fill_n(surface.face_groups.of_face.begin(), 48, 0);
  const auto found = find_regions(surface);
  REQUIRE(found);
  CHECK(found->regions == std::vector<Group>{{"shell", 1, 3}, {"core", 2, 3}});
}

TEST_CASE("Regions that lie far apart have their own volumes", "[regions]") {
  for (const double distance : {1e5, 1e7, 1e9}) {
    TriangleMesh far = test::slabs_surface(2);
    for (Vec3& p : far.positions) p += distance * Vec3(0.57, -0.61, 0.49);
    const TriangleMesh both = together(test::slabs_surface(2), far);
    const auto found = find_regions(both);
    REQUIRE(found);
    REQUIRE(found->volumes.size() == 4);
    for (const double volume : found->volumes) CHECK(volume == Approx(0.5).epsilon(1e-6));
    CHECK(internal::signed_volume_of(together(box_surface({0, 0, 0}, {1, 1, 1}), far)) > 0);
  }
}

TEST_CASE("What has no volume up to rounding is no region", "[regions]") {
  TriangleMesh slabs = test::slabs_surface(4);
  for (Vec3& p : slabs.positions)
    if (p.z() == 0.75) p.z() = 0.5 + 1e-13;
  const auto found = find_regions(slabs);
  REQUIRE(found);
  CHECK(are(found->volumes, {0.25, 0.25, 0.5}));
}

TEST_CASE("Boundaries of regions hold their own vertices, in the surface's order", "[regions]") {
  const auto found = find_regions(test::slabs_surface(5));
  REQUIRE(found);
  const std::vector<TriangleMesh> boundaries = boundaries_of_regions(*found);
  REQUIRE(boundaries.size() == 5);
  for (std::size_t r = 0; r < boundaries.size(); ++r) {
    const TriangleMesh one = boundary_of_region(*found, found->regions[r].number);
    CHECK(one.positions == boundaries[r].positions);
    CHECK(one.triangles == boundaries[r].triangles);
    CHECK(one.positions.size() == 8);
    CHECK(internal::signed_volume_of(one) == Approx(0.2));
    CHECK(std::ranges::is_sorted(one.positions, {}, [](const Vec3& p) { return p.z(); }));
  }
}

TEST_CASE("The first group that bounds a region alone names it, and names no other", "[regions]") {
  TriangleMesh surface = together(box_surface({0, 0, 0}, {1, 1, 1}, 1), box_surface({1, 0, 0}, {2, 1, 1}, 1));
  surface.face_groups.groups = {{"one", 1, 2}, {"none", 2, 2}, {"late", 3, 2}, {"two", 4, 2}};
  surface.face_groups.of_face.assign(24, 0);
  std::fill_n(surface.face_groups.of_face.begin() + 12, 12, 3);
  surface.face_groups.of_face[0] = kNoIndex;
  const auto found = find_regions(surface);
  REQUIRE(found);
  REQUIRE(found->regions.size() == 2);
  CHECK(found->regions[1].name == "two");
}
