// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/graded_grid.h"

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/templates/pillow.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <functional>
#include <limits>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

namespace {

constexpr int kBlockCells = 4;  // of the block, along each axis
constexpr int kCellSize = 3;    // length of a cell
constexpr int kSpareCells = 3;  // cells of the grid on each side of the block
constexpr int kBlockSize = kCellSize * kBlockCells;

TriangleMesh outer_surface_of(const VolumeMesh& mesh) {
  return triangulate(boundary_surface(mesh, MeshTopology(mesh)));
}

/// Boundary of the unit cubes at (i, j, k) that are kept; those with 0 <= i, j, k < kBlockSize fill the block.
TriangleMesh cubes(const std::function<bool(int, int, int)>& keep) {
  constexpr int kAll = kBlockSize + 2 * kCellSize;
  VolumeMesh mesh = test::voxels(
      kAll, kAll, kAll, [&](int i, int j, int k) { return keep(i - kCellSize, j - kCellSize, k - kCellSize); });
  for (Vec3& p : mesh.positions) p -= Vec3::Constant(kCellSize);
  return outer_surface_of(mesh);
}

bool is_in_block(int i, int j, int k) { return std::min({i, j, k}) >= 0 && std::max({i, j, k}) < kBlockSize; }

VoxelGrid grid_around_block() {
  const double low = -kSpareCells * kCellSize, high = kBlockSize + kSpareCells * kCellSize;
  return box_grid(Vec3::Constant(low), Vec3::Constant(high),
                  {kBlockCells + 2 * kSpareCells, kBlockCells + 2 * kSpareCells, kBlockCells + 2 * kSpareCells});
}

std::vector<char> block_cells(const VoxelGrid& grid) {
  std::vector<char> kept(grid.num_cells(), 0);
  for (int k = 0; k < kBlockCells; ++k)
    for (int j = 0; j < kBlockCells; ++j)
      for (int i = 0; i < kBlockCells; ++i) kept[grid.cell(kSpareCells + i, kSpareCells + j, kSpareCells + k)] = 1;
  return kept;
}

double volume_inside(const VolumeMesh& mesh) { return solid_boundary(outer_surface_of(mesh)).volume; }

}  // namespace

TEST_CASE("A slot narrower than a cell is carved out of a graded grid", "[graded_grid]") {
  const auto is_in_slot = [](int i, int k) { return i == 4 && k >= 5; };
  const TriangleMesh target = cubes([&](int i, int j, int k) { return is_in_block(i, j, k) && !is_in_slot(i, k); });
  const VoxelGrid grid = grid_around_block();
  std::vector<Vec3> places;
  for (int j = 0; j < kBlockSize; ++j)
    for (int k = 5; k < kBlockSize; ++k) places.emplace_back(4.5, j + 0.5, k + 0.5);
  const GradedGrid graded = graded_grid(target, grid, block_cells(grid), cells_around_points(grid, places));
  CHECK(validate(graded.mesh).empty());
  CHECK(volume_inside(graded.mesh) == Approx(solid_boundary(target).volume));
  REQUIRE(graded.sizes.size() == graded.mesh.num_cells());
  CHECK(std::ranges::min(graded.sizes) == Approx(1.0 / 3));
  CHECK(std::ranges::max(graded.sizes) <= 1);
  CHECK(validate(pillow(graded.mesh)).empty());
}

TEST_CASE("A pin thinner than a cell grows out of a graded grid", "[graded_grid]") {
  const TriangleMesh target = cubes([&](int i, int j, int k) {
    return is_in_block(i, j, k) || (i == 7 && j == 7 && k >= kBlockSize && k < kBlockSize + 2);
  });
  const VoxelGrid grid = grid_around_block();
  const std::vector<Vec3> places{{7.5, 7.5, kBlockSize + 1.5}};
  const std::vector<char> cut = cells_around_points(grid, places);
  CHECK(std::ranges::count(cut, 1) == 27);
  const GradedGrid graded = graded_grid(target, grid, block_cells(grid), cut);
  CHECK(validate(graded.mesh).empty());
  CHECK(volume_inside(graded.mesh) == Approx(kBlockSize * kBlockSize * kBlockSize + 2));
  CHECK(solid_boundary(outer_surface_of(graded.mesh)).topology == BettiNumbers{1, 0, 0});
  CHECK(validate(pillow(graded.mesh)).empty());
}

TEST_CASE("Carving small cells changes no topology", "[graded_grid]") {
  // A hole through the block and a ball beside it: the grid's cells know of neither.
  const TriangleMesh target = cubes([&](int i, int j, int k) {
    const bool is_in_hole = i == 4 && j == 4, is_in_ball = i == 14 && j == 4 && k == 4;
    return (is_in_block(i, j, k) && !is_in_hole) || is_in_ball;
  });
  const VoxelGrid grid = grid_around_block();
  std::vector<Vec3> places{{14.5, 4.5, 4.5}};
  for (int k = 0; k < kBlockSize; ++k) places.emplace_back(4.5, 4.5, k + 0.5);
  const GradedGrid graded = graded_grid(target, grid, block_cells(grid), cells_around_points(grid, places));
  CHECK(validate(graded.mesh).empty());
  CHECK(solid_boundary(outer_surface_of(graded.mesh)).topology == BettiNumbers{1, 0, 0});
}

TEST_CASE("Cells that are not cut stay as they are", "[graded_grid]") {
  const TriangleMesh target = cubes(is_in_block);
  const VoxelGrid grid = grid_around_block();
  const std::vector<char> kept = block_cells(grid);
  std::vector<char> cut(grid.num_cells(), 0);
  cut.front() = cut.back() = 1;  // on the outer layer
  const GradedGrid graded = graded_grid(target, grid, kept, cut);
  CHECK(graded.mesh.num_cells() == kBlockCells * kBlockCells * kBlockCells);
  CHECK(std::ranges::count(graded.sizes, 1) == kBlockCells * kBlockCells * kBlockCells);
  const std::vector<Vec3> outside{
      {1e9, 0, 0}, {0, -1e300, 0}, Vec3::Constant(std::numeric_limits<double>::quiet_NaN())};
  CHECK(std::ranges::count(cells_around_points(grid, outside), 0) == static_cast<std::ptrdiff_t>(grid.num_cells()));
  CHECK(graded_grid(target, grid, std::vector<char>(grid.num_cells(), 0), cut).mesh.num_cells() == 0);
}

TEST_CASE("A grid through planes is graded as well", "[graded_grid]") {
  const TriangleMesh target = cubes([](int i, int j, int k) { return is_in_block(i, j, k) && !(i == 4 && k >= 5); });
  const std::vector<double> lines{-12, -8, -4, 0, 3, 6, 12, 16, 20, 24};
  const VoxelGrid grid = grid_through(Mat3::Identity(), {lines, lines, lines});
  std::vector<char> kept(grid.num_cells(), 0);
  for (int k = 3; k < 6; ++k)
    for (int j = 3; j < 6; ++j)
      for (int i = 3; i < 6; ++i) kept[grid.cell(i, j, k)] = 1;
  std::vector<Vec3> places;
  for (double y = 0.5; y < kBlockSize; ++y)
    for (double z = 5.5; z < kBlockSize; ++z) places.emplace_back(4.5, y, z);
  const GradedGrid graded = graded_grid(target, grid, kept, cells_around_points(grid, places));
  CHECK(validate(graded.mesh).empty());
  CHECK(volume_inside(graded.mesh) == Approx(solid_boundary(target).volume));  // small cells end at x = 4, 5 and z = 5
}
