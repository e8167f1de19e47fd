// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/shell.h"
#include "subvol/base/error.h"
#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/mending/visible_normals.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/target/enclosed_volume.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/validate.h"
#include "subvol/shell/extrude.h"
#include "subvol/shell/ray_gap.h"
#include "subvol/shell/thickness.h"
#include "subvol/surface/boundary.h"
#include "tests/support/require_data.h"
#include "tests/support/shell_fixtures.h"
#include "tests/support/surface_fixtures.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <Eigen/LU>

#include <cmath>
#include <functional>
#include <numeric>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

constexpr double kPi = 3.14159265358979323846;

double volume(const VolumeMesh& mesh) {
  const TriangleMesh boundary = triangulate(boundary_surface(mesh, MeshTopology(mesh)));
  return signed_volume(boundary.positions, boundary.triangles);
}

/// Least det J on a dense grid of points, relative to nothing: only its sign counts.
double least_determinant(const VolumeMesh& mesh, std::size_t cell, const ElementRule& rule) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t q = 0; q < rule.num_points(); ++q) {
    Mat3 jacobian = Mat3::Zero();
    for (const ElementRule::Entry& entry : rule.point(q))
      jacobian +=
          mesh.positions[mesh.cell(cell)[entry.vertex]] * Eigen::Map<const Vec3>(entry.gradient.data()).transpose();
    least = std::min(least, jacobian.determinant());
  }
  return least;
}

/// The guarantees, by means that share nothing with the shell's own: `check_mesh` and dense sampling.
void check_valid(const ShellResult& shell) {
  CHECK(shell.failures.none());
  const MeshCheck check = check_mesh(shell.mesh);
  CHECK(check.valid());
  const ElementRule rules[] = {make_element_rule(CellKind::tet, 7), make_element_rule(CellKind::prism, 7),
                               make_element_rule(CellKind::hex, 7)};
  for (std::size_t c = 0; c < shell.mesh.num_cells(); ++c)
    REQUIRE(least_determinant(shell.mesh, c, rules[static_cast<int>(shell.mesh.kinds[c])]) > 0);
  const std::size_t n = shell.layers.num_columns();
  for (std::size_t v = 0; v < n; ++v)
    REQUIRE(shell.mesh.positions[shell.layers.vertex(shell.layers.inside, static_cast<Index>(v))] ==
            shell.layers.surface.positions[v]);
}

double mean(const std::vector<double>& strands, std::size_t first, std::size_t count) {
  return std::accumulate(strands.begin() + first, strands.begin() + first + count, 0.0) / static_cast<double>(count);
}

/// Zero of a function that rises through it in [low, high].
double zero_of(const std::function<double(double)>& f, double low, double high) {
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (f(middle) < 0 ? low : high) = middle;
  }
  return low;
}

}  // namespace

TEST_CASE("more layers than can be numbered are refused at once", "[shell]") {
  CHECK_THROWS_WITH(make_shell(plane(Faces::quads), {.thickness = 0.1, .layers = 1'000'000'000}),
                    Catch::Contains("can be numbered"));
}

TEST_CASE("The most visible direction is the middle of the smallest cap", "[shell]") {
  const std::vector<Vec3> axes{Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
  CHECK((*most_visible_direction(axes) - Vec3(1, 1, 1).normalized()).norm() < 1e-14);
  CHECK((*most_visible_direction(std::vector<Vec3>{Vec3::UnitX(), Vec3::UnitX()}) - Vec3::UnitX()).norm() < 1e-14);
  CHECK_FALSE(most_visible_direction(std::vector<Vec3>{Vec3::UnitX(), -Vec3::UnitX()}));
  CHECK_FALSE(most_visible_direction(std::vector<Vec3>{Vec3::UnitX(), Vec3::UnitY(), Vec3(-1, -1, 0).normalized()}));
  CHECK_THROWS_AS(most_visible_direction({}), InputError);
}

TEST_CASE("The smallest cap of many normals is found in any order, and where there is none", "[shell]") {
  constexpr int kNormals = 5000;
  std::vector<Vec3> normals;  // of an elliptic cone, from its flat sides to its ends by turns: every one widens the cap
  for (int i = 0; i < kNormals; ++i) {
    const double angle = 0.5 * kPi * (1 - static_cast<double>(i) / (kNormals - 1));
    normals.push_back(Vec3((i % 2 == 0 ? 1 : -1) * std::cos(angle), 0.2 * std::sin(angle), 1).normalized());
  }
  normals.push_back(Vec3(1, 0, 1).normalized());
  normals.push_back(Vec3(-1, 0, 1).normalized());
  const auto expected = most_visible_direction(normals);
  REQUIRE(expected);
  CHECK((*expected - Vec3::UnitZ()).norm() < 1e-12);
  std::reverse(normals.begin(), normals.end());
  CHECK((*most_visible_direction(normals) - Vec3::UnitZ()).norm() < 1e-12);

  RandomPoints random(8);
  for (Vec3& n : normals) n = random.point().normalized();
  CHECK_FALSE(most_visible_direction(normals));
  for (std::size_t i = 0; i < normals.size(); ++i)  // a round cone: all of them lie on the border
    normals[i] = Vec3(std::cos(static_cast<double>(i)), std::sin(static_cast<double>(i)), 0.5).normalized();
  CHECK((*most_visible_direction(normals) - Vec3::UnitZ()).norm() < 1e-5);
}

TEST_CASE("No direction sees a set of normals better than the one found", "[shell]") {
  RandomPoints random(3);
  for (int round = 0; round < 200; ++round) {
    std::vector<Vec3> normals;
    const Vec3 axis = random.point().normalized();
    const bool many = round % 4 == 3;
    for (int i = 0; i < (many ? 200 : 9); ++i)
      normals.push_back((axis + (many ? 0.6 : 0.9) * random.point()).normalized());
    const auto found = most_visible_direction(normals);
    const auto visibility = [&](const Vec3& n) {
      double least = 1;
      for (const Vec3& m : normals) least = std::min(least, n.dot(m));
      return least;
    };
    for (int i = 0; i < 300; ++i) {
      const Vec3 other = ((found ? *found : axis) + random.number(0, 1) * random.point()).normalized();
      CHECK(visibility(other) <= (found ? visibility(*found) : 1e-6) + 1e-12);
    }
  }
}

TEST_CASE("A flat surface gets layers of exactly the thickness asked for, whatever its faces", "[shell]") {
  for (const Faces faces : {Faces::triangles, Faces::quads, Faces::mixed}) {
    const ShellResult shell = make_shell(plane(faces), {.thickness = 0.1, .side = ShellSide::both, .layers = 2});
    check_valid(shell);
    for (const double t : shell.achieved) CHECK(t == Approx(0.1).epsilon(1e-12));
    CHECK(volume(shell.mesh) == Approx(0.2).epsilon(1e-12));
    CHECK(shell.quality.min_scaled_jacobian == Approx(1).epsilon(1e-9));
    CHECK(shell.mesh.num_cells() == 4 * shell.layers.surface.num_faces());
    CHECK(shell.mesh.references.front() == 1);
    CHECK(shell.mesh.references.back() == 4);
  }
}

TEST_CASE("Layers grow by the factor given", "[shell]") {
  const ShellResult shell = make_shell(plane(Faces::quads), {.thickness = 0.7, .layers = 3, .growth = 2});
  const std::size_t n = shell.layers.num_columns();
  for (int sheet = 0; sheet < 4; ++sheet)
    for (std::size_t v = 0; v < n; ++v)
      CHECK(shell.mesh.positions[sheet * n + v].z() == Approx(0.1 * ((1 << sheet) - 1)).margin(1e-12));
  CHECK(layer_shares(0, 2) == std::vector<double>{0});
  CHECK_THROWS_AS(layer_shares(-1, 1), InputError);
  CHECK_THROWS_AS(layer_shares(1, 0), InputError);
  CHECK_THROWS_AS(layer_shares(200, 100), InputError);
}

TEST_CASE("A flat shell is perfect from the start, and says so", "[shell]") {
  for (const Faces faces : {Faces::quads, Faces::triangles}) {
    const ShellResult shell = make_shell(plane(faces), {.thickness = 0.1, .layers = 2});
    INFO(shell.report.explanation);
    CHECK(shell.report.stop_reason == StopReason::converged);
  }
}

TEST_CASE("One face has room for its shell", "[shell]") {
  const PolygonMesh triangle{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 3}, {0, 1, 2}};
  const ShellResult shell = make_shell(triangle, {.thickness = 0.05, .optimize = false});
  CHECK(shell.mesh.positions[3].z() == Approx(0.05));
}

TEST_CASE("A sphere's shell is as thick as its energy says, and has that volume", "[shell]") {
  // One layer: half of the corners are stretched twice by (R + h)/R, so E(h) = ln^2(h/d)/2 + ln^2((R + h)/R)/2.
  const double d = 0.2;
  for (const double sign : {1.0, -1.0}) {
    const auto slope = [&](double t) { return std::log(t / d) / t + sign * std::log(1 + sign * t) / (1 + sign * t); };
    const double h = zero_of(slope, 0.1, 0.3);
    const ShellResult shell = make_shell(as_polygons(cube_surface(16, true)),
                                         {.thickness = d, .side = sign > 0 ? ShellSide::outward : ShellSide::inward});
    check_valid(shell);
    const std::size_t n = shell.layers.num_columns();
    CHECK(mean(shell.achieved, sign > 0 ? n : 0, n) == Approx(h).epsilon(0.005));
    CHECK(volume(shell.mesh) == Approx(sign * 4 / 3.0 * kPi * (std::pow(1 + sign * h, 3) - 1)).epsilon(0.02));
  }
}

TEST_CASE("A tube's shell is as thick as its energy says", "[shell]") {
  // Stretched once at the outer corners: E(h) = ln^2(h/d)/2 + ln^2((R + h)/R)/4, and nothing along the axis.
  const double d = 0.3;
  const PolygonMesh tube = grid(
      48, 8, Faces::quads,
      [](double i, double j) { return Vec3(std::cos(2 * kPi * i / 48), std::sin(2 * kPi * i / 48), j / 8); }, true);
  const double h = zero_of([&](double t) { return std::log(t / d) / t + 0.5 * std::log(1 + t) / (1 + t); }, 0.1, 0.4);
  const ShellResult shell = make_shell(tube, {.thickness = d});
  check_valid(shell);
  const std::size_t n = shell.layers.num_columns();
  CHECK(mean(shell.achieved, n, n) == Approx(h).epsilon(0.005));
  CHECK(volume(shell.mesh) == Approx(kPi * (h * h + 2 * h)).epsilon(0.01));
}

TEST_CASE("Scaling, moving and turning the surface does the same to its shell", "[shell]") {
  TriangleMesh ball = cube_surface(4, true);
  const ShellResult shell = make_shell(as_polygons(ball), {.thickness = 0.1, .layers = 2});
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  for (Vec3& p : ball.positions) p = 1e3 * (turn * p) + Vec3(1e4, -2e4, 0);
  const ShellResult moved = make_shell(as_polygons(ball), {.thickness = 100, .layers = 2});
  check_valid(moved);
  for (std::size_t i = 0; i < shell.mesh.num_vertices(); ++i)
    CHECK((moved.mesh.positions[i] - (1e3 * (turn * shell.mesh.positions[i]) + Vec3(1e4, -2e4, 0))).norm() < 1e-5);
}

TEST_CASE("Walls that face each other share the room between them", "[shell][slow]") {
  // A slot of width 1, outward being into the slot: twice 0.8 does not fit. And an L, whose sides bend toward each
  // other.
  const std::vector<Vec3> u = profile({{0, 2, 0}, {0, 0, 0}, {1, 0, 0}, {1, 2, 0}}, 8);
  const std::vector<Vec3> l = profile({{0, 2, 0}, {0, 0, 0}, {2, 0, 0}}, 8);
  for (const auto* points : {&u, &l})
    for (const Faces faces : {Faces::triangles, Faces::quads})
      for (const double d : {0.3, 0.8, 2.0}) {
        const PolygonMesh surface = drawn_profile(*points, faces);
        for (const ShellSide side : {ShellSide::outward, ShellSide::inward, ShellSide::both}) {
          const ShellResult shell = make_shell(surface, {.thickness = d, .side = side, .layers = 2});
          INFO("points " << points->size() << ", thickness " << d << ", side " << static_cast<int>(side));
          check_valid(shell);
          for (std::size_t s = 0; s < shell.layers.num_strands(); ++s) CHECK(shell.limited[s] <= shell.asked[s]);
        }
      }
}

TEST_CASE("Thickness falls towards a narrow place with a bounded slope", "[shell]") {
  const ShellLayers layers =
      make_layers(grid(8, 1, Faces::quads, [](double i, double j) { return Vec3(i, j, 0); }), 0, 1, 1);
  std::vector<double> thickness(layers.num_strands(), 10.0);
  thickness[layers.num_columns()] = 1;
  limit_slope(layers, thickness);
  for (int i = 0; i <= 8; ++i) CHECK(thickness[layers.num_columns() + i] == Approx(1 + 0.5 * i));
  CHECK(thickness[0] == 10);
}

TEST_CASE("Ray gaps are distances to the other side", "[shell]") {
  const TriangleMesh cube = cube_surface(4, false);
  std::vector<Vec3> inward;
  for (const Vec3& p : cube.positions) inward.push_back(-p.normalized());
  const std::vector<double> gaps = ray_gaps(cube, inward);
  for (std::size_t v = 0; v < gaps.size(); ++v) CHECK(gaps[v] == Approx(2 * cube.positions[v].norm()));
  for (Vec3& d : inward) d = -d;
  for (const double gap : ray_gaps(cube, inward)) CHECK(std::isinf(gap));
  CHECK_THROWS_AS(ray_gaps(cube, {}), InputError);
}

TEST_CASE("What is certified is nowhere inverted, however the shell is spoilt", "[shell]") {
  RandomPoints random(5);
  const ShellResult shell = make_shell(as_polygons(cube_surface(4, true)), {.thickness = 0.2, .side = ShellSide::both});
  const ElementRule rule = make_element_rule(CellKind::prism, 17);
  std::size_t certified = 0, refuted = 0;
  for (const double amount : {0.02, 0.05, 0.1, 0.2}) {
    VolumeMesh spoilt = shell.mesh;
    for (Vec3& p : spoilt.positions) p += random.point(amount);
    const CertificateSummary summary = certify(spoilt);
    for (std::size_t c = 0; c < spoilt.num_cells(); ++c) {
      const bool not_certified =
          std::binary_search(summary.not_certified.begin(), summary.not_certified.end(), static_cast<Index>(c));
      (not_certified ? refuted : certified) += 1;
      if (!not_certified) CHECK(least_determinant(spoilt, c, rule) > 0);
    }
  }
  CHECK(certified > 100);
  CHECK(refuted > 100);
}

TEST_CASE("A shell that is advanced into itself stops short of it", "[shell]") {
  const ShellLayers layers = make_layers(as_polygons(cube_surface(4, true)), 1, 0, 1);
  const VolumeMesh cells = stack_cells(layers);
  const ShellCheck check(layers, cells, CheckedSheets::all);
  const VisibleNormals visible = visible_normals(layers.surface);
  const std::vector<double> thin(layers.num_strands(), 0.01), thick(layers.num_strands(), 1.5);
  std::vector<double> shares;
  const auto safe = straight_columns(layers, visible.directions, thin);
  const auto wanted = straight_columns(layers, visible.directions, thick);
  REQUIRE(check.failures(safe).none());
  REQUIRE_FALSE(check.failures(wanted).none());
  CHECK(check.failures(advance(layers, check, safe, wanted, {}, &shares)).none());
  for (std::size_t v = 0; v < layers.num_columns(); ++v) CHECK(shares[v] < 1);
}

TEST_CASE("A free surface slides where that helps the cells, and stays near where it was", "[shell]") {
  RandomPoints random(9);
  TriangleMesh ball = cube_surface(8, true);
  for (Vec3& p : ball.positions) p = (p + random.point(0.04)).normalized();
  const PolygonMesh surface = as_polygons(ball);
  const ShellResult fixed = make_shell(surface, {.thickness = 0.2, .layers = 2});
  const ShellResult free = make_shell(surface, {.thickness = 0.2, .layers = 2, .free_surface = true});
  check_valid(fixed);
  CHECK(fixed.surface_distance_max < 1e-15);
  CHECK(free.failures.none());
  CHECK(check_mesh(free.mesh).valid());
  CHECK(free.surface_distance_max > 0);
  CHECK(free.surface_distance_max < 0.02);
  CHECK(free.quality.mean_scaled_jacobian > fixed.quality.mean_scaled_jacobian);

  // The border of an open surface stays, and so do its tags.
  const PolygonMesh patch = grid(8, 8, Faces::quads, [](double i, double j) { return Vec3(i / 4, j / 4, i * i / 60); });
  const ShellResult open = make_shell(patch, {.thickness = 0.3, .free_surface = true, .tags = {{{30, 31}}, {}}});
  CHECK(open.failures.none());
  for (const Index v : {0, 1, 8, 9, 30, 31, 80}) CHECK((open.mesh.positions[v] - patch.positions[v]).norm() < 1e-14);
  CHECK((open.mesh.positions[40] - patch.positions[40]).norm() > 1e-6);
}

TEST_CASE("Creases and corners are kept on both outer sheets, and borders become creases", "[shell]") {
  const PolygonMesh patch = plane(Faces::quads);
  const FeatureTags tags{{{8, 9, 2.5}}, {{9}}};
  const ShellResult shell = make_shell(patch, {.thickness = 0.1, .side = ShellSide::both, .layers = 2, .tags = tags});
  const auto n = static_cast<Index>(shell.layers.num_columns());
  const auto& found = shell.mesh.tags;
  const auto has = [&](const CreaseEdge& crease) {
    return std::find(found.creases.begin(), found.creases.end(), crease) != found.creases.end();
  };
  CHECK(has({8, 9, 2.5}));
  CHECK(has({4 * n + 8, 4 * n + 9, 2.5}));
  CHECK(has({0, 1}));
  CHECK(found.creases.size() == 2 * (1 + 20));
  CHECK(found.corners.size() == 2);
  CHECK(validate(shell.mesh).empty());
  CHECK_THROWS_WITH(make_shell(patch, {.thickness = 0.1, .tags = {{{0, 9}}, {}}}), Catch::Contains("0-9"));
  CHECK_THROWS_WITH(make_shell(patch, {.thickness = 0.1, .tags = {{}, {{99}}}}), Catch::Contains("99"));
}

TEST_CASE("Sharp edges of a surface are found by their angle", "[shell]") {
  const FeatureTags tags = surface_features(as_polygons(cube_surface(2, false)), 40);
  CHECK(tags.creases.size() == 24);
  CHECK(tags.corners.size() == 8);
}

TEST_CASE("A shell has the same bits for one thread and for two", "[shell]") {
  const PolygonMesh surface = as_polygons(cube_surface(6, false));
  test::ThreadGuard guard;
  guard.use(1);
  const ShellResult one = make_shell(surface, {.thickness = 0.5, .side = ShellSide::both, .layers = 2});
  guard.use(2);
  const ShellResult two = make_shell(surface, {.thickness = 0.5, .side = ShellSide::both, .layers = 2});
  CHECK(one.mesh.positions == two.mesh.positions);
}

TEST_CASE("A shell can be stopped at any step and is valid all the same", "[shell]") {
  int calls = 0;
  const ShellResult shell =
      make_shell(as_polygons(cube_surface(6, false)),
                 {.thickness = 0.5, .layers = 2, .control = {.progress = [&](const FitProgress& progress) {
                                                   CHECK(progress.fraction >= 0);
                                                   CHECK(progress.fraction <= 1);
                                                   return ++calls < 3;
                                                 }}});
  CHECK(shell.report.stop_reason == StopReason::cancelled);
  CHECK(calls == 3);
  CHECK(shell.report.stages.empty());
  check_valid(shell);
}

TEST_CASE("A shell that is cancelled in a long search, before there is any, has no cells", "[shell]") {
  constexpr int n = 800;  // two cones on one circle: so many faces at an apex that the search asks whether to go on
  PolygonMesh cones{{{0, 0, 1}, {0, 0, -1}}, {0}, {}};
  for (int i = 0; i < n; ++i) {
    cones.positions.emplace_back(std::cos(2 * kPi * i / n), std::sin(2 * kPi * i / n), 0);
    const Index a = 2 + i, b = 2 + (i + 1) % n;
    add_face(cones, {a, b, 0});
    add_face(cones, {b, a, 1});
  }
  ShellOptions options{.thickness = 0.01, .optimize = false};
  CHECK(make_shell(cones, options).failures.none());
  options.control.cancelled = [] { return true; };
  const ShellResult result = make_shell(cones, options);
  CHECK(result.report.stop_reason == StopReason::cancelled);
  CHECK(result.mesh.num_cells() == 0);
}

TEST_CASE("Surfaces and options that no shell can be made of are refused with their place", "[shell]") {
  const PolygonMesh good = plane(Faces::triangles);
  CHECK_THROWS_WITH(make_shell(good, {.thickness = 0}), Catch::Contains("thickness"));
  CHECK_THROWS_WITH(make_shell(good, {.thickness = std::nan("")}), Catch::Contains("thickness"));
  CHECK_THROWS_WITH(make_shell(good, {.thickness = 1, .layers = 0}), Catch::Contains("layers"));
  CHECK_THROWS_WITH(make_shell(good, {.thickness = 1, .growth = -1}), Catch::Contains("growth"));
  CHECK_THROWS_WITH(make_shell(good, {.vertex_thickness = {1, 2}}), Catch::Contains("per vertex"));
  CHECK_THROWS_WITH(make_shell(PolygonMesh{}, {.thickness = 1}), Catch::Contains("extent") || Catch::Contains("faces"));

  PolygonMesh pentagon{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0.5, 1.5, 0}, {0, 1, 0}}, {0}, {}};
  add_face(pentagon, {0, 1, 2, 3, 4});
  CHECK_THROWS_WITH(make_shell(pentagon, {.thickness = 1}), Catch::Contains("face 0 has 5 corners"));

  PolygonMesh odd = good;
  odd.positions.emplace_back(9, 9, 9);
  CHECK_THROWS_WITH(make_shell(odd, {.thickness = 1}), Catch::Contains("belongs to no face"));
  odd = good;
  odd.positions[3].x() = std::nan("");
  CHECK_THROWS_AS(make_shell(odd, {.thickness = 1}), InputError);
  odd = good;
  odd.face_vertices[4] = 1000;
  CHECK_THROWS_WITH(make_shell(odd, {.thickness = 1}), Catch::Contains("names vertex 1000"));
  odd = good;
  odd.face_vertices[1] = odd.face_vertices[0];
  CHECK_THROWS_WITH(make_shell(odd, {.thickness = 1}), Catch::Contains("twice"));

  PolygonMesh three{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}, {0}, {}};
  add_face(three, {0, 1, 2});
  add_face(three, {1, 0, 3});
  add_face(three, {1, 0, 4});
  CHECK_THROWS_WITH(make_shell(three, {.thickness = 0.1}),
                    Catch::Contains("1 edge has more than two faces: from vertex 0"));

  PolygonMesh flipped{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}}, {0}, {}};
  add_face(flipped, {0, 1, 2});
  add_face(flipped, {0, 1, 3});
  CHECK_THROWS_WITH(make_shell(flipped, {.thickness = 0.1}), Catch::Contains("the same way"));

  PolygonMesh hourglass{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}}, {0}, {}};
  add_face(hourglass, {0, 1, 2});
  add_face(hourglass, {0, 3, 4});
  CHECK_THROWS_WITH(make_shell(hourglass, {.thickness = 0.1}), Catch::Contains("vertex 0"));

  PolygonMesh crossing{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0.5, 0.5, -1}, {0.5, 0.5, 1}, {3, 3, 0}}, {0}, {}};
  add_face(crossing, {0, 1, 2});
  add_face(crossing, {3, 4, 5});
  CHECK_THROWS_WITH(make_shell(crossing, {.thickness = 0.1}),
                    Catch::Contains("meets itself at 1 pair of faces: faces 0 and 1 at ("));

  PolygonMesh flat{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}}, {0}, {}};
  add_face(flat, {0, 1, 2});
  add_face(flat, {0, 2, 3});
  CHECK_THROWS_WITH(make_shell(flat, {.thickness = 0.1}), Catch::Contains("1 face has no area: face 0 at ("));

  // Three folds around the middle vertex, each overhanging: no direction sees all of it.
  PolygonMesh folds;
  folds.positions.push_back(Vec3::Zero());
  for (const double first : {0.0, 120.0, 240.0})
    for (const auto& [degrees, height] : {std::pair{40, -1}, {80, -1}, {40, 1}}) {
      const double angle = (first + degrees) * kPi / 180;
      folds.positions.emplace_back(std::cos(angle), std::sin(angle), height);
    }
  for (Index i = 0; i < 9; ++i) add_face(folds, {0, 1 + i, 1 + (i + 1) % 9});
  CHECK_THROWS_WITH(make_shell(folds, {.thickness = 0.1}), Catch::Contains("vertex 0 at ("));
}

TEST_CASE("Layers that vanish beside the surface are refused with their thickness and the least one", "[shell]") {
  const PolygonMesh surface = plane(Faces::triangles);
  CHECK_THROWS_WITH(make_shell(surface, {.thickness = 1e-300}),
                    Catch::Contains("thickness 1e-300 vanishes beside the surface; expected at least "));
  CHECK_THROWS_WITH(make_shell(surface, {.thickness = 0.1, .layers = 20, .growth = 100}),
                    Catch::Contains("growth 100 makes the thinnest of 20 layers"));
  CHECK_THROWS_WITH(make_shell(surface, {.thickness = 0.1, .layers = 20, .growth = 0.01}),
                    Catch::Contains("growth 0.01 makes the thinnest of 20 layers"));
  std::vector<double> thickness(surface.positions.size(), 0.1);
  thickness[3] = 1e-200;
  CHECK_THROWS_WITH(make_shell(surface, {.vertex_thickness = thickness}),
                    Catch::Contains("at vertex 3 at (") && Catch::Contains("thickness 1e-200 vanishes"));
  CHECK_THROWS_WITH(extrude(surface, {.thickness = 1e-300}), Catch::Contains("extrude: thickness 1e-300 vanishes"));
  CHECK(make_shell(surface, {.thickness = 1e-9}).failures.none());
}

TEST_CASE("Real surfaces get valid shells on every side", "[shell][data][slow]") {
  const auto data = require_data();
  if (!data) return;
  for (const char* name : {"sphere/surface.off", "bumpy_cube/surface.off", "cubespikes_quads/surface.obj",
                           "knight1000/surface.off", "spot/surface.off"}) {
    const PolygonMesh surface = read_polygon_mesh(*data / "shell" / name);
    INFO(name);
    Vec3 low = surface.positions[0], high = low;
    for (const Vec3& p : surface.positions) low = low.cwiseMin(p), high = high.cwiseMax(p);
    for (const double percent : {1.0, 5.0}) {
      const double thickness = percent / 100 * (high - low).norm();
      const ShellResult shell = make_shell(surface, {.thickness = thickness, .side = ShellSide::both, .layers = 2});
      check_valid(shell);
      const std::size_t n = shell.layers.num_columns();
      if (percent > 1 || std::string(name).starts_with("knight")) continue;
      CHECK(mean(shell.achieved, 0, n) == Approx(thickness).epsilon(0.05));
      CHECK(mean(shell.achieved, n, n) == Approx(thickness).epsilon(0.05));
      CHECK(shell.quality.min_scaled_jacobian >= 0.15);
    }
  }
  CHECK_THROWS_WITH(make_shell(read_polygon_mesh(*data / "shell/camelhead_open/surface.off"), {.thickness = 0.01}),
                    Catch::Contains("1690"));
}
