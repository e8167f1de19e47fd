// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/target_surface.h"
#include "subvol/fit/target/fit_target.h"

#include "samples/shapes.h"
#include "subvol/base/error.h"
#include "subvol/fit/target/enclosed_volume.h"
#include "subvol/fit/target/soup_topology.h"
#include "tests/support/surface_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>
#include <numbers>
#include <numeric>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// Every triangle with corners of its own.
TriangleMesh soup_of(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    const auto v = static_cast<Index>(soup.positions.size());
    for (Index corner : t) soup.positions.push_back(mesh.positions[corner]);
    soup.triangles.push_back({v, v + 1, v + 2});
  }
  return soup;
}

}  // namespace

TEST_CASE("a closed target has its area, volume, length and box") {
  TriangleMesh mesh = cube_surface(4, false);
  for (Vec3& p : mesh.positions) p += Vec3(1e4, 0, 0);
  const TargetSurface target(mesh);
  CHECK(target.area() == Approx(24));
  CHECK(target.volume() == Approx(8));
  CHECK(target.volume_source() == VolumeSource::signed_sum);
  CHECK(target.length() == Approx(1. / 3));
  CHECK(target.diagonal() == Approx(std::sqrt(12.)));
  CHECK((target.center() - Vec3(1e4, 0, 0)).norm() < 1e-9);
  for (std::size_t t = 0; t < target.triangles().size(); ++t)
    REQUIRE(target.normals()[t].dot(target.samples()[t] - target.center()) == Approx(1));
}

TEST_CASE("a soup of a closed surface has the same volume, inside out or not") {
  TriangleMesh mesh = soup_of(cube_surface(4, false));
  CHECK(TargetSurface(mesh).volume() == Approx(8));
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  CHECK(TargetSurface(mesh).volume() == Approx(8));
}

TEST_CASE("triangles turned over: the volume is that of the surface put right") {
  TriangleMesh mesh = cube_surface(16, true);
  const double exact = TargetSurface(mesh).volume();
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 2) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  const TargetSurface target(mesh);
  CHECK(target.volume_source() == VolumeSource::mended);
  CHECK(target.volume() == Approx(exact));
}

TEST_CASE("parts that disagree about the outside: the volume is that of the parts put right") {
  TriangleMesh mesh = cube_surface(4, false);
  const TriangleMesh cube = mesh;
  const auto add = [&](double size, const Vec3& at, bool turned) {
    const auto first = static_cast<Index>(mesh.positions.size());
    for (const Vec3& p : cube.positions) mesh.positions.push_back(size * p + at);
    for (const auto& [a, b, c] : cube.triangles)
      mesh.triangles.push_back({first + a, first + (turned ? c : b), first + (turned ? b : c)});
  };
  SECTION("a second solid that is inside out") {
    add(0.5, Vec3(5, 0, 0), true);
    const TargetSurface target(mesh);
    CHECK(target.volume() == Approx(9));
    CHECK(target.volume_source() == VolumeSource::mended);
  }
  SECTION("the wall of a void that points outward") {
    add(0.5, Vec3::Zero(), false);
    CHECK(TargetSurface(mesh).volume() == Approx(7));
  }
  SECTION("parts that agree have the plain sum") {
    add(0.5, Vec3(5, 0, 0), false);
    add(0.25, Vec3::Zero(), true);
    const TargetSurface target(mesh);
    CHECK(target.volume() == Approx(9 - 0.125));
    CHECK(target.volume_source() == VolumeSource::signed_sum);
  }
}

TEST_CASE("a hole is closed for the volume, wherever the surface lies") {
  TriangleMesh mesh = cube_surface(8, false);
  mesh.triangles.resize(mesh.triangles.size() - 40);
  for (const Vec3& shift : {Vec3(0, 0, 0), Vec3(100, -50, 7)}) {
    TriangleMesh moved = mesh;
    for (Vec3& p : moved.positions) p += shift;
    const TargetSurface target(moved);
    CHECK(target.volume_source() == VolumeSource::mended);
    CHECK(target.volume() == Approx(8));
  }
}

TEST_CASE("a fin on a sphere that is turned over in parts: the volume comes from flooding a grid") {
  TriangleMesh mesh = cube_surface(16, true);
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 2) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  mesh.positions.push_back(1.05 * mesh.positions[mesh.triangles[0][0]]);
  mesh.triangles.push_back({mesh.triangles[0][0], mesh.triangles[0][1], static_cast<Index>(mesh.positions.size() - 1)});
  const TargetSurface target(mesh);
  CHECK(target.volume_source() == VolumeSource::flood);
  CHECK(target.volume() == Approx(4 * std::numbers::pi / 3).epsilon(0.05));
}

TEST_CASE("open, crowded and turned edges are counted, and what lies on a rim is known") {
  const TriangleMesh whole = cube_surface(2, false);
  const auto of = [](const TriangleMesh& mesh) { return soup_topology(mesh.positions, mesh.triangles); };
  CHECK(of(whole).open_edges + of(whole).turned_edges + of(whole).crowded_edges == 0);
  TriangleMesh turned = whole;
  std::swap(turned.triangles[5][0], turned.triangles[5][1]);
  CHECK(of(turned).turned_edges == 3);
  TriangleMesh twice = whole;
  twice.triangles.push_back(twice.triangles[3]);
  CHECK(of(twice).crowded_edges == 3);
  TriangleMesh open = soup_of(whole);
  open.triangles.erase(open.triangles.begin());
  CHECK(of(open).open_edges == 3);
  const TargetSurface target(open);
  int edges = 0, corners = 0;
  for (std::size_t t = 0; t < target.triangles().size(); ++t) {
    const auto triangle = static_cast<Index>(t);
    CHECK(!target.on_rim(triangle, {1. / 3, 1. / 3, 1. / 3}));
    for (const std::array<double, 3>& at :
         {std::array{0.5, 0.5, 0.}, std::array{0., 0.5, 0.5}, std::array{0.5, 0., 0.5}})
      edges += target.on_rim(triangle, at);
    for (const std::array<double, 3>& at : {std::array{1., 0., 0.}, std::array{0., 1., 0.}, std::array{0., 0., 1.}})
      corners += target.on_rim(triangle, at);
  }
  CHECK(edges == 3);
  int expected = 0;  // corners of other triangles in the places of the one that went
  for (std::size_t t = 1; t < whole.triangles.size(); ++t)
    for (Index v : whole.triangles[t])
      expected += std::find(whole.triangles[0].begin(), whole.triangles[0].end(), v) != whole.triangles[0].end();
  CHECK(corners == expected);
}

TEST_CASE("a surface that encloses nothing still has a volume to scale by") {
  const TriangleMesh square{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)}, {{0, 1, 2}, {0, 2, 3}}};
  const TargetSurface target(square);
  CHECK(target.volume_source() == VolumeSource::isoperimetric);
  CHECK(target.volume() == Approx(1 / std::sqrt(std::numbers::pi) / 12));
}

TEST_CASE("the flood's volume converges to the enclosed one") {
  const TriangleMesh mesh = cube_surface(32, true);
  const double exact = signed_volume(mesh.positions, mesh.triangles);
  for (int resolution : {16, 32, 64}) {
    const double error = flooded_volume(mesh.positions, mesh.triangles, resolution) / exact - 1;
    CHECK(std::abs(error) < 1.5 / resolution);
  }
}

TEST_CASE("the topology of a soup counts half-edges without a partner, and handles") {
  const auto of = [](const TriangleMesh& mesh) { return soup_topology(mesh.positions, mesh.triangles); };
  TriangleMesh mesh = cube_surface(2, false);
  CHECK(of(mesh).closed_share == 1);
  CHECK(of(mesh).euler_number == 2);
  TriangleMesh soup = soup_of(mesh);
  soup.triangles.push_back({0, 0, 1});
  CHECK(of(soup).closed_share == 1);
  CHECK(of(soup).euler_number == 2);
  mesh.triangles.pop_back();
  const double num_half_edges = 3.0 * static_cast<double>(mesh.triangles.size());
  CHECK(of(mesh).closed_share == Approx((num_half_edges - 3) / num_half_edges));
  CHECK(of(mesh).euler_number == 1);
  CHECK(of(samples::torus_sample().target).euler_number == 0);
  CHECK(of(TriangleMesh{}).euler_number == 0);
}

TEST_CASE("triangles without area are dropped, positions of no triangle are ignored") {
  TriangleMesh mesh = cube_surface(2, false);
  mesh.triangles.insert(mesh.triangles.begin(), {0, 0, 1});
  mesh.positions.push_back(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  const TargetSurface target(mesh);
  CHECK(target.triangles().size() == mesh.triangles.size() - 1);
  CHECK(target.diagonal() == Approx(std::sqrt(12.)));
}

TEST_CASE("a row of needles has samples by its area, spread over its length, and not millions") {
  TriangleMesh strip;  // 1 x 1
  constexpr Index kNumNeedles = 20'000;
  for (Index i = 0; i <= kNumNeedles; ++i)
    for (const double z : {0.0, 1.0}) strip.positions.emplace_back(static_cast<double>(i) / kNumNeedles, 0, z);
  for (Index i = 0; i < kNumNeedles; ++i) {
    strip.triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
    strip.triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
  }
  const TargetSurface target(strip, {.sample_spacing = 0.01, .volume = 1});  // needles: 100 spacings long, 0.005 wide
  CHECK(target.samples().size() <= 32 * 10'000 + strip.triangles.size());
  CHECK(std::accumulate(target.sample_areas().begin(), target.sample_areas().end(), 0.0) == Approx(1));
  std::vector<double> area(400, 0);  // of squares of side 0.05
  for (std::size_t j = 0; j < target.samples().size(); ++j) {
    const Vec3& p = target.samples()[j];
    REQUIRE((p.x() > 0 && p.x() < 1 && p.z() > 0 && p.z() < 1));
    area[static_cast<std::size_t>(20 * p.x()) + 20 * static_cast<std::size_t>(20 * p.z())] += target.sample_areas()[j];
  }
  for (const double a : area) CHECK(a == Approx(1.0 / 400).epsilon(0.15));
}

TEST_CASE("samples are barycenters, or those of parts no longer than the spacing") {
  const TriangleMesh mesh = cube_surface(2, false);
  CHECK(TargetSurface(mesh).samples().size() == mesh.triangles.size());
  const TargetSurface target(mesh, {.sample_spacing = 0.3});
  CHECK(target.samples().size() > 16 * mesh.triangles.size());
  REQUIRE(target.samples().size() == target.sample_triangles().size());
  Vec3 mean = Vec3::Zero();
  for (std::size_t j = 0; j < target.samples().size(); ++j) {
    const auto& t = target.triangles()[target.sample_triangles()[j]];
    REQUIRE(std::abs((target.samples()[j] - mesh.positions[t[0]]).dot(target.normals()[target.sample_triangles()[j]])) <
            1e-15);
    mean += target.samples()[j];
  }
  CHECK((mean / static_cast<double>(target.samples().size())).norm() < 1e-12);
}

TEST_CASE("what TargetSurface refuses") {
  const TriangleMesh mesh = cube_surface(2, false);
  CHECK_THROWS_AS(TargetSurface(TriangleMesh{}), InputError);
  CHECK_THROWS_AS(TargetSurface(TriangleMesh{mesh.positions, {{0, 0, 1}}}), InputError);
  CHECK_THROWS_AS(TargetSurface(TriangleMesh{mesh.positions, {{0, 1, 10000}}}), InputError);
  CHECK_THROWS_AS(TargetSurface(mesh, {.sample_spacing = -1}), InputError);
  TriangleMesh bad = mesh;
  bad.positions[3][1] = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(TargetSurface(bad), InputError);
  for (const double far : {1e91, 1e160, 1e303, 1.7e308}) {  // whose products overflow, one after the other
    bad.positions[3][1] = far;
    CHECK_THROWS_AS(TargetSurface(bad), InputError);
    CHECK_THROWS_AS(TargetSurface(PointCloud{bad.positions}), InputError);
  }
}

TEST_CASE("a needle of next to no area is sampled along its length, not without end") {
  for (const double width : {1e-6, 1e-12, 1e-25}) {
    TriangleMesh needle{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                        {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
    for (Vec3& p : needle.positions) p = p.cwiseProduct(Vec3(1, width, width));
    FitTarget target(needle);
    target.sample(1000, 1000);
    CHECK(target.surface.samples().size() < 100000);
  }
}

TEST_CASE("thinned samples stand for equal parts of the area, all over the surface") {
  TargetSurface target(cube_surface(12, true));
  target.resample(0.05);
  const std::size_t before = target.samples().size();
  target.thin(2 * before);
  CHECK(target.samples().size() == before);

  constexpr std::size_t kMost = 500;
  target.thin(kMost);
  CHECK(target.samples().size() <= kMost);
  CHECK(target.samples().size() > kMost / 2);
  double area = 0;
  Vec3 moment = Vec3::Zero();
  for (std::size_t j = 0; j < target.samples().size(); ++j) {
    area += target.sample_areas()[j];
    moment += target.sample_areas()[j] * target.samples()[j];
    CHECK(target.sample_normals()[j] == target.normals()[target.sample_triangles()[j]]);
  }
  CHECK(area == Approx(target.area()));
  CHECK(moment.norm() / area < 0.05);
  CHECK_THROWS_AS(target.thin(0), InputError);
}
