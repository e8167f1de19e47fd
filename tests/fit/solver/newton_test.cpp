// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/newton.h"
#include "subvol/base/error.h"
#include "subvol/fit/solver/reduced_hessian.h"

#include <catch2/catch.hpp>

#include <limits>
#include <memory>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// |y - (1.5, 0, 0)|^2 of one node, whose only cell is certified up to y.x() = 1.
struct Wall : VolumeTerm {
  const Vec3 wanted{1.5, 0, 0};
  std::vector<Vec3>* densified_at;
  bool keeps_off;
  Wall(std::vector<Vec3>& at, bool half) : densified_at(&at), keeps_off(half) {}
  bool keeps_off_inversion() const override { return keeps_off; }
  double value(std::span<const Vec3> y) const override { return (y[0] - wanted).squaredNorm(); }
  double add_gradient(std::span<const Vec3> y, double scale, std::span<Vec3> gradient) const override {
    gradient[0] += 2 * scale * (y[0] - wanted);
    return value(y);
  }
  double linearize(std::span<const Vec3> y, double scale, std::span<Vec3> gradient) override {
    return add_gradient(y, scale, gradient);
  }
  void multiply(std::span<const Vec3> in, std::span<Vec3> out) const override { out[0] = 2 * in[0]; }
  void add_diagonal_blocks(const SparseMap&, const SparseMap&, std::span<Mat3> diagonal) const override {
    diagonal[0] += 2 * Mat3::Identity();
  }
  double max_step(std::span<const Vec3>, std::span<const Vec3>, double limit) const override { return limit; }
  std::vector<Index> uncertified(std::span<const Vec3> y) const override {
    return y[0].x() > 1 ? std::vector<Index>{0} : std::vector<Index>{};
  }
  void densify(std::span<const Index> cells, std::span<const Vec3> nodes) override {
    CHECK(cells[0] == 0);
    densified_at->assign(nodes.begin(), nodes.end());
  }
};

/// One whose cell can be made stiffer.
struct StifferWall final : Wall {
  using Wall::Wall;
  double stiffness = 1;
  double linearize(std::span<const Vec3> y, double scale, std::span<Vec3> gradient) override {
    stiffness = 1;
    return Wall::linearize(y, scale, gradient);
  }
  bool stiffen(std::span<const Index> cells) override {
    CHECK(std::vector<Index>(cells.begin(), cells.end()) == std::vector<Index>{0});
    stiffness *= 1.25;
    return true;
  }
  void multiply(std::span<const Vec3> in, std::span<Vec3> out) const override { out[0] = 2 * stiffness * in[0]; }
  void add_diagonal_blocks(const SparseMap&, const SparseMap&, std::span<Mat3> diagonal) const override {
    diagonal[0] += 2 * stiffness * Mat3::Identity();
  }
};

/// One whose second derivatives are given.
struct BentWall final : Wall {
  Mat3 hessian;
  BentWall(std::vector<Vec3>& at, const Mat3& given) : Wall(at, true), hessian(given) {}
  void multiply(std::span<const Vec3> in, std::span<Vec3> out) const override { out[0] = hessian * in[0]; }
  void add_diagonal_blocks(const SparseMap&, const SparseMap&, std::span<Mat3> diagonal) const override {
    diagonal[0] += hessian;
  }
};

}  // namespace

TEST_CASE("Only a gradient of zero counts as one that vanishes") {
  std::vector<Vec3> densified_at;
  const SparseMap identity{1, {0, 1}, {0}, {1}};
  const auto minimized = [&](const Mat3& hessian, const Vec3& start) {
    FitProblem problem(identity, select_rows(identity, {}), std::make_unique<BentWall>(densified_at, hessian), nullptr,
                       1);
    std::vector<Vec3> x = {start};
    return minimize_newton(problem, x, {.max_iterations = 1});
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Vec3 start = Vec3::Zero(), end(1.5, 0, 0);
  for (const Vec3& diagonal : {Vec3(-1, 3, 3), Vec3(-1, -1, -1), Vec3(nan, 1, 1)}) {
    const MinimizerResult result = minimized(diagonal.asDiagonal(), start);
    CHECK(result.stop == MinimizerStop::no_step);
    CHECK_THAT(result.explanation, Catch::Contains("no direction"));
    CHECK(minimized(diagonal.asDiagonal(), end).stop == MinimizerStop::converged);
  }
  CHECK(minimized(2 * Mat3::Identity(), start).iterations.size() == 1);
}

TEST_CASE("Blocks that are not positive definite have positive inverses all the same") {
  const Vec3 indefinite(-1, 3, 3), singular(2, 0, 0), definite(1, 2, 4);
  const std::vector<Mat3> blocks{Mat3(indefinite.asDiagonal()), Mat3(singular.asDiagonal()),
                                 Mat3(definite.asDiagonal())};
  const std::vector<Mat3> inverse = inverse_blocks(blocks);
  CHECK(inverse[0] == Mat3(Mat3::Identity() / 5));
  CHECK(inverse[1] == Mat3(Mat3::Identity() / 2));
  CHECK(inverse[2] == Mat3(Vec3(1, 0.5, 0.25).asDiagonal()));
}

TEST_CASE("A cell in the way of a step is made stiffer, until it is not") {
  std::vector<Vec3> densified_at;
  const SparseMap identity{1, {0, 1}, {0}, {1}};
  FitProblem problem(identity, select_rows(identity, {}), std::make_unique<StifferWall>(densified_at, true), nullptr,
                     1);
  std::vector<Vec3> x = {Vec3::Zero()};
  const MinimizerResult result = minimize_newton(problem, x, {.max_iterations = 1});
  // 1.5 and 1.5 / 1.25 are behind the wall, 1.5 / 1.25^2 is not.
  CHECK((x[0] - Vec3(0.96, 0, 0)).norm() < 1e-12);
  REQUIRE(result.iterations.size() == 1);
  CHECK(result.iterations[0].step_length == 1);
  CHECK(result.iterations[0].evaluations == 3);
  CHECK(result.densified == std::vector<std::vector<Index>>{{0, 0}});
  CHECK(densified_at == std::vector<Vec3>{Vec3::Zero()});
}

TEST_CASE("A step that a certificate has cut back may go half as far as the certificate would let it") {
  std::vector<Vec3> densified_at;
  const SparseMap identity{1, {0, 1}, {0}, {1}};
  FitProblem problem(identity, select_rows(identity, {}), std::make_unique<Wall>(densified_at, true), nullptr, 1);
  std::vector<Vec3> x = {Vec3::Zero()};
  const MinimizerResult result = minimize_newton(problem, x, {.max_iterations = 1});
  // The whole step ends behind the wall, half of it at 0.75: the step is a quarter.
  CHECK((x[0] - Vec3(0.375, 0, 0)).norm() < 1e-12);
  REQUIRE(result.iterations.size() == 1);
  CHECK(result.iterations[0].step_length == 0.25);
  CHECK(result.iterations[0].evaluations == 3);
  CHECK(result.densified.size() == 1);
  CHECK(result.densified_at == std::vector<Vec3>{Vec3::Zero()});
  CHECK(densified_at == result.densified_at);

  FitProblem other(identity, select_rows(identity, {}), std::make_unique<Wall>(densified_at, false), nullptr, 1);
  x = {Vec3::Zero()};
  CHECK(minimize_newton(other, x, {.max_iterations = 1}).iterations[0].step_length == 0.5);

  densified_at.clear();
  MinimizerResult wrong = result;
  wrong.densified_at.clear();
  CHECK_THROWS_AS(densify_again(problem, wrong), InputError);
  CHECK(densified_at.empty());
  densify_again(problem, result);
  CHECK(densified_at == result.densified_at);
}
