// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/animation.h"

#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "subvol/export/gltf_writer.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/subdivision/subdivision.h"
#include "tests/support/gltf_validator.h"
#include "tests/support/temporary_folder.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <set>

using namespace subvol;
using namespace subvol::test;

namespace {

const samples::Sample& ball() {
  static const samples::Sample sample = samples::ball_sample();
  return sample;
}

FitResult short_fit(bool keep_states) {
  return fit_subdivision_volume(ball().target, ball().template_mesh,
                                {.levels = 2, .control = {.max_iterations = 3}, .keep_states = keep_states});
}

/// Largest distance of positions from the unit sphere's neighborhood, as a share.
double roughness(const std::vector<Vec3>& positions) {
  double largest = 0;
  for (const Vec3& p : positions) largest = std::max(largest, std::abs(p.norm() - 1));
  return largest;
}

}  // namespace

TEST_CASE("a fit keeps its states by the numbers of the last cage, if asked to", "[animation][slow]") {
  const FitResult fit = short_fit(true);
  REQUIRE(fit.states.size() >= 2);
  CHECK(fit.states[0].name == "template");
  for (const FitState& state : fit.states) REQUIRE(state.positions.size() == fit.cage.positions.size());
  // The template's own refinement: its vertices come first and have moved by S alone.
  const SubdivisionLevel level = subdivide(ball().template_mesh);
  REQUIRE(level.fine.num_vertices() == fit.cage.num_vertices());
  for (std::size_t v = 0; v < level.fine.num_vertices(); ++v)
    CHECK((fit.states[0].positions[v] - level.fine.positions[v]).norm() < 1e-12);
  std::set<std::string> names;
  for (const FitState& state : fit.states) names.insert(state.name);
  CHECK(names.size() == fit.states.size());
  const FitResult without = short_fit(false);
  CHECK(without.states.empty());
  CHECK(without.cage.positions == fit.cage.positions);
}

TEST_CASE("the animation of a fit goes from the template's limit surface to the fitted one", "[animation][slow]") {
  const TemporaryFolder folder;
  const FitResult fit = short_fit(true);
  const Scene scene = animation_scene(fit.cage, fit.states, {.name = "ball"});
  REQUIRE(scene.nodes.size() == 1);
  CHECK(scene.nodes[0].shapes.size() == fit.states.size());
  const SceneShape& first = scene.nodes[0].shapes[0];
  CHECK(first.name == "template");
  CHECK(first.positions.size() == scene.nodes[0].primitive.positions.size());
  CHECK(roughness(first.positions) != roughness(scene.nodes[0].primitive.positions));
  VolumeMesh start = fit.cage;
  start.positions = fit.states[0].positions;
  // Every vertex of the first shape is one of the start's limit surface.
  const BoundaryRefinement limit = refine_boundary(start, 4);
  const std::vector<Vec3> points = limit.positions.apply(start.positions);
  for (std::size_t i = 0; i < first.positions.size(); i += 37) {
    double nearest = 1;
    for (const Vec3& p : points) nearest = std::min(nearest, (p - first.positions[i]).norm());
    CHECK(nearest < 1e-12);
  }
  write_gltf(folder / "ball.glb", scene);
  check_with_validator({folder / "ball.glb"});
}

TEST_CASE("a fit of curved cells is animated as well", "[animation][slow]") {
  const TemporaryFolder folder;
  const HighOrderFitResult fit = fit_high_order(ball().target, ball().template_mesh,
                                                {.order = 3, .control = {.max_iterations = 3}, .keep_states = true});
  REQUIRE(fit.states.size() >= 2);
  CHECK(fit.states[0].name == "template");
  for (const FitState& state : fit.states) REQUIRE(state.positions.size() == fit.mesh.coefficients.size());
  for (std::size_t v = 0; v < ball().template_mesh.num_vertices(); ++v)
    CHECK((fit.states[0].positions[v] - ball().template_mesh.positions[v]).norm() < 1e-12);
  const Scene scene = animation_scene(fit.mesh, fit.states);
  write_gltf(folder / "ball.glb", scene);
  check_with_validator({folder / "ball.glb"});
}

TEST_CASE("states of another mesh are refused", "[animation]") {
  const std::vector<FitState> states{{"odd", {Vec3::Zero()}}};
  CHECK_THROWS_AS(animation_scene(ball().template_mesh, states), InputError);
}
