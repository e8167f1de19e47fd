// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/high_order_fit.h"
#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/features.h"
#include "subvol/templates/auto_template.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/feature_fixtures.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

HighOrderFitOptions of_order(int order) {
  HighOrderFitOptions options;
  options.order = order;
  return options;
}

SurfaceDistance distance(const HighOrderMesh& mesh, const TriangleMesh& target) {
  const BoundarySamples samples = make_boundary_samples(mesh.space, 16);
  const TriangleMesh surface{samples.positions.apply(mesh.coefficients), samples.triangles};
  return surface_distance(surface, target);
}

double percent(const HighOrderMesh& mesh, const TriangleMesh& target) {
  return 100 * distance(mesh, target).mean() / bounding_box_diagonal(target);
}

/// Whether every determinant at n points a direction is positive.
bool positive(const HighOrderMesh& mesh, int n) {
  const HighOrderEnergy dense(mesh.space, std::vector(mesh.space.num_cells(), Vec3(1, 1, 1)),
                              std::vector(mesh.space.num_cells(), n));
  return std::isfinite(dense.value(mesh.coefficients));
}

}  // namespace

TEST_CASE("curved elements reproduce the samples' surfaces, closer with every order, in both bases", "[slow]") {
  for (const samples::Sample& sample : samples::all_samples())
    for (Basis basis : kBothBases) {
      CAPTURE(sample.name, to_string(basis));
      double first = 0, before = 100;
      for (int order : {1, 2, 4}) {
        HighOrderFitOptions options = of_order(order);
        options.basis = basis;
        const HighOrderFitResult result = fit_high_order(sample.target, sample.template_mesh, options);
        CHECK(result.report.stop_reason == StopReason::converged);
        CHECK(result.mesh.space.max_order() == order);
        CHECK(positive(result.mesh, 9));
        const double distance = percent(result.mesh, sample.target);
        CHECK(distance < before);
        if (order == 1) first = distance;
        before = distance;
      }
      CHECK(before < 0.2 * first);
    }
}

TEST_CASE("a high-order fit lowers lambda until the tolerance is met, or says that it is not", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const double plain = percent(fit_high_order(sample.target, sample.template_mesh, of_order(4)).mesh, sample.target);
  HighOrderFitOptions options = of_order(4);
  options.tolerance_percent = 0.9 * plain;
  const HighOrderFitResult met = fit_high_order(sample.target, sample.template_mesh, options);
  CHECK(met.report.stop_reason == StopReason::converged);
  CHECK(percent(met.mesh, sample.target) < plain);
  options.tolerance_percent = 1e-6;
  CHECK(fit_high_order(sample.target, sample.template_mesh, options).report.stop_reason ==
        StopReason::tolerance_missed);
}

TEST_CASE("a high-order fit says when the steps allowed were not enough, and when its start was inverted", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  HighOrderFitOptions options = of_order(2);
  options.control.max_iterations = 1;
  options.improve_worst_places = false;
  CHECK(fit_high_order(sample.target, sample.template_mesh, options).report.stop_reason == StopReason::iteration_limit);
  const FitReport inverted = fit_high_order(sample.target, hex_inverted_inside(), of_order(2)).report;
  CHECK(inverted.stop_reason == StopReason::stalled);
  CHECK(inverted.stages.back().ended == MinimizerStop::infeasible_start);
}

TEST_CASE("an adaptive fit raises orders where the target has its detail, and meets the tolerance with fewer nodes",
          "[slow]") {
  const VolumeMesh bar = lattice(4, 1, 1);
  HighOrderMesh wanted(ElementSpace(bar, Basis::fourier, 6), bar);
  const MeshTopology& topology = wanted.space.topology();
  for (std::size_t e = 0; e < topology.num_edges(); ++e) {  // waves on the last cell's edges across the bar
    const auto [a, b] = topology.edge(static_cast<Index>(e));
    if (bar.positions[a].x() < 3.5 || bar.positions[b].x() < 3.5) continue;
    wanted.coefficients[wanted.space.edge_nodes(e) + 3] = Vec3(0.8, 0, 0);
  }
  const BoundarySamples samples = make_boundary_samples(wanted.space, 24);
  const TriangleMesh target{samples.positions.apply(wanted.coefficients), samples.triangles};
  HighOrderFitOptions options = of_order(6);
  options.adaptive = true;
  options.tolerance_percent = 0.01;
  const HighOrderFitResult result = fit_high_order(target, bar, options);
  CHECK(result.report.stop_reason == StopReason::converged);
  CHECK(percent(result.mesh, target) < 0.011);
  CHECK(positive(result.mesh, 13));
  CHECK(result.mesh.space.num_nodes() < wanted.space.num_nodes() / 2);
  int first = 0, last = 0;
  for (std::size_t e = 0; e < topology.num_edges(); ++e) {
    const auto [a, b] = topology.edge(static_cast<Index>(e));
    const double x = bar.positions[a].x() + bar.positions[b].x();
    const int order = result.mesh.space.orders().edges[e];
    if (x < 0.5) first = std::max(first, order);
    if (x > 7.5) last = std::max(last, order);
  }
  CHECK(first == 2);
  CHECK(last > 4);
}

TEST_CASE("the worst places of a fit are lifted where that costs little distance", "[slow]") {
  // Cells of a grid have two faces on the torus, and are flat where these meet.
  const samples::Sample torus = samples::torus_sample();
  const AutoTemplateResult made = auto_templates(torus.target, {.cells = 40});
  REQUIRE(!made.templates.empty());
  const HighOrderFitResult result = fit_high_order(torus.target, made.templates.front().mesh, of_order(2));
  const auto is_lift = [](const StageRecord& stage) { return stage.name.find("poor shape") != std::string::npos; };
  const auto& stages = result.report.stages;
  const auto first = std::find_if(stages.begin(), stages.end(), is_lift);
  REQUIRE(first != stages.end());
  CHECK(first->kept);
  CHECK(std::all_of(first, stages.end(), is_lift));
  double reached = 0;
  for (auto stage = first; stage != stages.end(); ++stage)
    if (stage->kept) reached = stage->mean_distance_percent;
  CHECK(reached <= 1.2 * std::prev(first)->mean_distance_percent);
  HighOrderFitOptions without = of_order(2);
  without.improve_worst_places = false;
  const HighOrderFitResult plain = fit_high_order(torus.target, made.templates.front().mesh, without);
  CHECK(std::none_of(plain.report.stages.begin(), plain.report.stages.end(), is_lift));
  CHECK(measure_quality(result.mesh).min_scaled_jacobian > 1.05 * measure_quality(plain.mesh).min_scaled_jacobian);
  CHECK(positive(result.mesh, 9));
}

TEST_CASE("few places far from the target are drawn in where that costs little shape", "[slow]") {
  const auto is_kept_draw = [](const StageRecord& stage) { return stage.kept && stage.name.ends_with("% off"); };
  std::size_t drawn = 0;
  for (samples::Sample& sample : samples::all_samples()) {
    sample.template_mesh.tags = {};  // creases would keep the surface near
    HighOrderFitOptions without = of_order(2);
    without.improve_worst_places = false;
    const HighOrderFitResult plain = fit_high_order(sample.target, sample.template_mesh, without);
    const HighOrderFitResult result = fit_high_order(sample.target, sample.template_mesh, of_order(2));
    CAPTURE(sample.name);
    CHECK(std::none_of(plain.report.stages.begin(), plain.report.stages.end(), is_kept_draw));
    const SurfaceDistance before = distance(plain.mesh, sample.target), after = distance(result.mesh, sample.target);
    CHECK(after.max() <= 1.2 * before.max());
    CHECK(after.mean() <= 1.2 * before.mean());
    const auto& stages = result.report.stages;
    if (std::none_of(stages.begin(), stages.end(), is_kept_draw)) continue;
    ++drawn;
    CHECK(after.max() < before.max());
    CHECK(positive(result.mesh, 9));
  }
  CHECK(drawn > 0);
}

TEST_CASE("curved elements keep sharp edges if they are asked to, or if the template has creases", "[slow]") {
  const auto barrel = [](Vec3 p) {
    p.head<2>() *= 1 + 0.2 * (1 - p.z() * p.z());
    return p;
  };
  TriangleMesh target = cube_surface(16, false);
  for (Vec3& p : target.positions) p = barrel(p);
  VolumeMesh cells = centered_lattice(2);
  for (Vec3& p : cells.positions) p *= 0.93;

  const HighOrderFitResult round = fit_high_order(target, cells, of_order(2));
  CHECK_FALSE(round.report.creases);
  CHECK(round.lambda_close == kLambdaOfOrders);

  HighOrderFitOptions options = of_order(2);
  options.crease_angle_degrees = 40;
  const HighOrderFitResult sharp = fit_high_order(target, cells, options);
  REQUIRE(sharp.report.creases);
  CHECK(sharp.report.creases->num_followed == 12);
  CHECK(sharp.report.creases->max_percent() < 0.1);
  CHECK(sharp.lambda_close == kCurvingLambda);
  CHECK(distance(sharp.mesh, target).max() < 0.5 * distance(round.mesh, target).max());
  CHECK(measure_quality(sharp.mesh).min_scaled_jacobian > 0.65);

  options.follows_all_edges = false;  // the edges are those of a designed part
  CHECK(fit_high_order(target, cells, options).mesh.coefficients == sharp.mesh.coefficients);
  cells.tags = features_by_angle(cells, 40);
  CHECK(fit_high_order(target, cells, of_order(2)).report.creases->num_followed == 12);
  CHECK_THROWS_AS(fit_high_order(PointCloud{target.positions}, cells, options), InputError);
}

TEST_CASE("a high-order fit has the same bits for one and two threads", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  test::ThreadGuard guard;
  std::vector<std::vector<Vec3>> results;
  for (int n : {1, 2}) {
    guard.use(n);
    results.push_back(fit_high_order(sample.target, sample.template_mesh, of_order(2)).mesh.coefficients);
  }
  CHECK(results[0] == results[1]);
}

TEST_CASE("a high-order fit scales with its inputs, bit for bit where scaling is exact", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  samples::Sample scaled = sample;
  for (auto* points : {&scaled.target.positions, &scaled.template_mesh.positions})
    for (Vec3& p : *points) p *= 1024;
  const auto plain = fit_high_order(sample.target, sample.template_mesh, of_order(2));
  const auto other = fit_high_order(scaled.target, scaled.template_mesh, of_order(2));
  for (std::size_t i = 0; i < plain.mesh.coefficients.size(); ++i)
    CHECK(other.mesh.coefficients[i] == Vec3(1024 * plain.mesh.coefficients[i]));
}

TEST_CASE("a high-order fit that is cancelled returns what it has") {
  const samples::Sample sample = samples::ball_sample();
  HighOrderFitOptions options = of_order(4);
  int told = 0;
  options.control.progress = [&](const FitProgress& progress) {
    CHECK((progress.fraction >= 0 && progress.fraction <= 1));
    return ++told < 5;
  };
  const HighOrderFitResult result = fit_high_order(sample.target, sample.template_mesh, options);
  CHECK(result.report.stop_reason == StopReason::cancelled);
  CHECK(told == 5);
  CHECK(positive(result.mesh, 5));
}

TEST_CASE("a high-order fit at its time limit keeps no boundary that intersects itself", "[slow]") {
  const auto data = require_data();
  if (!data) return;
  const TriangleMesh target = read_triangle_mesh(*data / "fit" / "far_asm122" / "target.off");
  HighOrderFitOptions options = of_order(4);
  options.control.time_limit_seconds = 12;  // at order 4, its boundary is folded then
  const HighOrderFitResult result =
      fit_high_order(target, read_volume_mesh(*data / "fit" / "far_asm122" / "template.mesh"), options);
  CHECK(result.report.stop_reason == StopReason::time_limit);
  const BoundarySamples samples = make_boundary_samples(result.mesh.space, 16);
  CHECK(self_intersections({samples.positions.apply(result.mesh.coefficients), samples.triangles}).pairs.empty());
}

TEST_CASE("a high-order fit refuses what it cannot do") {
  const samples::Sample sample = samples::ball_sample();
  for (int order : {0, 17, -1})
    CHECK_THROWS_AS(fit_high_order(sample.target, sample.template_mesh, of_order(order)), InputError);
  CHECK_THROWS_AS(fit_high_order(TriangleMesh{}, sample.template_mesh, of_order(2)), InputError);
  CHECK_THROWS_AS(fit_high_order(sample.target, {}, of_order(2)), InputError);
  HighOrderFitOptions options = of_order(2);
  options.tolerance_percent = -1;
  CHECK_THROWS_AS(fit_high_order(sample.target, sample.template_mesh, options), InputError);
}

TEST_CASE("real templates of prisms and tets are fitted with curved elements", "[slow]") {
  const auto data = require_data();
  if (!data) return;
  for (const char* name : {"mixed_prismlayer_bone", "tet_hand"}) {
    CAPTURE(name);
    const TriangleMesh target = read_triangle_mesh(*data / "fit" / name / "target.off");
    const VolumeMesh template_mesh = read_volume_mesh(*data / "fit" / name / "template.mesh");
    const HighOrderFitResult result = fit_high_order(target, template_mesh, of_order(2));
    CHECK(result.report.stop_reason == StopReason::converged);
    CHECK(positive(result.mesh, 5));
    CHECK(percent(result.mesh, target) < 0.25 * result.report.initial_distance_mean_percent);
  }
}
