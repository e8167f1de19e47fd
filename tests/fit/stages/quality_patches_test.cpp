// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/quality_patches.h"

#include "subvol/fit/energies/quality_energy.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <memory>

using namespace subvol;
using namespace subvol::internal;

namespace {

constexpr int kLength = 16, kWidth = 4;

/// A bar of cubes, all of whose vertices are degrees of freedom, without a surface.
FitProblem free_bar(const VolumeMesh& bar) {
  const std::vector<Vec3> lengths(bar.num_cells(), Vec3::Ones());
  return FitProblem(identity_map(bar.num_vertices()), SparseMap{bar.num_vertices(), {0}, {}, {}},
                    std::make_unique<QualityEnergy>(bar, lengths), nullptr, 1.0);
}

Index vertex_at(const VolumeMesh& bar, const Vec3& place) {
  return static_cast<Index>(std::ranges::find(bar.positions, place) - bar.positions.begin());
}

}  // namespace

TEST_CASE("Patches hold the cells around their centers, and share none", "[quality]") {
  const VolumeMesh bar = test::lattice(kLength, kWidth, kWidth);
  const FitProblem problem = free_bar(bar);
  const Index last = static_cast<Index>(bar.num_cells()) - 1;
  SECTION("one at each end") {
    const auto patches = quality_patches(bar, problem, {}, std::vector<Index>{0, last}, 1, bar.num_cells());
    REQUIRE(patches.size() == 2);
    CHECK(patches[0].unknowns.size() == 27);  // the vertices of 2 x 2 x 2 cells
    CHECK(patches[0].cells.size() == 27);     // the cells at these
    CHECK(patches[0].vertices.size() == 64);
    CHECK(patches[1].cells.size() == 27);
    CHECK(std::ranges::find_first_of(patches[0].cells, patches[1].cells) == patches[0].cells.end());
    const VolumeMesh part = patch_mesh(bar, patches[1].cells);
    CHECK(part.num_cells() == 27);
    CHECK(part.positions[part.cell(26)[6]] == Vec3(kLength, kWidth, kWidth));
  }
  SECTION("one, if they meet") {
    CHECK(quality_patches(bar, problem, {}, std::vector<Index>{0, 4}, 1, bar.num_cells()).size() == 1);
  }
  SECTION("none, if they would be too large") {
    CHECK(quality_patches(bar, problem, {}, std::vector<Index>{0}, 1, 26).empty());
    CHECK(quality_patches(bar, problem, {}, std::vector<Index>{}, 1, 26).empty());
  }
}

TEST_CASE("Part of a map has the rows and columns that are asked for", "[quality]") {
  const SparseMap map{4, {0, 2, 3, 6}, {0, 3, 1, 0, 2, 3}, {1, 2, 3, 4, 5, 6}};
  const SparseMap part = select(map, std::vector<Index>{0, 2}, std::vector<Index>{2, 3});
  CHECK(part.num_cols == 2);
  CHECK(part.offsets == std::vector<std::size_t>{0, 1, 3});
  CHECK(part.columns == std::vector<Index>{1, 0, 1});
  CHECK(part.values == std::vector<double>{2, 5, 6});
}

TEST_CASE("A lift moves only the patch around a poor cell", "[quality]") {
  const VolumeMesh bar = test::lattice(kLength, kWidth, kWidth);
  const std::vector<Vec3> lengths(bar.num_cells(), Vec3::Ones());
  const TargetSurface target(test::cube_surface(2, false));
  std::vector<Vec3> x = bar.positions;
  const Index poor = vertex_at(bar, Vec3(2, 2, 2));
  x[poor] += Vec3(0.7, 0.6, 0.5);
  const std::vector<Vec3> start = x;

  constexpr double kGoal = 0.8;
  QualityStages stages(bar, lengths, identity_map(x.size()), {}, {}, target);
  QualitySchedule schedule = fine_quality_schedule(kGoal);
  schedule.stages.clear();
  const StageRunner runner({});
  StageRecord record;
  record.name = "bar";
  FitReport report;
  REQUIRE(stages.run(schedule, runner, record, x, report));
  CHECK(stages.state().cells.least >= kGoal);
  CHECK(stages.state().merit >= 1);
  REQUIRE(report.stages.size() == 1);
  CHECK(report.stages[0].name == "bar, lift of 1 patches");
  CHECK(x[poor] != start[poor]);
  for (std::size_t v = 0; v < x.size(); ++v)
    if (bar.positions[v].x() > 8) CHECK(x[v] == start[v]);
}

TEST_CASE("A patch of the surface has the correspondences that it has in the whole", "[surface]") {
  const TriangleMesh sphere = test::cube_surface(8, true);
  const TargetSurface target(sphere);
  std::vector<Vec3> samples = sphere.positions;
  test::RandomPoints random(3);
  const std::vector<Vec3> noise = random.points(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] += 0.01 * noise[i];
  ClosestPointEnergy whole(target, sphere.triangles, samples.size(), 0.1, 3, SurfacePull::straight_both_ways);
  whole.assign(samples);
  std::vector<Vec3> gradient(samples.size(), Vec3::Zero());
  whole.add_gradient(samples, gradient);

  // The samples of the upper cap move; the triangles that touch them are the patch.
  const auto moves = [&](Index i) { return sphere.positions[i].z() > 0.5; };
  std::vector<Index> triangles, numbers(samples.size(), kNoIndex);
  std::vector<std::uint8_t> is_free;
  std::vector<Vec3> own;
  for (std::size_t t = 0; t < sphere.triangles.size(); ++t) {
    if (!std::ranges::any_of(sphere.triangles[t], moves)) continue;
    triangles.push_back(static_cast<Index>(t));
    for (const Index i : sphere.triangles[t]) {
      if (numbers[i] != kNoIndex) continue;
      numbers[i] = static_cast<Index>(own.size());
      own.push_back(samples[i]);
      is_free.push_back(moves(i));
    }
  }
  ClosestPointEnergy part(whole, triangles, numbers, is_free);
  part.assign(own);
  std::vector<Vec3> own_gradient(own.size(), Vec3::Zero());
  part.add_gradient(own, own_gradient);
  std::size_t compared = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!moves(static_cast<Index>(i))) continue;
    CHECK((own_gradient[numbers[i]] - gradient[i]).norm() < 1e-9 * gradient[i].norm() + 1e-15);
    ++compared;
  }
  CHECK(compared > 20);
}

TEST_CASE("Relaxing the cells at faces that meet moves them apart, and nothing else", "[quality]") {
  const VolumeMesh block = test::lattice(kLength, kWidth, kWidth);
  VolumeMesh slotted{.positions = block.positions};  // the slot is one cell wide and half as deep as the bar
  for (std::size_t c = 0; c < block.num_cells(); ++c) {
    Vec3 center = Vec3::Zero();
    for (const Index v : block.cell(c)) center += block.positions[v] / 8;
    const bool in_slot = center.x() > 4 && center.x() < 5 && center.z() > kWidth / 2;
    if (!in_slot) slotted.add_cell(CellKind::hex, block.cell(c));
  }
  std::vector<Vec3> x = slotted.positions;
  for (const double y : {1.0, 2.0, 3.0}) x[vertex_at(slotted, Vec3(4, y, kWidth))].x() += 1.2;
  const std::vector<Vec3> start = x;
  const auto cells_that_meet = [&] {
    VolumeMesh mesh = slotted;
    mesh.positions = x;
    const MeshTopology topology(mesh);
    std::vector<Index> face, cells;
    for (const auto& pair : self_intersections(refined_triangles(boundary_surface(mesh, topology), &face)).pairs)
      for (const Index t : pair) cells.push_back(topology.face_cells(topology.boundary_faces()[face[t]])[0]);
    std::ranges::sort(cells);
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    return cells;
  };
  const std::vector<Index> cells = cells_that_meet();
  REQUIRE_FALSE(cells.empty());

  const std::vector<Vec3> lengths(slotted.num_cells(), Vec3::Ones());
  const TargetSurface target(test::cube_surface(2, false));
  QualityStages stages(slotted, lengths, identity_map(x.size()), {}, {}, target);
  FitReport report;
  REQUIRE(stages.relax(cells, 1, {1, {}, 6}, StageRunner({}), {}, x, report));
  CHECK(report.stages.size() == 1);
  CHECK(cells_that_meet().empty());
  for (std::size_t v = 0; v < x.size(); ++v)
    if (start[v].x() > 10) CHECK(x[v] == start[v]);
}
