// SPDX-License-Identifier: GPL-3.0-or-later
// Runs that go on from what an earlier one has solved; the files that hold it.

#include "subvol/fit/stages/checkpoint.h"
#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "subvol/base/fingerprint.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/surface/boundary.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <cstring>

using namespace subvol;
using namespace subvol::internal;

namespace {

bool same_bits(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec3)) == 0;
}

/// The log after its first n stages, by way of a file's bytes.
StageLog reloaded(const StageLog& log, std::size_t n) {
  const std::vector<SolvedStage> first(log.stages().begin(), log.stages().begin() + static_cast<std::ptrdiff_t>(n));
  return {parse_checkpoint(checkpoint_bytes({}, first), "file").stages, "file"};
}

/// What a report says but for the time it took.
std::string told(const FitReport& report) {
  std::string text = std::string(to_string(report.stop_reason)) + report.explanation;
  for (const StageRecord& stage : report.stages) {
    Fingerprint figures;
    for (const IterationRecord& step : stage.iterations)
      figures.add(step.surface_energy).add(step.volume_energy).add(step.step_length).add(step.evaluations);
    text += stage.name + stage.stop + (stage.kept ? "k" : "u") + figures.add(stage.mean_distance_percent).text();
  }
  return text;
}

/// Runs once from the start, then from several of its checkpoints: run(log) returns positions and report.
template <class Run>
void check_that_it_resumes(const Run& run) {
  StageLog whole;
  const auto [wanted, report] = run(&whole);
  CHECK(same_bits(wanted, run(nullptr).first));
  const std::size_t n = whole.stages().size();
  REQUIRE(n > 1);
  for (const std::size_t done : {n / 2, n - 1, n}) {
    CAPTURE(done, n);
    StageLog log = reloaded(whole, done);
    const auto [positions, told_again] = run(&log);
    CHECK(same_bits(positions, wanted));
    CHECK(told(told_again) == told(report));
    CHECK(log.num_recalled() == done);
    CHECK(log.stages().size() == n);
  }
}

SolvedStage small_stage() {
  return {"level 1, lambda 0.5",
          77,
          {Vec3(1, 2, 3), Vec3(0.1, -0.2, 1e-300)},
          {MinimizerStop::no_step,
           "no step",
           {{1.5, 0.25, 1, 12, 3}},
           {{4, 5}, {}, {4}},
           {Vec3(1, 2, 4), Vec3(0, 0, 7)},
           1},
          0.5};
}

}  // namespace

TEST_CASE("A fit that goes on from a checkpoint ends at the same bits", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  for (const bool cage_only : {false, true})
    check_that_it_resumes([&](StageLog* log) {
      FitOptions options{.levels = 2, .cage_only = cage_only, .control = {.max_iterations = 2}};
      options.control.log = log;
      const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
      std::vector<Vec3> all = result.mesh.positions;
      all.insert(all.end(), result.cage.positions.begin(), result.cage.positions.end());
      return std::pair(all, result.report);
    });
}

TEST_CASE("A fit that was stopped within a minimization ends at the same bits", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  const auto run = [&](StageLog* log) {
    FitOptions options{.levels = 2};
    options.control.log = log;
    return fit_subdivision_volume(sample.target, sample.template_mesh, options);
  };
  // This holds the checkpoint of each moment at which a minimization was not over.
  std::vector<std::vector<SolvedStage>> moments;
  StageLog whole;
  whole.on_add = [&] {
    if (!whole.stages().back().is_over()) moments.push_back(whole.stages());
  };
  const FitResult wanted = run(&whole);
  CHECK(same_bits(wanted.mesh.positions, run(nullptr).mesh.positions));
  REQUIRE(moments.size() >= 3);
  for (const std::size_t m : {std::size_t{0}, moments.size() / 2, moments.size() - 1}) {
    CAPTURE(m, moments[m].back().name, moments[m].back().result.iterations.size());
    StageLog log(parse_checkpoint(checkpoint_bytes({}, moments[m]), "file").stages, "file");
    const FitResult result = run(&log);
    CHECK(same_bits(result.mesh.positions, wanted.mesh.positions));
    CHECK(told(result.report) == told(wanted.report));
    CHECK(log.stages().size() == whole.stages().size());
  }
}

TEST_CASE("A minimization that was stopped after cells were densified ends at the same bits", "[slow]") {
  const samples::Sample sample = samples::torus_sample();
  const auto run = [&](StageLog* log) {
    HighOrderFitOptions options{
        .order = 2, .basis = Basis::fourier, .tolerance_percent = 0.01, .control = {.max_iterations = 12}};
    options.control.log = log;
    return fit_high_order(sample.target, sample.template_mesh, options);
  };
  std::vector<SolvedStage> moment;
  StageLog whole;
  whole.on_add = [&] {
    const SolvedStage& last = whole.stages().back();
    if (!last.is_over() && !last.result.densified.empty()) moment = whole.stages();
  };
  const HighOrderFitResult wanted = run(&whole);
  REQUIRE(!moment.empty());
  StageLog log(moment, "memory");
  const HighOrderFitResult result = run(&log);
  CHECK(same_bits(result.mesh.coefficients, wanted.mesh.coefficients));
  CHECK(told(result.report) == told(wanted.report));

  moment.back().result.densified[0].push_back(1 << 20);
  StageLog wrong(moment, "memory");
  CHECK_THROWS_WITH(run(&wrong), Catch::Contains("there is no cell 1048576"));
}

TEST_CASE("A fit with stages that were undone, and with one thread or two, goes on the same way", "[slow]") {
  const samples::Sample sample = samples::bracket_sample();
  FitOptions options{.levels = 2, .tolerance_percent = 1e-3, .control = {.max_iterations = 2}};
  StageLog whole;
  options.control.log = &whole;
  test::ThreadGuard guard;
  guard.use(1);
  const FitResult wanted = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  guard.use(2);
  StageLog log = reloaded(whole, whole.stages().size() - 2);
  options.control.log = &log;
  const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
  CHECK(same_bits(result.mesh.positions, wanted.mesh.positions));
  CHECK(told(result.report) == told(wanted.report));
}

TEST_CASE("A fit of curved elements that goes on from a checkpoint ends at the same bits", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  for (const bool adaptive : {false, true})
    check_that_it_resumes([&](StageLog* log) {
      HighOrderFitOptions options{
          .order = 2, .adaptive = adaptive, .tolerance_percent = 0.5, .control = {.max_iterations = 2}};
      options.control.log = log;
      HighOrderFitResult result = fit_high_order(sample.target, sample.template_mesh, options);
      return std::pair(result.mesh.coefficients, result.report);
    });
}

TEST_CASE("An optimization that goes on from a checkpoint ends at the same bits", "[slow]") {
  VolumeMesh mesh = test::lattice(4, 4, 4);
  const MeshTopology topology(mesh);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (!topology.is_boundary_vertex(static_cast<Index>(v)))
      mesh.positions[v] = Vec3(2, 2, 2) + 0.3 * (Vec3(2, 2, 2) - mesh.positions[v]);
  REQUIRE(test::count_inverted(mesh) > 0);
  check_that_it_resumes([&](StageLog* log) {
    OptimizeOptions options;
    options.control.log = log;
    const OptimizeResult result = optimize_mesh(mesh, nullptr, options);
    return std::pair(result.mesh.positions, result.report);
  });
}

TEST_CASE("An optimization whose boundary is far from its target goes on to the same bits", "[slow]") {
  // Beyond the edges of a convex boundary two triangles are equally far.
  const VolumeMesh mesh = test::lattice(3, 3, 3);
  TriangleMesh target = triangulate(boundary_surface(mesh, MeshTopology(mesh)));
  for (Vec3& p : target.positions) p = Vec3(1.5, 1.5, 1.5) + 1.5 * (p - Vec3(1.5, 1.5, 1.5));
  check_that_it_resumes([&](StageLog* log) {
    OptimizeOptions options{.control = {.max_iterations = 3}};
    options.control.log = log;
    const OptimizeResult result = optimize_mesh(mesh, &target, options);
    return std::pair(result.mesh.positions, result.report);
  });
}

TEST_CASE("A stage that comes from a log leaves its problem as one that was solved") {
  struct Cells : VolumeTerm {
    std::vector<std::vector<Index>>* densified;
    std::vector<Vec3>* at;
    Cells(std::vector<std::vector<Index>>& to, std::vector<Vec3>& nodes) : densified(&to), at(&nodes) {}
    double value(std::span<const Vec3>) const override { return 0; }
    double add_gradient(std::span<const Vec3>, double, std::span<Vec3>) const override { return 0; }
    double linearize(std::span<const Vec3>, double, std::span<Vec3>) override { return 0; }
    void multiply(std::span<const Vec3>, std::span<Vec3>) const override {}
    void add_diagonal_blocks(const SparseMap&, const SparseMap&, std::span<Mat3>) const override {}
    double max_step(std::span<const Vec3>, std::span<const Vec3>, double) const override { return 1; }
    std::vector<Index> uncertified(std::span<const Vec3>) const override { return {}; }
    void densify(std::span<const Index> cells, std::span<const Vec3> nodes) override {
      densified->emplace_back(cells.begin(), cells.end());
      at->assign(nodes.begin(), nodes.end());
    }
  };
  struct Surface : SurfaceTerm {
    int* forgotten;
    explicit Surface(int& to) : SurfaceTerm({{0, 1, 2}}, 3), forgotten(&to) {}
    void assign(std::span<const Vec3> samples) override { begin_assign(samples); }
    void forget() override { ++*forgotten; }
  };
  std::vector<std::vector<Index>> densified;
  std::vector<Vec3> densified_at;
  int forgotten = 0;
  const SparseMap identity{3, {0, 1, 2, 3}, {0, 1, 2}, {1, 1, 1}};
  FitProblem problem(identity, identity, std::make_unique<Cells>(densified, densified_at),
                     std::make_unique<Surface>(forgotten), 0.5);
  std::vector<Vec3> x(3, Vec3::Zero());
  FitReport report;
  StageRecord record;
  record.name = "stage";
  StageLog first;
  REQUIRE(StageRunner({.log = &first}).run(problem, {0.5, 0, 2}, record, x, report));
  REQUIRE(first.stages().size() == 1);
  CHECK(forgotten > 0);
  CHECK(densified.empty());
  std::vector<SolvedStage> solved = first.stages();
  solved[0].result.densified = {{2, 1}, {0}};
  solved[0].result.densified_at = {Vec3(1, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, 3)};
  StageLog log(solved, "memory");
  forgotten = 0;
  x.assign(3, Vec3::Zero());
  CHECK(StageRunner({.log = &log}).run(problem, {0.5, 0, 2}, record, x, report));
  CHECK(log.num_recalled() == 1);
  CHECK(densified == solved[0].result.densified);
  CHECK(densified_at == solved[0].result.densified_at);
  CHECK(forgotten == 1);
  solved[0].result.densified_at.pop_back();
  StageLog wrong(solved, "memory");
  x.assign(3, Vec3::Zero());
  CHECK_THROWS_WITH(StageRunner({.log = &wrong}).run(problem, {0.5, 0, 2}, record, x, report),
                    Catch::Contains("2 unknowns, expected 3"));
}

TEST_CASE("A log of another run is refused where it first differs", "[slow]") {
  const samples::Sample sample = samples::ball_sample();
  StageLog log;
  FitOptions options{.levels = 1, .control = {.max_iterations = 2}};
  options.control.log = &log;
  fit_subdivision_volume(sample.target, sample.template_mesh, options);
  StageLog again = reloaded(log, log.stages().size());
  options.control.log = &again;
  options.lambda_close = 0.01;
  CHECK_THROWS_AS(fit_subdivision_volume(sample.target, sample.template_mesh, options), InputError);
  VolumeMesh moved = sample.template_mesh;
  moved.positions[0].x() += 1e-9;
  again = reloaded(log, log.stages().size());
  options.lambda_close = FitOptions().lambda_close;
  CHECK_THROWS_WITH(fit_subdivision_volume(sample.target, moved, options),
                    Catch::Contains("does not continue this run"));
}

TEST_CASE("A checkpoint is read as it was written") {
  const RunIdentity identity{{"version", "1"}, {"--levels", "3"}};
  const std::string bytes = checkpoint_bytes(identity, {small_stage(), small_stage()});
  const Checkpoint read = parse_checkpoint(bytes, "c");
  CHECK(read.identity == identity);
  REQUIRE(read.stages.size() == 2);
  const SolvedStage& stage = read.stages[1];
  CHECK(stage.name == small_stage().name);
  CHECK(stage.start == 77);
  CHECK(same_bits(stage.x, small_stage().x));
  CHECK(stage.result.stop == MinimizerStop::no_step);
  CHECK(stage.result.explanation == "no step");
  REQUIRE(stage.result.iterations.size() == 1);
  CHECK(stage.result.iterations[0].volume_energy == 0.25);
  CHECK(stage.result.iterations[0].evaluations == 3);
  CHECK(stage.seconds == 0.5);
  CHECK(stage.result.small_steps == 1);
  CHECK(stage.result.densified == small_stage().result.densified);
  CHECK(same_bits(stage.result.densified_at, small_stage().result.densified_at));
  CHECK(checkpoint_bytes(read.identity, read.stages) == bytes);
}

TEST_CASE("A checkpoint that was cut off or changed anywhere is refused") {
  const std::string bytes = checkpoint_bytes({{"--levels", "3"}}, {small_stage()});
  for (std::size_t length = 0; length < bytes.size(); ++length)
    CHECK_THROWS_AS(parse_checkpoint(std::string_view(bytes).substr(0, length), "c"), InputError);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string changed = bytes;
    changed[i] = static_cast<char>(changed[i] ^ 0x20);
    if (i == bytes.find('\n', bytes.find('\n') + 1)) continue;  // the line end after the fingerprint says nothing
    CHECK_THROWS_AS(parse_checkpoint(changed, "c"), InputError);
  }
}

TEST_CASE("A checkpoint with a right fingerprint and wrong content is refused") {
  SolvedStage stage = small_stage();
  SECTION("a position that is not finite") { stage.x[0].x() = std::numeric_limits<double>::infinity(); }
  SECTION("a negative time") { stage.seconds = -1; }
  SECTION("a negative count") { stage.result.iterations[0].evaluations = -1; }
  SECTION("a minimization after one that is not over") { stage.result.stop = MinimizerStop::cancelled; }
  CHECK_THROWS_WITH(parse_checkpoint(checkpoint_bytes({}, {stage, small_stage()}), "c"),
                    Catch::Contains("what no run writes"));
}

TEST_CASE("What differs between two runs is named") {
  const RunIdentity then{{"version", "1"}, {"--levels", "3"}, {"target", "aa"}};
  require_same_run(then, then, "c");
  const RunIdentity now{{"version", "1"}, {"--levels", "2"}, {"target", "aa"}, {"--cage-only", "true"}};
  CHECK_THROWS_WITH(require_same_run(then, now, "c"),
                    "c: this checkpoint is of another run: --cage-only was not given, is true; --levels was 3, is 2");
}
