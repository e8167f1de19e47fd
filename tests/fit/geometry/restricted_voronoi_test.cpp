// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/restricted_voronoi.h"

#include "subvol/base/error.h"
#include "tests/support/surface_fixtures.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

// Shares of a triangle are sums of some tens of terms of size 1 with relative errors of 1e-16.
constexpr double kCoverTolerance = 1e-13;
constexpr double kPieceTolerance = 1e-12;

using Polygon = std::vector<Vec3>;  // of barycentric coordinates

/// The slow twin: the triangle, clipped by the bisectors with all other sites in turn.
Polygon clip_by_all(const std::vector<Vec3>& sites, Index site, const std::array<Vec3, 3>& corners) {
  Polygon polygon{Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
  for (const Vec3& other : sites) {
    Vec3 height;
    for (int k = 0; k < 3; ++k)
      height[k] = (corners[k] - sites[site]).squaredNorm() - (corners[k] - other).squaredNorm();
    Polygon rest;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec3 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
      const double hp = height.dot(p), hq = height.dot(q);
      if (hp <= 0) rest.push_back(p);
      if ((hp < 0 && hq > 0) || (hp > 0 && hq < 0)) rest.push_back(p + hp / (hp - hq) * (q - p));
    }
    polygon = rest;
  }
  return polygon;
}

/// Moments by the midpoints of the edges of a fan, which is exact for quadratics.
std::array<double, 6> polygon_moments(const Polygon& polygon) {
  std::array<double, 6> m{};
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const Vec3 &a = polygon[0], &b = polygon[i], &c = polygon[i + 1];
    const double share = (b - a).cross(c - a).dot(Vec3(1, 1, 1)) / 3;
    for (const Vec3& middle : {Vec3(0.5 * (a + b)), Vec3(0.5 * (b + c)), Vec3(0.5 * (c + a))}) {
      int slot = 0;
      for (int p = 0; p < 3; ++p)
        for (int q = p; q < 3; ++q) m[slot++] += share / 3 * middle[p] * middle[q];
    }
  }
  return m;
}

std::array<Vec3, 3> corners_of(const TriangleMesh& mesh, std::size_t t) {
  const auto& v = mesh.triangles[t];
  return {mesh.positions[v[0]], mesh.positions[v[1]], mesh.positions[v[2]]};
}

/// Greatest error of any triangle's covered share.
double cover_error(const TriangleMesh& mesh, const std::vector<VoronoiPiece>& pieces) {
  std::vector<double> cover(mesh.triangles.size(), 0.0);
  for (const VoronoiPiece& piece : pieces) cover[piece.triangle] += piece.share();
  double worst = 0;
  for (double c : cover) worst = std::max(worst, std::abs(c - 1));
  return worst;
}

void compare_with_twin(const TriangleMesh& mesh, const std::vector<Vec3>& sites) {
  const auto pieces = RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles);
  std::size_t p = 0;
  double worst = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t s = 0; s < sites.size(); ++s) {
      const auto expected = polygon_moments(clip_by_all(sites, static_cast<Index>(s), corners_of(mesh, t)));
      std::array<double, 6> found{};
      if (p < pieces.size() && pieces[p].triangle == static_cast<Index>(t) && pieces[p].site == static_cast<Index>(s))
        found = pieces[p++].moments;
      for (int k = 0; k < 6; ++k) worst = std::max(worst, std::abs(found[k] - expected[k]));
    }
  CHECK(p == pieces.size());  // ordered by triangle, then site, each pair once
  CHECK(worst < kPieceTolerance);
  CHECK(cover_error(mesh, pieces) < kCoverTolerance);
}

/// F = sum over pieces of the integral of the squared distance to the site.
double squared_distance_integral(const TriangleMesh& mesh, const std::vector<Vec3>& sites,
                                 const std::vector<VoronoiPiece>& pieces) {
  double sum = 0;
  for (const VoronoiPiece& piece : pieces) {
    const auto c = corners_of(mesh, piece.triangle);
    const double area = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l)
        sum += area * piece.moment(k, l) * (c[k] - sites[piece.site]).dot(c[l] - sites[piece.site]);
  }
  return sum;
}

/// The same by brute force: nearest sites of a fine grid of points of every triangle.
double sampled_distance_integral(const TriangleMesh& mesh, const std::vector<Vec3>& sites, int n) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto c = corners_of(mesh, t);
    const double area = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < 2 * (n - i) - 1; ++j) {
        const double u = (i + (j % 2 ? 2. / 3 : 1. / 3)) / n, v = (j / 2 + (j % 2 ? 2. / 3 : 1. / 3)) / n;
        const Vec3 x = c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
        double least = std::numeric_limits<double>::infinity();
        for (const Vec3& s : sites) least = std::min(least, (x - s).squaredNorm());
        sum += area / (n * n) * least;
      }
  }
  return sum;
}

bool same_bits(const std::vector<VoronoiPiece>& a, const std::vector<VoronoiPiece>& b) {
  using Bits = std::array<std::uint64_t, 6>;
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), [](const auto& p, const auto& q) {
           return p.triangle == q.triangle && p.site == q.site &&
                  std::bit_cast<Bits>(p.moments) == std::bit_cast<Bits>(q.moments);
         });
}

}  // namespace

TEST_CASE("nearest_site agrees with a scan over all sites, for every number of sites") {
  RandomPoints random(1);
  for (std::size_t n : {1, 2, 7, 8, 9, 63, 64, 65, 500, 513, 5000}) {
    const auto sites = random.points(n);
    const RestrictedVoronoi voronoi(sites);
    for (int q = 0; q < 200; ++q) {
      const Vec3 point = random.point(q % 2 ? 1 : 20);
      std::size_t best = 0;
      for (std::size_t s = 1; s < n; ++s)
        if ((sites[s] - point).squaredNorm() < (sites[best] - point).squaredNorm()) best = s;
      REQUIRE(voronoi.nearest_site(point) == static_cast<Index>(best));
    }
  }
}

TEST_CASE("equally near sites: the lowest number wins") {
  const std::vector<Vec3> sites{{5, 0, 0}, {1, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}};
  CHECK(RestrictedVoronoi(sites).nearest_site(Vec3(1, 0, 0)) == 1);
  CHECK(RestrictedVoronoi(std::vector<Vec3>(100, Vec3(1, 2, 3))).nearest_site(Vec3(0, 0, 0)) == 0);
}

TEST_CASE("pieces agree with clipping by all sites") {
  const int num_sites = GENERATE(1, 2, 30, 200);
  const double size = GENERATE(0.05, 0.3, 1.0);
  CAPTURE(num_sites, size);
  RandomPoints random(static_cast<unsigned>(num_sites));
  compare_with_twin(triangle_soup(60, size, 3), random.points(static_cast<std::size_t>(num_sites)));
}

TEST_CASE("pieces agree with clipping by all sites when the sites are far away") {
  const double distance = GENERATE(2.0, 10.0, 100.0);
  RandomPoints random(5);
  std::vector<Vec3> sites;
  for (int i = 0; i < 400; ++i) sites.push_back(distance * random.point().normalized() + random.point());
  compare_with_twin(triangle_soup(30, 1, 7), sites);
}

TEST_CASE("many cells in one triangle are all found") {
  const unsigned seed = GENERATE(9, 10, 11);
  RandomPoints random(seed);
  TriangleMesh mesh{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, {{0, 1, 2}}};
  std::vector<Vec3> sites;
  for (int i = 0; i < 1500; ++i)
    sites.push_back(Vec3(random.number(0, 1), random.number(0, 1), 0.01 * random.number()));
  compare_with_twin(mesh, sites);
}

TEST_CASE("the surface is covered when bisectors run through vertices and along edges") {
  // Mirror-symmetric sites and targets; sites on the target's vertices, on its edges, and around it.
  const bool round = GENERATE(false, true);
  const int n = GENERATE(4, 8, 16), m = GENERATE(2, 4, 8, 16);
  const double scale = GENERATE(0.5, 1.0, 1.25);
  CAPTURE(round, n, m, scale);
  const TriangleMesh mesh = cube_surface(n, round);
  std::vector<Vec3> sites = cube_surface(m, true).positions;
  for (Vec3& s : sites) s *= scale;
  const auto pieces = RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles);
  CHECK(cover_error(mesh, pieces) < kCoverTolerance);
}

TEST_CASE("the integral of the squared distance is right in a mirror-symmetric configuration") {
  const TriangleMesh mesh = cube_surface(4, false);
  std::vector<Vec3> sites = cube_surface(4, true).positions;
  for (Vec3& s : sites) s *= 1.3;
  const auto pieces = RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles);
  const double exact = squared_distance_integral(mesh, sites, pieces);
  // Error of the midpoint rule with 256 points a triangle.
  CHECK(sampled_distance_integral(mesh, sites, 16) == Approx(exact).epsilon(2e-3));
}

TEST_CASE("a lattice of sites on a plane aligned with it gives every site its square") {
  const int n = 8;
  TriangleMesh mesh;
  std::vector<Vec3> sites;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      mesh.positions.push_back(Vec3(i, j, 0));
      for (int k : {0, 1}) sites.push_back(Vec3(i, j, k ? -0.5 : 0.5));  // two as near as each other everywhere
    }
  const auto at = [&](int i, int j) { return static_cast<Index>(i * (n + 1) + j); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  const auto pieces = RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles);
  CHECK(cover_error(mesh, pieces) < kCoverTolerance);
  std::vector<double> area((n + 1) * (n + 1), 0.0);
  for (const VoronoiPiece& piece : pieces) area[piece.site / 2] += 0.5 * piece.share();
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      const double expected = (i % n ? 1 : 0.5) * (j % n ? 1 : 0.5);
      REQUIRE(std::abs(area[at(i, j)] - expected) < kPieceTolerance);
    }
}

TEST_CASE("moments of a half triangle have their closed form") {
  const TriangleMesh mesh{{Vec3(0, 0, 0), Vec3(2, 0, 0), Vec3(0, 2, 0)}, {{0, 1, 2}}};
  // The bisector x = 1 cuts off the corner of lambda_1, a quarter of the area.
  const std::vector<Vec3> sites{{0.5, 0.3, 3}, {1.5, 0.3, 3}};
  const auto pieces = RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles);
  REQUIRE(pieces.size() == 2);
  CHECK(pieces[1].share() == Approx(0.25));
  // Its corners are (1/2, 1/2, 0), (0, 1, 0) and (0, 1/2, 1/2).
  const double third = 1. / 3;
  CHECK(pieces[1].first_moment(0) == Approx(0.25 * 0.5 * third));
  CHECK(pieces[1].first_moment(1) == Approx(0.25 * 2 * third));
  CHECK(pieces[1].moment(0, 0) == Approx(0.25 * 0.25 / 6));
  CHECK(pieces[1].moment(0, 2) == Approx(0.25 * 0.25 / 12));
  CHECK(pieces[0].moment(1, 1) + pieces[1].moment(1, 1) == Approx(1. / 6));
}

TEST_CASE("equal sites, sites on triangles and triangles without area") {
  TriangleMesh mesh = cube_surface(4, false);
  std::vector<Vec3> sites = mesh.positions;
  for (int k = 0; k < 2; ++k) sites.insert(sites.end(), mesh.positions.begin(), mesh.positions.end());
  const std::size_t n = mesh.positions.size(), num_good = mesh.triangles.size();
  mesh.triangles.push_back({0, 0, 1});
  mesh.triangles.push_back({2, 2, 2});
  auto pieces = RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles);
  for (const VoronoiPiece& piece : pieces) {
    REQUIRE(piece.triangle < static_cast<Index>(num_good));
    REQUIRE(piece.site < static_cast<Index>(n));
  }
  mesh.triangles.resize(num_good);
  CHECK(cover_error(mesh, pieces) < kCoverTolerance);
}

TEST_CASE("sites that differ by roundings share the surface without loss") {
  const TriangleMesh mesh = cube_surface(4, true);
  RandomPoints random(13);
  const double distance = GENERATE(1e-16, 1e-15, 1e-14, 1e-12, 1e-9);
  CAPTURE(distance);
  std::vector<Vec3> sites;
  for (const Vec3& p : mesh.positions)
    for (int k = 0; k < 4; ++k) sites.push_back(1.1 * p + random.point(distance));
  CHECK(cover_error(mesh, RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles)) < kCoverTolerance);
}

TEST_CASE("all sites as near as each other: the sphere's center is no trap") {
  TriangleMesh mesh = cube_surface(6, false);
  for (Vec3& p : mesh.positions) p *= 1e-3;
  const std::vector<Vec3> sites = cube_surface(12, true).positions;
  CHECK(cover_error(mesh, RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles)) < kCoverTolerance);
}

TEST_CASE("one site has everything") {
  const TriangleMesh mesh = cube_surface(4, true);
  const auto pieces = RestrictedVoronoi(std::vector<Vec3>{{3, 4, 5}}).compute(mesh.positions, mesh.triangles);
  REQUIRE(pieces.size() == mesh.triangles.size());
  for (const VoronoiPiece& piece : pieces) REQUIRE(piece.share() == Approx(1).epsilon(1e-15));
}

TEST_CASE("pieces have the same bits for one and two threads, and after moving the sites there and back") {
  const TriangleMesh mesh = cube_surface(40, true);
  RandomPoints random(17);
  std::vector<Vec3> sites = random.points(3000, 1.2);
  test::ThreadGuard guard;
  guard.use(1);
  RestrictedVoronoi voronoi(sites);
  const auto one = voronoi.compute(mesh.positions, mesh.triangles);
  guard.use(2);
  const auto two = voronoi.compute(mesh.positions, mesh.triangles);
  CHECK(same_bits(one, two));
  for (double step : {1e-3, 1.0}) {
    auto moved = sites;
    for (Vec3& s : moved) s += random.point(step);
    voronoi.update_sites(moved);
    CHECK(same_bits(voronoi.compute(mesh.positions, mesh.triangles),
                    RestrictedVoronoi(moved).compute(mesh.positions, mesh.triangles)));
  }
  voronoi.update_sites(sites);
  CHECK(same_bits(one, voronoi.compute(mesh.positions, mesh.triangles)));
}

TEST_CASE("permuting the triangles only permutes the pieces") {
  TriangleMesh mesh = triangle_soup(500, 0.3, 19);
  RandomPoints random(23);
  const auto sites = random.points(300);
  const RestrictedVoronoi voronoi(sites);
  auto forward = voronoi.compute(mesh.positions, mesh.triangles);
  std::reverse(mesh.triangles.begin(), mesh.triangles.end());
  auto backward = voronoi.compute(mesh.positions, mesh.triangles);
  for (VoronoiPiece& piece : backward) piece.triangle = static_cast<Index>(mesh.triangles.size()) - 1 - piece.triangle;
  std::stable_sort(backward.begin(), backward.end(),
                   [](const auto& a, const auto& b) { return a.triangle < b.triangle; });
  CHECK(same_bits(forward, backward));
}

TEST_CASE("a far origin costs no area") {
  TriangleMesh mesh = cube_surface(8, true);
  std::vector<Vec3> sites = cube_surface(4, true).positions;
  for (Vec3& p : mesh.positions) p += Vec3(1e6, -1e6, 1e6);
  for (Vec3& s : sites) s += Vec3(1e6, -1e6, 1e6);
  CHECK(cover_error(mesh, RestrictedVoronoi(sites).compute(mesh.positions, mesh.triangles)) < kCoverTolerance);
}

TEST_CASE("what RestrictedVoronoi refuses") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(RestrictedVoronoi(std::vector<Vec3>{}), InputError);
  CHECK_THROWS_AS(RestrictedVoronoi(std::vector<Vec3>{Vec3(0, nan, 0)}), InputError);
  RestrictedVoronoi voronoi(std::vector<Vec3>{Vec3(0, 0, 0)});
  CHECK_THROWS_AS(voronoi.update_sites(std::vector<Vec3>(2, Vec3(0, 0, 0))), InputError);
  const std::vector<Vec3> positions(3, Vec3(0, 0, 0));
  const std::vector<std::array<Index, 3>> triangles{{0, 1, 3}};
  CHECK_THROWS_AS(voronoi.compute(positions, triangles), InputError);
  std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {nan, 1, 0}};
  CHECK_THROWS_AS(voronoi.compute(square, std::vector<std::array<Index, 3>>{{0, 2, 3}}), InputError);
  CHECK(voronoi.compute(square, std::vector<std::array<Index, 3>>{{0, 1, 2}}).size() == 1);
}
