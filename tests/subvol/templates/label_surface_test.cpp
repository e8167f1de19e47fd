// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/label_surface.h"

#include "subvol/base/error.h"
#include "subvol/surface/solid_topology.h"
#include "tests/support/region_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <random>

using namespace subvol;

TEST_CASE("The sheets of a phantom are smooth, near the truth, and keep the volumes of all regions", "[regions]") {
  const test::Phantom phantom{32};
  LabelGrid grid = phantom.grid();
  std::vector<double> voxels(5, 0.0);
  for (const int label : grid.labels) voxels[static_cast<std::size_t>(label)] += 1;
  grid.labels[0] = 3;  // a speck
  const RegionSurface surface = surface_of_labels(grid);
  REQUIRE(surface.regions.size() == 4);
  CHECK(surface.notes.size() == 1);
  for (int r = 0; r < 4; ++r) {
    CHECK(surface.regions[static_cast<std::size_t>(r)].number == r + 1);
    CHECK(surface.volumes[static_cast<std::size_t>(r)] ==
          Approx(voxels[static_cast<std::size_t>(r + 1)]).epsilon(2e-3));
    const SolidBoundary solid = solid_boundary(boundary_of_region(surface, r + 1));
    CHECK(solid.flipped_triangles == 0);
    CHECK(solid.topology == BettiNumbers{1, 0, r == 0 ? 1 : r == 1 ? 2 : 0});
  }
  CHECK(region_pairs(surface) == std::vector<std::array<int, 2>>{{0, 1}, {1, 2}, {2, 3}, {2, 4}});
  std::array<double, 4> sum{}, count{};
  for (std::size_t t = 0; t < surface.sides.size(); ++t) {
    const auto pair = surface.pair(t);
    const int shape = pair[0] == 0 ? 0 : pair[1] - 1;
    for (const Index v : surface.mesh.triangles[t]) {
      sum[static_cast<std::size_t>(shape)] += phantom.distance(surface.mesh.positions[v], shape);
      count[static_cast<std::size_t>(shape)] += 1;
    }
  }
  for (std::size_t s = 0; s < 4; ++s) CHECK(sum[s] / count[s] < 0.2);
}

TEST_CASE("Voxels of any shape and hand keep their place, and flat sheets stay where they are", "[regions]") {
  LabelGrid grid;
  grid.counts = {4, 6, 5};
  grid.edges = Vec3(2, 0.5, -1).asDiagonal();
  grid.origin = {10, 20, 30};
  for (int k = 0; k < 5; ++k)
    for (int j = 0; j < 6; ++j)
      for (int i = 0; i < 4; ++i) grid.labels.push_back(j < 3 ? 7 : 2);
  const RegionSurface surface = surface_of_labels(grid, {0, 1});
  REQUIRE(surface.regions.size() == 2);
  CHECK(surface.regions[0].number == 2);
  CHECK(surface.volumes[0] == Approx(60));
  CHECK(surface.volumes[1] == Approx(60));
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.mesh.positions) box.extend(p);
  CHECK((box.min() - Vec3(9, 19.75, 25.5)).norm() < 1e-12);
  CHECK((box.max() - Vec3(17, 22.75, 30.5)).norm() < 1e-12);
}

TEST_CASE("Regions that touch along an edge alone are mended, and empty segmentations refused", "[regions]") {
  LabelGrid grid;
  grid.counts = {8, 8, 8};
  for (int k = 0; k < 8; ++k)
    for (int j = 0; j < 8; ++j)
      for (int i = 0; i < 8; ++i) grid.labels.push_back((i < 4) == (j < 4) ? 1 : 0);
  const RegionSurface surface = surface_of_labels(grid);
  REQUIRE(surface.regions.size() == 1);
  CHECK(surface.volumes[0] == Approx(256).epsilon(0.1));
  CHECK_NOTHROW(solid_boundary(boundary_of_region(surface, 1)));
  std::fill(grid.labels.begin(), grid.labels.end(), 0);
  CHECK_THROWS_AS(surface_of_labels(grid), InputError);
  grid.labels[100] = 5;
  CHECK_THROWS_WITH(surface_of_labels(grid), Catch::Contains("label 5 has only specks"));
}

TEST_CASE("Strings of voxels stay whole or are refused with their label", "[regions]") {
  constexpr int kSide = 14, kLength = 20;
  std::size_t kept = 0, refused = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    LabelGrid grid;
    grid.counts = {kSide, kSide, kSide};
    grid.labels.assign(kSide * kSide * kSide, 1);
    std::vector<std::array<int, 3>> string{{7, 7, 7}};
    while (string.size() < kLength) {
      std::array<int, 3> next = string[string.size() - 1 - random() % std::min<std::size_t>(4, string.size())];
      next[random() % 3] += random() % 2 == 0 ? 1 : -1;
      const bool is_inside = std::ranges::all_of(next, [](int i) { return i >= 2 && i < kSide - 2; });
      if (is_inside && std::ranges::find(string, next) == string.end()) string.push_back(next);
    }
    for (const auto& [i, j, k] : string) grid.labels[static_cast<std::size_t>(i + kSide * (j + kSide * k))] = 2;
    try {
      const RegionSurface surface = surface_of_labels(grid);
      REQUIRE(surface.regions.size() == 2);
      CHECK(!boundary_of_region(surface, 2).triangles.empty());
      CHECK(surface.volumes[1] > kLength / 2.0 - 1);
      ++kept;
    } catch (const InputError& error) {
      CHECK_THAT(error.what(), Catch::Contains("label 2"));
      ++refused;
    }
  }
  CHECK(kept > 20);
  CHECK(kept + refused == 40);
}

TEST_CASE("Specks are given away whatever their least size is, and labels must be those of all voxels", "[regions]") {
  LabelGrid grid;
  grid.counts = {2, 2, 2};
  grid.labels.assign(8, 3);
  CHECK_THROWS_WITH(surface_of_labels(grid, {0, 1'000'000'000, {}}), Catch::Contains("label 3 has only specks"));
  CHECK(surface_of_labels(grid, {0, 8, {}}).regions.size() == 1);
  CHECK(surface_of_labels(grid, {0, 8, [] { return true; }}).regions.size() <= 1);
  grid.labels.pop_back();
  CHECK_THROWS_WITH(surface_of_labels(grid), Catch::Contains("7 labels, expected those of 2 x 2 x 2 voxels"));
}

TEST_CASE("Specks inside specks go to what is around them", "[regions]") {
  LabelGrid grid;
  grid.counts = {12, 12, 12};
  // Label 1 in one half, label 4 in the other; in the first, specks of 2 around one of 3; in both, a pore.
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 12; ++i)
        grid.labels.push_back(i == 3 && j == 6 && k == 6                                 ? 3
                              : std::abs(i - 3) + std::abs(j - 6) + std::abs(k - 6) <= 1 ? 2
                              : i < 6                                                    ? 1
                                                                                         : 4);
  for (const auto& [i, j, k] : {std::array{9, 9, 9}, std::array{2, 2, 2}})
    grid.labels[static_cast<std::size_t>(i + 12 * (j + 12 * k))] = 0;
  for (std::size_t i = 0; i < 30; ++i) grid.labels.push_back(0);  // another layer, with enough of labels 2 and 3
  grid.counts[2] = 15;
  grid.labels.resize(12 * 12 * 15, 2);
  for (std::size_t i = 0; i < 72; ++i) grid.labels[12 * 12 * 14 + i] = 3;
  const RegionSurface surface = surface_of_labels(grid, {0, 20, {}});
  REQUIRE(surface.regions.size() == 4);
  REQUIRE(surface.notes.size() == 1);
  CHECK_THAT(surface.notes[0], Catch::StartsWith("9 specks"));
  CHECK(surface.volumes[0] == Approx(6 * 12 * 12).epsilon(1e-3));
  CHECK(surface.volumes[3] == Approx(6 * 12 * 12).epsilon(1e-3));
}
