// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/subdivision_fit.h"
#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/fits/fit_level.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/subdivision/subdivision.h"
#include "subvol/surface/boundary.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"

#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// Mean distance of a mesh's boundary, or of a cage's limit surface, to the target, in percent of the diagonal.
double mesh_percent(const VolumeMesh& mesh, const TriangleMesh& target) {
  const TriangleMesh boundary = refined_triangles(boundary_surface(mesh, MeshTopology(mesh), nullptr));
  return 100 * surface_distance(boundary, target).mean() / bounding_box_diagonal(target);
}

double limit_percent(const VolumeMesh& cage, const TriangleMesh& target) {
  const BoundaryRefinement refinement = refine_boundary(cage, 4);
  TriangleMesh limit;
  limit.positions = refinement.positions.apply(cage.positions);
  for (const auto& q : refinement.quads) {
    limit.triangles.push_back({q[0], q[1], q[2]});
    limit.triangles.push_back({q[0], q[2], q[3]});
  }
  return 100 * surface_distance(limit, target).mean() / bounding_box_diagonal(target);
}

/// Options for fits whose schedule is looked at, without the quality stages that end other fits.
FitOptions quick(int levels = 2) {
  FitOptions options;
  options.levels = levels;
  options.quality = 0;
  return options;
}

}  // namespace

TEST_CASE("A fit reproduces the samples' surfaces with certified cells", "[slow]") {
  for (const samples::Sample& sample : samples::all_samples()) {
    CAPTURE(sample.name);
    const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, quick());
    CHECK(result.report.stop_reason == StopReason::converged);
    CHECK(certify(result.mesh).all_certified());
    // Two levels on a coarse template: the bumps are there to a tenth of what the template misses.
    CHECK(mesh_percent(result.mesh, sample.target) < 0.1 * result.report.initial_distance_mean_percent);
    CHECK(limit_percent(result.cage, sample.target) < 0.1 * result.report.initial_distance_mean_percent);
    CHECK(result.mesh.num_cells() == 64 * sample.template_mesh.num_cells());
    CHECK(result.cage.num_cells() == 8 * sample.template_mesh.num_cells());
    CHECK(result.cage.tags.creases.empty() == sample.template_mesh.tags.creases.empty());
  }
}

TEST_CASE("A cage-only fit keeps the template's cells", "[slow]") {
  const samples::Sample sample = samples::torus_sample();
  FitOptions options = quick();
  options.cage_only = true;
  const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  CHECK(result.cage.cell_vertices == sample.template_mesh.cell_vertices);
  CHECK(result.mesh.num_cells() == 64 * sample.template_mesh.num_cells());
  CHECK(certify(result.mesh).all_certified());
  CHECK(limit_percent(result.cage, sample.target) < 0.3 * result.report.initial_distance_mean_percent);
}

TEST_CASE("The written mesh is the cage subdivided, with its boundary at limit positions", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, quick());
  const SubdivisionLevel level = subdivide(result.cage);
  const std::vector<Vec3> expected = limit_map(level.fine).apply(level.fine.positions);
  REQUIRE(expected.size() == result.mesh.positions.size());
  for (std::size_t i = 0; i < expected.size(); ++i) CHECK((expected[i] - result.mesh.positions[i]).norm() < 1e-12);
}

TEST_CASE("A fit scales with its inputs, bit for bit where scaling is exact", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const FitResult plain = fit_subdivision_volume(sample.target, sample.template_mesh, quick(1));
  samples::Sample scaled = sample;
  for (Vec3& p : scaled.target.positions) p *= 1024;
  for (Vec3& p : scaled.template_mesh.positions) p *= 1024;
  const FitResult other = fit_subdivision_volume(scaled.target, scaled.template_mesh, quick(1));
  for (std::size_t i = 0; i < plain.cage.positions.size(); ++i)
    CHECK(other.cage.positions[i] == Vec3(1024 * plain.cage.positions[i]));
}

TEST_CASE("A fit far from the origin is as good as one at it", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const FitResult plain = fit_subdivision_volume(sample.target, sample.template_mesh, quick());
  samples::Sample moved = sample;
  for (auto* points : {&moved.target.positions, &moved.template_mesh.positions})
    for (Vec3& p : *points) p = 1e3 * p + Vec3(1e5, -2e5, 3e5);
  const FitResult other = fit_subdivision_volume(moved.target, moved.template_mesh, quick());
  // The ball is nearly symmetric: roundings of the coordinates choose among equally close points, and cells slide along
  // the surface by that. Distance and distortion do not change by more than the last steps of a stage change them.
  CHECK(mesh_percent(other.mesh, moved.target) == Approx(mesh_percent(plain.mesh, sample.target)).epsilon(0.1));
  const auto volume = [](const FitResult& fit) { return fit.report.stages[1].iterations.back().volume_energy; };
  CHECK(volume(other) == Approx(volume(plain)).epsilon(0.02));
}

TEST_CASE("A fit has the same bits with one and two threads", "[slow]") {
  const samples::Sample sample = samples::torus_sample();
  test::ThreadGuard guard;
  guard.use(1);
  const FitResult one = fit_subdivision_volume(sample.target, sample.template_mesh, quick());
  guard.use(2);
  const FitResult two = fit_subdivision_volume(sample.target, sample.template_mesh, quick());
  CHECK(one.cage.positions == two.cage.positions);
  CHECK(one.mesh.positions == two.mesh.positions);
}

TEST_CASE("The plain surface of the paper can be fitted instead of the limit surface", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  for (BoundaryRule rule : {BoundaryRule::catmull_clark, BoundaryRule::averaging}) {
    FitOptions options = quick();
    options.surface = FittedSurface::mesh;
    options.boundary = rule;
    const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
    CHECK(certify(result.mesh).all_certified());
    CHECK(mesh_percent(result.mesh, sample.target) < 0.1 * result.report.initial_distance_mean_percent);
    const SubdivisionLevel level = subdivide(result.cage, rule);
    double worst = 0;
    for (std::size_t i = 0; i < level.fine.positions.size(); ++i)
      worst = std::max(worst, (level.fine.positions[i] - result.mesh.positions[i]).norm());
    CHECK(worst < 1e-12);
  }
}

TEST_CASE("L-BFGS decreases the energy as well and ends with certified cells", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  FitOptions options = quick(1);
  options.solver = SolverKind::lbfgs;
  const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  CHECK(certify(result.mesh).all_certified());
  CHECK(mesh_percent(result.mesh, sample.target) < 0.5 * result.report.initial_distance_mean_percent);
}

TEST_CASE(
    "A fit whose boundary meets itself is tried again with stiffer cells, and kept as it was where that is no help") {
  // Two blocks on the same place: no weight takes them apart.
  const samples::Sample ball = samples::ball_sample();
  VolumeMesh twice = ball.template_mesh;
  const auto shift = static_cast<Index>(twice.num_vertices());
  for (const Vec3& x : ball.template_mesh.positions) twice.positions.push_back(x + Vec3(0.01, 0.02, 0.03));
  for (std::size_t c = 0; c < ball.template_mesh.num_cells(); ++c) {
    std::vector<Index> corners;
    for (Index v : ball.template_mesh.cell(c)) corners.push_back(v + shift);
    twice.add_cell(ball.template_mesh.kinds[c], corners);
  }
  FitOptions options = quick(1);
  options.tolerance_percent = 50;  // met at once: nothing else follows
  const FitResult result = fit_subdivision_volume(ball.target, twice, options);
  CHECK(result.report.stop_reason == StopReason::converged);
  CHECK(certify(result.mesh).all_certified());
  std::vector<StageRecord> stages = result.report.stages;
  // What follows is the end of every fit to a target with far more detail than the mesh.
  if (stages.back().name.ends_with("all of the target")) stages.pop_back();
  REQUIRE(stages.size() >= 2);
  CHECK(stages.back().lambda == Approx(4 * stages[stages.size() - 2].lambda));
  const auto kept = std::find_if(stages.rbegin(), stages.rend(), [](const StageRecord& stage) { return stage.kept; });
  CHECK((stages.back().kept || kept->lambda < stages.back().lambda));
}

TEST_CASE("Quality stages raise the least scaled Jacobian of a fit, the cage stays one, distances stay as they are",
          "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  FitOptions options = quick(1);
  const FitResult plain = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  options.quality = 0.6;
  const FitResult lifted = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  const QualityReport before = measure_quality(plain.mesh), after = measure_quality(lifted.mesh);
  CHECK(after.certificate.all_certified());
  CHECK(after.min_scaled_jacobian >= before.min_scaled_jacobian);
  CHECK(mesh_percent(lifted.mesh, sample.target) <= 1.05 * mesh_percent(plain.mesh, sample.target) + 1e-9);
  const std::vector<Vec3> refined = subdivide(lifted.cage).matrix.apply(lifted.cage.positions);
  CHECK(refined.size() == lifted.mesh.positions.size());
  options.quality = 0.9;
  CHECK_THROWS_AS(fit_subdivision_volume(sample.target, sample.template_mesh, options), InputError);
}

TEST_CASE("The cells of a coarse cage become good without the surface suffering", "[slow]") {
  const auto data = require_data();
  if (!data) return;
  const TriangleMesh target = read_triangle_mesh(*data / "fit/joint129/target.off");
  const VolumeMesh mesh = read_volume_mesh(*data / "fit/joint129/template.mesh");
  FitOptions options = quick(2);
  const FitResult plain = fit_subdivision_volume(target, mesh, options);
  options.quality = kUsualQuality;
  const FitResult lifted = fit_subdivision_volume(target, mesh, options);
  CHECK(measure_quality(plain.mesh).min_scaled_jacobian < 0.2);
  CHECK(measure_quality(lifted.mesh).min_scaled_jacobian > 0.5);
  CHECK(mesh_percent(lifted.mesh, target) <= 1.05 * mesh_percent(plain.mesh, target));
}

TEST_CASE("A tolerance that is met ends the fit, one out of reach is said to be missed", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  FitOptions options = quick();
  options.tolerance_percent = 0.5;
  const FitResult met = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  CHECK(met.report.stop_reason == StopReason::converged);
  CHECK(mesh_percent(met.mesh, sample.target) <= 0.5);
  options.levels = 1;
  options.tolerance_percent = 1e-6;
  const FitResult missed = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  CHECK(missed.report.stop_reason == StopReason::tolerance_missed);
  CHECK(certify(missed.mesh).all_certified());
}

TEST_CASE("A cancelled fit returns the best state so far") {
  const samples::Sample sample = samples::ball_sample();
  FitOptions options = quick();
  int calls = 0;
  options.control.progress = [&](const FitProgress& progress) {
    CHECK(progress.fraction >= 0);
    CHECK(progress.fraction <= 1);
    return ++calls < 3;
  };
  const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  CHECK(calls == 3);
  CHECK(result.report.stop_reason == StopReason::cancelled);
  CHECK(result.mesh.num_cells() == 8 * sample.template_mesh.num_cells());
  CHECK(certify(result.mesh).all_certified());
}

TEST_CASE("A time limit ends the fit with a result") {
  const samples::Sample sample = samples::ball_sample();
  FitOptions options = quick(3);
  options.control.time_limit_seconds = 1e-3;
  const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  CHECK(result.report.stop_reason == StopReason::time_limit);
  CHECK(certify(result.mesh).all_certified());
}

TEST_CASE("A fit says when the steps allowed were not enough, and when its start was inverted", "[slow]") {
  const samples::Sample sample = samples::torus_sample();
  FitOptions options = quick(1);
  options.control.max_iterations = 1;  // converged takes two
  const FitReport short_of_steps = fit_subdivision_volume(sample.target, sample.template_mesh, options).report;
  CHECK(short_of_steps.stop_reason == StopReason::iteration_limit);
  CHECK(short_of_steps.stages.back().ended == MinimizerStop::iteration_limit);
  CHECK(short_of_steps.explanation.find("all of the 1 steps allowed") != std::string::npos);
  options.tolerance_percent = 50;  // met all the same
  CHECK(fit_subdivision_volume(sample.target, sample.template_mesh, options).report.stop_reason ==
        StopReason::converged);
  const FitReport inverted =
      fit_subdivision_volume(samples::ball_sample().target, hex_inverted_inside(), quick(1)).report;
  CHECK(inverted.stop_reason == StopReason::stalled);
}

TEST_CASE("Sharp edges of the target stay sharp, whether an angle or the template's tags tell of them", "[slow]") {
  samples::Sample sample = samples::bracket_sample();
  FitOptions options = quick();
  SECTION("by angle, on a template without tags") {
    sample.template_mesh.tags = {};
    options.crease_angle_degrees = 40;
  }
  SECTION("by the template's tags") {}
  const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  CHECK(result.report.stop_reason == StopReason::converged);
  CHECK(certify(result.mesh).all_certified());
  REQUIRE(result.report.creases);
  CHECK(result.report.creases->followed_share() == 1);
  CHECK(result.report.creases->within_share() > 0.99);
  CHECK(result.report.creases->max_percent() < 0.15);
}

TEST_CASE("A target without sharp edges gets no crease by angle", "[slow]") {
  const samples::Sample sample = samples::torus_sample();
  FitOptions options = quick(1);
  options.crease_angle_degrees = 40;
  const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  CHECK(result.cage.tags.empty());
  CHECK_FALSE(result.report.creases);
}

TEST_CASE("A fit refuses options out of range, empty targets and unusable templates") {
  const samples::Sample sample = samples::ball_sample();
  const auto refused = [&](const FitOptions& options) {
    CHECK_THROWS_AS(fit_subdivision_volume(sample.target, sample.template_mesh, options), InputError);
  };
  FitOptions options;
  options.levels = 0;
  refused(options);
  options = {};
  options.lambda_close = 0;
  refused(options);
  options = {};
  options.lambda_far = std::nan("");
  refused(options);
  options = {};
  options.tolerance_percent = -1;
  refused(options);
  CHECK_THROWS_AS(fit_subdivision_volume(TriangleMesh{}, sample.template_mesh, {}), InputError);
  CHECK_THROWS_AS(fit_subdivision_volume(sample.target, VolumeMesh{}, {}), InputError);
  VolumeMesh inverted = sample.template_mesh;
  for (Vec3& p : inverted.positions) p[0] = -p[0];
  CHECK_THROWS_AS(fit_subdivision_volume(sample.target, inverted, {}), InputError);
}

// Findings of the fuzzer: a fit of a tiny template could not begin, lost its cells in rounding, and said that it had
// converged; to points of a template too far away nothing was closest.
TEST_CASE("A template that is next to nothing beside its target, or far beyond it, is refused by every fit") {
  const samples::Sample sample = samples::ball_sample();
  VolumeMesh scaled = sample.template_mesh;
  for (const double size : {1e-8, 1e-20, 1e8, 1e100}) {
    for (std::size_t v = 0; v < scaled.num_vertices(); ++v)
      scaled.positions[v] = size * sample.template_mesh.positions[v];
    CHECK_THROWS_WITH(fit_subdivision_volume(sample.target, scaled, quick()),
                      Catch::Contains("times as large as the target"));
    CHECK_THROWS_AS(fit_high_order(sample.target, scaled, {.order = 2}), InputError);
    CHECK_THROWS_AS(optimize_mesh(scaled, &sample.target, {}), InputError);
  }
  VolumeMesh far = sample.template_mesh;
  for (Vec3& p : far.positions) p[0] += 1e9;
  CHECK_THROWS_WITH(fit_subdivision_volume(sample.target, far, quick()),
                    Catch::Contains("times the target's diagonal away"));
  for (std::size_t v = 0; v < scaled.num_vertices(); ++v)
    scaled.positions[v] = 1e-20 * sample.template_mesh.positions[v];
  scaled.positions.push_back(Vec3(1, 0, 0));  // of no cell: it makes none larger
  CHECK_THROWS_AS(fit_subdivision_volume(sample.target, scaled, quick()), InputError);
  CHECK_THROWS_AS(fit_high_order(sample.target, scaled, {.order = 2}), InputError);
  CHECK_THROWS_AS(optimize_mesh(scaled, &sample.target, {}), InputError);
}

TEST_CASE("Ideal boxes fill the volume asked for and have the cells' own proportions") {
  const SubdivisionLevel level = subdivide(mixed_cells());
  const std::vector<Vec3> nodes = linear_split(mixed_cells()).apply(mixed_cells().positions);
  for (double own : {0.0, 0.5, 1.0}) {
    double total = 0;
    for (const Vec3& h : ideal_boxes(level.fine, nodes, 3.0, own)) total += h.prod();
    CHECK(total == Approx(3).epsilon(1e-12));
  }
  const VolumeMesh cube = lattice(1, 1, 1);
  std::vector<Vec3> stretched = cube.positions;
  for (Vec3& p : stretched) p = p.cwiseProduct(Vec3(4, 1, 2));
  CHECK((ideal_boxes(cube, stretched, 1.0, 1)[0] - Vec3(2, 0.5, 1)).norm() < 1e-14);
  CHECK((ideal_boxes(cube, stretched, 1.0, 0)[0] - Vec3::Ones()).norm() < 1e-14);
  CHECK(ideal_boxes(cube, std::vector<Vec3>(8, Vec3::Zero()), 1.0, 1)[0].allFinite());
}

TEST_CASE("Real cases fit with certified cells", "[data][slow]") {
  const auto data = require_data();
  if (!data) return;
  for (const char* name : {"doubletorus17", "mixed_fandisk"}) {
    CAPTURE(name);
    const TriangleMesh target = read_triangle_mesh(*data / "fit" / name / "target.off");
    const VolumeMesh template_mesh = read_volume_mesh(*data / "fit" / name / "template.mesh");
    const FitResult result = fit_subdivision_volume(target, template_mesh, quick());
    CHECK(result.report.stop_reason == StopReason::converged);
    CHECK(certify(result.mesh).all_certified());
    CHECK(mesh_percent(result.mesh, target) < 0.12);
  }
}

TEST_CASE("Sharp edges of real cases stay sharp", "[data][slow]") {
  const auto data = require_data();
  if (!data) return;
  // Both gave up corners and edges of thin parts when only the template's angles told of creases.
  for (const char* name : {"cad_fandisk49", "joint129"}) {
    CAPTURE(name);
    const TriangleMesh target = read_triangle_mesh(*data / "fit" / name / "target.off");
    const VolumeMesh template_mesh = read_volume_mesh(*data / "fit" / name / "template.mesh");
    FitOptions options = quick();
    options.crease_angle_degrees = 40;
    const FitResult result = fit_subdivision_volume(target, template_mesh, options);
    CHECK(result.report.stop_reason == StopReason::converged);
    CHECK(check_mesh(result.mesh).valid());
    REQUIRE(result.report.creases);
    CHECK(result.report.creases->followed_share() > 0.98);
    CHECK(result.report.creases->mean_percent() < 0.05);
    CHECK(result.report.creases->max_percent() < 0.5);
    CHECK(mesh_percent(result.mesh, target) < 0.1);
  }
}
