// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/staged_fit.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/stage_runner.h"

#include <catch2/catch.hpp>

#include <new>
#include <optional>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// Its one unknown tells what came of it: lambda, of the last stage. The boundary intersects itself in
/// `pairs_at(lambda)`.
class FoldedFit : public StagedFit {
 public:
  explicit FoldedFit(std::size_t (*pairs_at)(double)) : StagedFit(true), pairs_at_(pairs_at), x_(1, Vec3(7, 0, 0)) {}

  bool unfold(double most_lambda) {
    constexpr double kUnfoldingFactor = 4;
    const FitSnapshot start = snapshot();
    run_final_stage(0.01);
    pairs = intersecting_pairs().value();
    return StagedFit::unfold(start, kUnfoldingFactor, most_lambda, pairs);
  }
  double x() const { return x_[0][0]; }
  double lambda() const { return lambda_; }
  std::size_t num_states() const { return states_.size(); }
  std::vector<double> kept() const {
    std::vector<double> result;
    for (const StageRecord& stage : report_.stages)
      if (stage.kept) result.push_back(stage.lambda);
    return result;
  }

  std::size_t pairs = 0;
  int most_stages = 100, most_searches = 100;
  std::vector<double> starts;

 private:
  std::vector<Vec3>& unknowns() override { return x_; }
  FitReport& report() override { return report_; }
  bool run_final_stage(double lambda) override {
    StageRecord record;
    record.name = "stage";
    record.lambda = lambda;
    keep_state();
    starts.push_back(x());
    lambda_ = lambda;
    mean_.reset();
    x_[0][0] = lambda;
    report_.stages.push_back(record);
    return static_cast<int>(report_.stages.size()) < most_stages;
  }
  std::optional<std::size_t> intersecting_pairs() override {
    return --most_searches < 0 ? std::nullopt : std::optional(pairs_at_(x()));
  }

  std::size_t (*pairs_at_)(double);
  std::vector<Vec3> x_;
  FitReport report_;
};

}  // namespace

TEST_CASE("a boundary that does not intersect itself is left alone", "[staged_fit]") {
  FoldedFit fit([](double) -> std::size_t { return 0; });
  CHECK(fit.unfold(1));
  CHECK(fit.x() == 0.01);
  CHECK(fit.kept() == std::vector<double>{0.01});
}

TEST_CASE("a folded boundary is unfolded by the least lambda that does it, each from the same start", "[staged_fit]") {
  FoldedFit fit([](double lambda) -> std::size_t { return lambda < 0.1 ? 6 : 0; });
  CHECK(fit.unfold(1));
  CHECK(fit.x() == Approx(0.16));
  CHECK(fit.lambda() == Approx(0.16));
  CHECK(fit.pairs == 0);
  CHECK(fit.starts == std::vector<double>{7, 7, 7});
  REQUIRE(fit.kept().size() == 1);
  CHECK(fit.kept()[0] == Approx(0.16));
  CHECK(fit.num_states() == 1);  // the start, from which the stage that was kept went
}

TEST_CASE("what leaves more than half of the pairs is undone; what leaves fewer is kept and stiffened",
          "[staged_fit]") {
  FoldedFit slow([](double lambda) -> std::size_t { return lambda < 0.02 ? 6 : 4; });
  CHECK(slow.unfold(1));
  CHECK(slow.x() == 0.01);
  CHECK(slow.pairs == 6);
  CHECK(slow.kept() == std::vector<double>{0.01});
  CHECK(slow.num_states() == 1);
  FoldedFit step_by_step([](double lambda) -> std::size_t { return lambda < 0.02 ? 6 : lambda < 0.1 ? 3 : 1; });
  CHECK(step_by_step.unfold(1));
  CHECK(step_by_step.x() == Approx(0.16));
  CHECK(step_by_step.pairs == 1);
  CHECK(step_by_step.kept().size() == 1);
}

TEST_CASE("unfolding ends at the most lambda, and where the fit must end", "[staged_fit]") {
  const auto pairs_at = [](double lambda) -> std::size_t { return lambda < 0.1 ? 6 : 0; };
  FoldedFit bounded(pairs_at);
  CHECK(bounded.unfold(0.1));
  CHECK(bounded.x() == 0.01);
  CHECK(bounded.pairs == 6);
  FoldedFit interrupted(pairs_at);
  interrupted.most_stages = 3;
  CHECK_FALSE(interrupted.unfold(1));
  CHECK(interrupted.x() == 0.01);  // as it was before the stage that was not done
  CHECK(interrupted.kept() == std::vector<double>{0.01});
  FoldedFit unjudged(pairs_at);  // the search after the stage that unfolds is given up
  unjudged.most_searches = 2;
  CHECK_FALSE(unjudged.unfold(1));
  CHECK(unjudged.x() == 0.01);
}

TEST_CASE("a search for self-intersections that is given up says why, and counts nothing", "[staged_fit]") {
  TriangleMesh heap;  // so many pairs that the search asks whether to go on
  for (Index i = 0; i < 800; ++i) {
    heap.positions.insert(heap.positions.end(), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
    heap.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  FitReport report;
  CHECK(StageRunner({}).intersecting_pairs(heap, report) == 800 * 799 / 2);
  CHECK(report.explanation.empty());
  CHECK_FALSE(StageRunner({.cancelled = [] { return true; }}).intersecting_pairs(heap, report));
  CHECK(report.stop_reason == StopReason::cancelled);
  CHECK(report.explanation == "cancelled in the search for self-intersections");
  CHECK_FALSE(StageRunner({.time_limit_seconds = 1e-9}).intersecting_pairs(heap, report));
  CHECK(report.stop_reason == StopReason::time_limit);
}

TEST_CASE("a fit whose memory runs out in a stage that was not judged yet is as it was before", "[staged_fit]") {
  FoldedFit fit([](double lambda) -> std::size_t {
    if (lambda > 0.1) throw std::bad_alloc();
    return 5;
  });
  CHECK_THROWS_AS(fit.unfold(1), std::bad_alloc);
  CHECK(fit.x() == 0.01);
  CHECK(fit.lambda() == 0.01);
  CHECK(fit.kept() == std::vector<double>{0.01});
}
