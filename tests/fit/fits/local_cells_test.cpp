// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/local_cells.h"

#include "tests/support/mesh_checks.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <span>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

TEST_CASE("Cells of faults are cut in 27, and sizes say so", "[local_cells]") {
  const VolumeMesh grid = test::lattice(5, 5, 5);
  const auto refined = refined_at_faults(grid, {}, std::vector<Fault>{{62}}, 1000);
  REQUIRE(refined);
  test::check_mesh_is(refined->mesh, 1, 125);
  // 27 parts of the cell in the middle, 22 at its faces, 11 at its edges, 4 at its corners; 98 cells stay whole.
  CHECK(refined->mesh.num_cells() == 27 + 6 * 22 + 12 * 11 + 8 * 4 + 98);
  REQUIRE(refined->sizes.size() == refined->mesh.num_cells());
  CHECK(std::ranges::count_if(refined->sizes, [](double s) { return s == Approx(1.0 / 3); }) == 27);
  CHECK(std::ranges::count(refined->sizes, 1) == 98);
  double volume = 0;  // a size is the length of a part: the parts of a cell fill it
  for (const double size : refined->sizes) volume += size * size * size;
  CHECK(volume == Approx(125));

  const std::size_t small = std::ranges::min_element(refined->sizes) - refined->sizes.begin();
  const auto twice =
      refined_at_faults(refined->mesh, refined->sizes, std::vector<Fault>{{static_cast<Index>(small)}}, 5000);
  REQUIRE(twice);
  CHECK(std::ranges::min(twice->sizes) < 0.2);
}

TEST_CASE("Faults that have no room are left out, the least important first", "[local_cells]") {
  const VolumeMesh grid = test::lattice(7, 3, 3);
  const std::vector<Fault> faults{{0}, {6}};
  const std::size_t of_both = refined_at_faults(grid, {}, faults, 10000)->mesh.num_cells();
  const std::size_t of_first = refined_at_faults(grid, {}, std::span(faults).first(1), 10000)->mesh.num_cells();
  CHECK(of_first < of_both);
  CHECK(refined_at_faults(grid, {}, faults, of_both - 1)->mesh.num_cells() == of_first);
  CHECK(!refined_at_faults(grid, {}, faults, of_first - 1));
  CHECK(!refined_at_faults(grid, {}, {}, 10000));
  CHECK(!refined_at_faults(grid, {}, std::vector<Fault>{{}, {}}, 10000));
}

TEST_CASE("Cells between small and large ones have caps", "[local_cells]") {
  const VolumeMesh grid = test::lattice(5, 5, 5);
  QualityCaps caps;
  add_caps_between_sizes(grid, {}, caps);
  CHECK(caps.edges.empty());
  CHECK(caps.vertices.empty());
  const auto refined = refined_at_faults(grid, {}, std::vector<Fault>{{62}}, 1000);
  REQUIRE(refined);
  add_caps_between_sizes(refined->mesh, refined->sizes, caps);
  std::vector<std::uint8_t> has_cap(refined->mesh.num_vertices(), 0);
  for (const VertexCap& cap : caps.vertices) has_cap[cap.vertex] = 1;
  for (std::size_t c = 0; c < refined->mesh.num_cells(); ++c) {
    const auto cell = refined->mesh.cell(c);
    const auto num_capped = std::ranges::count_if(cell, [&](Index v) { return has_cap[v] != 0; });
    const bool is_between = refined->sizes[c] < 0.99 && refined->sizes[c] > 0.34;
    if (is_between) CHECK(num_capped == 8);
    if (!is_between) CHECK(num_capped < 8);
  }
}

TEST_CASE("Cells of pads are as large as those behind them", "[local_cells]") {
  const VolumeMesh grid = test::lattice(3, 1, 1);
  CHECK(padded_sizes(grid, {}).empty());
  CHECK(padded_sizes(grid, std::vector<double>{0.5, 1}) == std::vector<double>{0.5, 1, 1});
  CHECK(padded_sizes(grid, std::vector<double>{1, 0.5}) == std::vector<double>{1, 0.5, 0.5});
}
