// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/repeated_subdivision.h"
#include "subvol/base/error.h"
#include "subvol/fit/quality/region_quality.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

namespace subvol::test {

using namespace internal;

TEST_CASE("several refinements are one after the other, and so is their matrix", "[subdivision]") {
  const VolumeMesh control = l_shape(2);
  SparseMap matrix;
  for (const BoundaryRule rule : {BoundaryRule::catmull_clark, BoundaryRule::averaging}) {
    const VolumeMesh fine = subdivide_repeatedly(control, 2, rule, &matrix);
    CHECK(fine.positions == subdivide(subdivide(control, rule).fine, rule).fine.positions);
    const std::vector<Vec3> mapped = matrix.apply(control.positions);
    REQUIRE(mapped.size() == fine.num_vertices());
    for (std::size_t v = 0; v < mapped.size(); ++v) CHECK((mapped[v] - fine.positions[v]).norm() < 1e-13);
  }
  CHECK(subdivide_repeatedly(control, 0, BoundaryRule::catmull_clark, &matrix).positions == control.positions);
  CHECK(matrix.apply(control.positions) == control.positions);
}

TEST_CASE("cells that are only split stay where they are", "[subdivision]") {
  const VolumeMesh control = mixed_cells();
  SparseMap matrix;
  const VolumeMesh fine = split_repeatedly(control, 2, &matrix);
  CHECK(fine.cell_vertices == subdivide_repeatedly(control, 2).cell_vertices);
  const std::vector<Vec3> mapped = matrix.apply(control.positions);
  for (std::size_t v = 0; v < mapped.size(); ++v) CHECK((mapped[v] - fine.positions[v]).norm() < 1e-13);
  for (std::size_t v = 0; v < control.num_vertices(); ++v) CHECK(fine.positions[v] == control.positions[v]);
  const RegionReport before = measure_regions(control, nullptr), after = measure_regions(fine, nullptr);
  REQUIRE(before.regions.size() == after.regions.size());
  for (std::size_t r = 0; r < before.regions.size(); ++r)
    CHECK(after.regions[r].volume == Approx(before.regions[r].volume).epsilon(1e-12));
}

TEST_CASE("levels that make no sense or too many cells are refused", "[subdivision]") {
  for (const int levels : {-1, 9})
    CHECK_THROWS_WITH(subdivide_repeatedly(lattice(1, 1, 1), levels), Catch::Contains("levels must be in [0, 8]"));
  CHECK_THROWS_WITH(subdivide_repeatedly(lattice(8, 8, 8), 8), Catch::Contains("can be numbered"));
}

}  // namespace subvol::test
