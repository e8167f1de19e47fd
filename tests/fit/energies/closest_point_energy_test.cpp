// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/closest_point_energy.h"

#include "subvol/base/error.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

TEST_CASE("refined triangles of the closest-point energy see corners, and pull at them") {
  const TriangleMesh cube = cube_surface(4, false);
  const TargetSurface target(cube);
  std::vector<Vec3> samples = cube.positions;
  std::size_t corner = 0;  // of the cube, pulled outwards
  for (std::size_t i = 0; i < samples.size(); ++i)
    if (samples[i].sum() > samples[corner].sum()) corner = i;
  const Vec3 pull = 0.1 * Vec3(1, 1, 1).normalized();
  samples[corner] += pull;

  ClosestPointEnergy coarse(target, cube.triangles, samples.size(), 0.1, 1);
  coarse.assign(samples);
  CHECK(coarse.assigned_distance().max < 0.7 * pull.norm());

  ClosestPointEnergy energy(target, cube.triangles, samples.size(), 0.1, 1);
  std::vector<std::uint8_t> refined(cube.triangles.size(), 0);
  std::size_t num_refined = 0;
  for (std::size_t t = 0; t < refined.size(); ++t) {
    refined[t] = std::ranges::count(cube.triangles[t], static_cast<Index>(corner)) > 0;
    num_refined += refined[t];
  }
  energy.refine(refined);
  energy.assign(samples);
  CHECK(num_refined > 0);
  CHECK(energy.assigned_distance().max == Approx(pull.norm()));
  const std::vector<double> distances = energy.triangle_distances();
  for (std::size_t t = 0; t < refined.size(); ++t)
    if (refined[t]) CHECK(distances[t] == Approx(pull.norm()));
  CHECK(energy.assigned_distance().mean == Approx(coarse.assigned_distance().mean).epsilon(0.5));

  // Central differences of the frozen quadratic are exact but for roundings.
  RandomPoints random(7);
  const std::vector<Vec3> direction = random.points(samples.size());
  std::vector<Vec3> gradient(samples.size(), Vec3::Zero()), plus = samples, minus = samples;
  energy.add_gradient(samples, gradient);
  double slope = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    plus[i] += 1e-3 * direction[i];
    minus[i] -= 1e-3 * direction[i];
    slope += gradient[i].dot(direction[i]);
  }
  CHECK(gradient[corner].dot(pull) > 0);
  CHECK((energy.value(plus) - energy.value(minus)) / 2e-3 == Approx(slope).epsilon(1e-6));

  refined.pop_back();
  CHECK_THROWS_AS(energy.refine(refined), InputError);
}

TEST_CASE("a straight pull draws back what sticks out beyond an edge, where normals do not", "[surface]") {
  const TriangleMesh cube = cube_surface(4, false);
  const TargetSurface target(cube);
  const double high = std::ranges::max(cube.positions, {}, [](const Vec3& p) { return p.x(); }).x();
  const std::vector<Vec3> samples = {
      {high + 0.1, high + 0.1, 0.2}, {high + 0.2, high + 0.1, 0.5}, {high + 0.1, high + 0.2, 0.3}};
  const auto energy = [&](SurfacePull pull, double tau) {
    ClosestPointEnergy result(target, {{0, 1, 2}}, samples.size(), tau, 3, pull);
    result.assign(samples);
    return result.surface_to_target();
  };
  const double full = energy(SurfacePull::straight, 1);
  CHECK(full == Approx(energy(SurfacePull::along_normals, 1)));
  CHECK(energy(SurfacePull::straight, 0) == Approx(full));
  CHECK(energy(SurfacePull::along_normals, 0) < 0.8 * full);
}
