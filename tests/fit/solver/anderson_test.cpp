// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/anderson.h"

#include <catch2/catch.hpp>

#include <vector>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// Minimizes 1/2 x . A x by short steps down the gradient, accelerated or not. Returns |x| after each step.
std::vector<double> descend(int steps, bool accelerates) {
  const Vec3 curvature(1, 3, 10);
  std::vector<Vec3> x = {Vec3(1, -2, 0.5)}, step;
  std::vector<double> norms;
  AndersonMemory memory;
  for (int k = 0; k < steps; ++k) {
    const std::vector<Vec3> gradient = {curvature.cwiseProduct(x[0])}, plain = {-0.05 * gradient[0]};
    memory.add(x, plain, gradient);
    if (!accelerates || !memory.find_step(step)) step = plain;
    x[0] += step[0];
    norms.push_back(x[0].norm());
  }
  return norms;
}

}  // namespace

TEST_CASE("Anderson acceleration ends a slow descent in as many steps as there are unknowns", "[anderson]") {
  CHECK(descend(6, false).back() > 0.8);
  CHECK(descend(6, true).back() < 1e-10);
}

TEST_CASE("Anderson acceleration has no step while it knows one state, or if states repeat", "[anderson]") {
  AndersonMemory memory;
  const std::vector<Vec3> x = {Vec3(1, 2, 3)}, f = {Vec3(0.1, 0, 0)};
  std::vector<Vec3> step;
  CHECK_FALSE(memory.find_step(step));
  memory.add(x, f, f);
  CHECK_FALSE(memory.find_step(step));
  memory.add(x, f, f);
  CHECK_FALSE(memory.find_step(step));
  CHECK(step.empty());
  memory.clear();
  CHECK_FALSE(memory.find_step(step));
}
