// SPDX-License-Identifier: GPL-3.0-or-later
// Borders between groups on smooth surfaces are feature curves if that is asked for, or if groups are missed otherwise.

#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/automatic_groups.h"
#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/target/carried_groups.h"
#include "subvol/io/surface_io.h"
#include "tests/support/require_data.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <map>
#include <set>
#include <vector>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// A unit sphere of 8 * 4^levels triangles, in two groups above and below z = 0.
TriangleMesh grouped_sphere(int levels) {
  TriangleMesh mesh{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                    {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::array<Index, 2>, Index> middles;
    const auto middle = [&](Index a, Index b) {
      const auto [known, is_new] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<Index>(mesh.positions.size()));
      if (is_new) mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]).normalized());
      return known->second;
    };
    std::vector<std::array<Index, 3>> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  mesh.face_groups.groups = {{"north", 1, 2}, {"south", 2, 2}};
  for (const auto& t : mesh.triangles)
    mesh.face_groups.of_face.push_back((mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]])[2] > 0 ? 0
                                                                                                                   : 1);
  return mesh;
}

/// Largest |z| of the vertices between the groups that a mesh gets, and the number of these.
std::pair<double, std::size_t> border_of(const TriangleMesh& target, const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  const std::vector<Index> groups =
      carried_groups(target, linear_boundary(mesh, topology), topology.boundary_faces().size());
  std::map<Index, std::set<Index>> at_vertex;
  for (std::size_t i = 0; i < groups.size(); ++i)
    for (const Index v : topology.face(topology.boundary_faces()[i])) at_vertex[v].insert(groups[i]);
  double farthest = 0;
  std::size_t count = 0;
  for (const auto& [v, found] : at_vertex)
    if (found.size() > 1) farthest = std::max(farthest, std::abs(mesh.positions[v][2])), ++count;
  return {farthest, count};
}

/// A result whose mesh is the unit ball, moved along z.
AutomaticFitResult fake_result(double shift) {
  constexpr int kCells = 8;
  AutomaticFitResult result;
  result.mesh = lattice(kCells, kCells, kCells);
  for (Vec3& p : result.mesh.positions) {
    const Vec3 place = p / (kCells / 2) - Vec3::Ones();
    const double length = place.norm();
    p = length > 0 ? Vec3(place * (place.cwiseAbs().maxCoeff() / length)) : place;
    p.z() += shift;
  }
  result.trials = {{.least_share = 1, .self_intersections = 0}};
  StageRecord stage;
  stage.kept = true;
  result.report.stages = {stage};
  result.report.seconds = {{"total", 1.0}};
  result.report.stop_reason = StopReason::converged;
  return result;
}

}  // namespace

TEST_CASE("keep_groups: borders are the edges between triangles of different groups", "[fit]") {
  TriangleMesh sphere = grouped_sphere(1);
  const auto borders = group_borders(sphere, sphere);
  CHECK(borders.size() == 8);  // the equator
  for (const auto& edge : borders)
    for (const Index v : edge) CHECK(sphere.positions[v][2] == 0);
  TriangleMesh plain = sphere;
  plain.face_groups = {};
  CHECK(group_borders(plain, plain).empty());
  CHECK(group_borders(plain, sphere) == borders);
  CHECK(feature_curves(sphere, 180, borders).curves.size() == 1);
  sphere.face_groups.of_face[0] = kNoIndex;  // a triangle of no group has a border with its neighbors
  CHECK(group_borders(sphere, sphere).size() > borders.size());
}

TEST_CASE("keep_groups: an automatic fit of a smooth surface follows the border of its groups", "[fit][slow]") {
  const TriangleMesh sphere = grouped_sphere(4);
  AutomaticFitOptions options;
  options.cells = 2000;
  const AutomaticFitResult plain = fit_automatically(sphere, options);
  options.keeps_groups = true;
  const AutomaticFitResult kept = fit_automatically(sphere, options);
  const auto [away, some] = border_of(sphere, plain.mesh);
  const auto [near, count] = border_of(sphere, kept.mesh);
  CAPTURE(away, some, near, count);
  CHECK(count > 8);
  CHECK(near < 0.012);  // 0.35 % of the diagonal
  CHECK(kept.trials[kept.chosen].least_scaled_jacobian > 0.4);
  CHECK(kept.missed_edges.empty());
}

TEST_CASE("keep_groups: smooth borders are found beside sharp ones", "[fit]") {
  CHECK(has_smooth_borders(grouped_sphere(2), 40));
  CHECK(!has_smooth_borders(grouped_sphere(0), 40));  // an octahedron: all of its edges are sharp
  TriangleMesh plain = grouped_sphere(2);
  plain.face_groups = {};
  CHECK(!has_smooth_borders(plain, 40));
}

TEST_CASE("keep_groups: a second fit follows borders if the first one misses groups", "[fit]") {
  const TriangleMesh sphere = grouped_sphere(4);
  const AutomaticFitResult good = fake_result(0), bad = fake_result(0.2);
  REQUIRE(num_groups_missed(sphere, good.mesh) == 0);
  REQUIRE(num_groups_missed(sphere, bad.mesh) == 2);
  std::vector<bool> asked;
  double time_limit = 0;
  const auto run = [&](const AutomaticFitResult& without, const AutomaticFitResult& with, double limit = 0) {
    asked.clear();
    AutomaticFitOptions options;
    options.control.time_limit_seconds = limit;
    return fit_for_groups(sphere, options, [&](bool follows_borders, const AutomaticFitOptions& given) {
      asked.push_back(follows_borders);
      CHECK(given.keeps_groups == follows_borders);
      time_limit = given.control.time_limit_seconds;
      return follows_borders ? with : without;
    });
  };
  const auto is_good = [&](const AutomaticFitResult& result) { return result.mesh.positions == good.mesh.positions; };

  CHECK(run(good, bad).trials.size() == 1);
  CHECK(asked == std::vector<bool>{false});

  const AutomaticFitResult second = run(bad, good, 10);
  CHECK(asked == std::vector<bool>{false, true});
  CHECK(time_limit == Approx(9));
  CHECK(is_good(second));
  CHECK(second.trials.size() == 2);
  CHECK(second.chosen == 1);
  REQUIRE(second.report.stages.size() == 2);
  CHECK(!second.report.stages[0].kept);
  CHECK(second.report.stages[1].kept);
  CHECK(second.report.seconds.front().second == Approx(2));

  AutomaticFitResult poor = good;
  poor.trials.front().least_share = 0.5;
  poor.trials.front().merit = 2.5;
  const AutomaticFitResult first = run(bad, poor);
  CHECK(!is_good(first));
  CHECK(first.trials.size() == 2);
  CHECK(first.chosen == 0);
  CHECK(first.report.stages[0].kept);
  CHECK(!first.report.stages[1].kept);
  CHECK(!is_good(run(bad, bad)));
  poor.trials.front().merit = 0.18;  // not good, but less than two missed groups cost
  CHECK(is_good(run(bad, poor)));

  AutomaticFitResult ended = bad;
  ended.report.stop_reason = StopReason::time_limit;
  run(ended, good);
  CHECK(asked == std::vector<bool>{false});
}

TEST_CASE("keep_groups: a rounded cube keeps all of its faces", "[fit][data][slow]") {
  const auto data = require_data();
  if (!data) return;
  const TriangleMesh cube = read_triangle_mesh(*data / "auto" / "cad" / "s12o_cube_rounded_1.obj");
  AutomaticFitOptions options;
  options.cells = 3000;
  options.keeps_groups = true;
  const AutomaticFitResult kept = fit_automatically(cube, options);
  const MeshTopology topology(kept.mesh);
  const CurvedBoundary boundary = linear_boundary(kept.mesh, topology);
  const std::vector<Index> groups = carried_groups(cube, boundary, topology.boundary_faces().size());
  const std::vector<CarriedGroup> areas = areas_of_groups(cube, boundary, groups);
  CHECK(areas.size() == 26);
  CHECK(warnings_of_groups(areas).empty());
}
