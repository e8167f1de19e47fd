// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/region_template.h"

#include "subvol/base/error.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/validate.h"
#include "subvol/templates/label_surface.h"
#include "subvol/templates/pillow.h"
#include "subvol/templates/voxel_labels.h"
#include "tests/support/region_fixtures.h"

#include <catch2/catch.hpp>

#include <random>

using namespace subvol;
using namespace subvol::internal;
using test::ball_surface;
using test::box_surface;
using test::together;

namespace {

RegionTemplate made(const RegionSurface& surface, std::size_t cells, bool for_pillow) {
  RegionTemplateResult result = region_template(surface, {cells, for_pillow, {}});
  REQUIRE(result.made);
  CHECK(validate(result.made->mesh).empty());
  CHECK(region_references(result.made->mesh).size() == surface.regions.size());
  return std::move(*result.made);
}

}  // namespace

TEST_CASE("Slabs get a grid through their planes, each cell in its slab", "[regions][templates]") {
  const auto surface = find_regions(test::slabs_surface(5));
  REQUIRE(surface);
  const RegionTemplate grid = made(*surface, 300, true);
  CHECK(grid.through_planes);
  CHECK(grid.aligned_share == Approx(1));
  CHECK(grid.wrong_sheets == 0);
  const MeshTopology topology(grid.mesh);
  CHECK(find_interfaces(grid.mesh, topology).pairs.size() == 4);
  for (std::size_t c = 0; c < grid.mesh.num_cells(); ++c) {
    Vec3 center = Vec3::Zero();
    for (const Index v : grid.mesh.cell(c)) center += grid.mesh.positions[v] / 8;
    CHECK(grid.mesh.references[c] == 1 + static_cast<int>(center.z() * 5));
  }
}

TEST_CASE("A ball in a box, thin shells and neighbors get templates of the right topology that can be pillowed",
          "[regions][templates][slow]") {
  const TriangleMesh cube = box_surface({-1, -1, -1}, {1, 1, 1}, 8);
  const TriangleMesh shells = together(together(ball_surface({0, 0, 0}, 1, 16), ball_surface({0, 0, 0}, 0.92, 16)),
                                       ball_surface({0, 0, 0}, 0.4, 8));
  const TriangleMesh two =
      together(together(cube, ball_surface({-0.4, 0, 0}, 0.3, 8)), ball_surface({0.4, 0, 0}, 0.3, 8));
  for (const TriangleMesh& target : {together(cube, ball_surface({0, 0, 0}, 0.6, 12)), shells, two}) {
    const auto surface = find_regions(target);
    REQUIRE(surface);
    const RegionTemplate grid = made(*surface, 1500, true);
    CHECK(grid.wrong_sheets == 0);
    const VolumeMesh pillowed = pillow_regions(grid.mesh);
    CHECK(validate(pillowed).empty());
    CHECK(static_cast<double>(pillowed.num_cells()) < 1.5 * static_cast<double>(grid.cells_asked));
    // The interfaces keep their vertices, and each of their faces has a new cell on either side.
    const MeshTopology before(grid.mesh), after(pillowed);
    const Interfaces old_faces = find_interfaces(grid.mesh, before), new_faces = find_interfaces(pillowed, after);
    CHECK(old_faces.pairs == new_faces.pairs);
    CHECK(old_faces.faces.size() == new_faces.faces.size());
    CHECK(before.boundary_faces().size() == after.boundary_faces().size());
    for (const Index f : new_faces.faces)
      for (const Index c : after.face_cells(f)) CHECK(static_cast<std::size_t>(c) >= grid.mesh.num_cells());
  }
}

TEST_CASE("Simple changes of labels keep the topology of all regions and sheets", "[regions][templates]") {
  std::mt19937 random(3);
  VoxelLabels labels({12, 12, 12}, 3, VertexRule::manifold);
  // Three blocks side by side, the third on top of both.
  for (int k = 3; k < 9; ++k)
    for (int j = 3; j < 9; ++j)
      for (int i = 3; i < 9; ++i) labels.set(i + 12 * (j + 12 * k), k >= 6 ? 3 : i < 6 ? 1 : 2);
  const RegionTopology wanted = labels.topology();
  REQUIRE(wanted.sheets.size() == 6);
  CHECK(wanted.sheets.at({1, 2}) == SheetTopology{1, 1});
  int changes = 0;
  for (int round = 0; round < 4000; ++round) {
    const auto c = static_cast<Index>(random() % labels.num_cells());
    if (!labels.may_set(c)) continue;
    const int label = labels.label(c + labels.face_offsets()[random() % 6]);
    if (label == labels.label(c) || !labels.is_simple(c, label)) continue;
    labels.set(c, label);
    ++changes;
  }
  CHECK(changes > 100);
  const RegionTopology found = labels.topology();
  CHECK(found.regions == wanted.regions);
  CHECK(found.sheets == wanted.sheets);
}

TEST_CASE("Templates with regions can be cancelled, and refuse senseless counts", "[regions][templates]") {
  const auto surface = find_regions(test::slabs_surface(2));
  REQUIRE(surface);
  CHECK(region_template(*surface, {300, false, [](double) { return false; }}).cancelled);
  CHECK_THROWS_AS(region_template(*surface, {2, false, {}}), InputError);
}

TEST_CASE("Regions that are too far apart for any grid are refused", "[regions][templates]") {
  for (const double distance : {1e4, 1e9}) {
    TriangleMesh far = test::slabs_surface(2);
    for (Vec3& p : far.positions) p += Vec3::Constant(distance);
    const auto surface = find_regions(together(test::slabs_surface(2), far));
    REQUIRE(surface);
    REQUIRE(surface->regions.size() == 4);
    CHECK_THROWS_WITH(region_template(*surface, {100, false, {}}), Catch::Contains("far apart"));
    CHECK_THROWS_WITH(region_template(*surface, {100, true, {}}), Catch::Contains("far apart"));
  }
}

TEST_CASE("A search among many regions ends soon after it is told to", "[regions][templates]") {
  constexpr int kSide = 40, kPart = 4;  // a thousand regions
  LabelGrid grid;
  grid.counts = {kSide, kSide, kSide};
  for (int k = 0; k < kSide; ++k)
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i)
        grid.labels.push_back(1 + i / kPart + kSide / kPart * (j / kPart + kSide / kPart * (k / kPart)));
  const RegionSurface surface = surface_of_labels(grid, {0, 1, {}});
  REQUIRE(surface.regions.size() == 1000);
  int questions = 0;
  const auto refuse = [&](double) { return ++questions == 0; };
  const RegionTemplateResult result = region_template(surface, {1000, false, refuse});
  CHECK(result.cancelled);
  CHECK(!result.made);
  CHECK(questions == 1);
  CHECK(surface_of_labels(grid, {30, 1, [] { return true; }}).regions.empty());
}
