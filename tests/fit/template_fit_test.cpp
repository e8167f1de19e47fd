// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/template_fit.h"

#include "subvol/base/error.h"
#include "subvol/export/export.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/subdivision_fit.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

using namespace subvol;

TEST_CASE("A template made from a surface has few, well shaped cells", "[templates][slow]") {
  const TriangleMesh ball = test::cube_surface(12, true);
  const AutomaticFitResult made = fit_template(ball);
  const MeshCheck check = check_mesh(made.mesh, &ball, {});
  CHECK(check.valid());
  CHECK(check.quality->min_scaled_jacobian > 0.6);
  CHECK(made.mesh.num_cells() <= kTemplateCells.front());
  CHECK(check.max_distance_percent() < kTemplateMaxPercent);
  CHECK(fit_template(ball, {.cells = 100}).mesh.num_cells() <= 100);
}

TEST_CASE("The template of a part follows its edges, and so do the fits that start from it", "[templates][slow]") {
  const TriangleMesh cube = test::cube_surface(6, false);
  const AutomaticFitResult made = fit_template(cube);
  CHECK(made.trials[made.chosen].followed_curves == 12);
  CHECK_FALSE(made.mesh.tags.creases.empty());
  FitOptions options;
  options.levels = 1;
  const FitResult fit = fit_subdivision_volume(cube, made.mesh, options);
  CHECK(check_mesh(fit.mesh, &cube, {}).max_distance_percent() < 0.01);
  HighOrderFitOptions curved;
  curved.order = 2;
  const HighOrderFitResult high = fit_high_order(cube, made.mesh, curved);
  CHECK(check_mesh(high.mesh, curved_boundary(high.mesh, 0.05), &cube).max_distance_percent() < 0.01);
}

TEST_CASE("A template that is not finished has no cells", "[templates]") {
  AutomaticFitOptions options;
  options.control.progress = [](const FitProgress&) { return false; };
  CHECK(fit_template(test::cube_surface(4, true), options).mesh.num_cells() == 0);
  options.control.progress = {};
  options.control.time_limit_seconds = -1;
  CHECK_THROWS_AS(fit_template(test::cube_surface(4, true), options), InputError);
}
