// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/base/error.h"
#include "tests/support/threads.h"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

using Pairs = std::vector<std::array<Index, 2>>;

TriangleMesh tetrahedron(double size, const Vec3& origin) {
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  for (Vec3& p : mesh.positions) p = origin + size * p;
  return mesh;
}

void add(TriangleMesh& mesh, const TriangleMesh& more) {
  const Index first = static_cast<Index>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
  for (const auto& [a, b, c] : more.triangles) mesh.triangles.push_back({a + first, b + first, c + first});
}

}  // namespace

TEST_CASE("a closed embedded surface has no self-intersection, nor have two apart", "[self_intersection]") {
  TriangleMesh mesh = tetrahedron(1, {0, 0, 0});
  CHECK(self_intersections(mesh).empty());
  add(mesh, tetrahedron(0.1, {0.1, 0.1, 0.1}));
  add(mesh, tetrahedron(1, {2, 0, 0}));
  CHECK(self_intersections(mesh).empty());
  CHECK(self_intersections(TriangleMesh{}).empty());
}

TEST_CASE("surfaces that cross or touch are found with their triangles", "[self_intersection]") {
  TriangleMesh crossing{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, -1}, {1, 1, 1}, {2, 1, 1}}, {{0, 1, 2}, {3, 4, 5}}};
  CHECK(self_intersections(crossing).pairs == Pairs{{0, 1}});
  crossing.positions[3] = {1, 1, 0.25};
  CHECK(self_intersections(crossing).empty());
  crossing.positions[3] = {1, 1, 0};
  CHECK(self_intersections(crossing).pairs == Pairs{{0, 1}});
}

TEST_CASE("neighbors intersect only when folded or crossing beyond what they share", "[self_intersection]") {
  const std::vector<Vec3> flat = {{0, 0, 0},    {1, 0, 0},     {0, 1, 0},     {0.5, 0.5, 0},
                                  {0.5, -1, 0}, {0.3, 0.3, 1}, {0.3, 0.2, -1}};
  const auto pairs = [&](Index a, Index b, Index c) {
    return self_intersections({flat, {{0, 1, 2}, {a, b, c}}}).pairs.size();
  };
  CHECK(pairs(1, 0, 4) == 0);  // side by side in one plane
  CHECK(pairs(0, 1, 3) == 1);  // folded onto each other
  CHECK(pairs(1, 0, 5) == 0);  // a sharp edge
  CHECK(pairs(2, 1, 0) == 1);  // the same triangle turned over
  CHECK(pairs(0, 3, 5) == 1);  // one corner in common, but it reaches the opposite edge
  CHECK(pairs(0, 6, 5) == 1);  // one corner in common and an edge that crosses
  CHECK(pairs(0, 4, 5) == 0);  // nothing but the corner
  const TriangleMesh corner{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 1}, {-1, -1, 0.5}}, {{0, 1, 2}, {0, 3, 4}}};
  CHECK(self_intersections(corner).empty());
}

TEST_CASE("triangles without area are listed and take part in no pair", "[self_intersection]") {
  const TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2, 0.2, -1}, {0.2, 0.2, 1}, {0.2, 0.2, 3}},
                          {{3, 4, 5}, {0, 1, 2}, {1, 1, 2}}};
  const SelfIntersections result = self_intersections(mesh);
  CHECK(result.empty());
  CHECK(result.degenerate == std::vector<Index>{0, 2});
}

TEST_CASE("self-intersections of a soup do not depend on threads, numbering or position", "[self_intersection]") {
  std::mt19937_64 engine(4);
  std::normal_distribution<double> normal;
  TriangleMesh soup;
  for (Index t = 0; t < 400; ++t) {
    const Vec3 center = 3 * Vec3(normal(engine), normal(engine), normal(engine));
    for (int k = 0; k < 3; ++k) soup.positions.push_back(center + Vec3(normal(engine), normal(engine), normal(engine)));
    soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  test::ThreadGuard guard;
  guard.use(1);
  const Pairs one = self_intersections(soup).pairs;
  guard.use(2);
  const Pairs two = self_intersections(soup).pairs;
  CHECK(one == two);
  CHECK(one.size() > 100);
  TriangleMesh reversed = soup;
  std::reverse(reversed.triangles.begin(), reversed.triangles.end());
  for (Vec3& p : reversed.positions) p = 2 * Vec3(p[1], -p[2], p[0]);
  CHECK(self_intersections(reversed).pairs.size() == one.size());
}

TEST_CASE("many triangles round a vertex are told apart, a search in a heap has an end", "[self_intersection]") {
  // Two cones of n triangles each on one circle; then with a vertex of it drawn through to beyond the other side.
  constexpr int n = 300;
  TriangleMesh cones{{{0, 0, 1}, {0, 0, -1}}, {}};
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * M_PI * i / n;
    cones.positions.emplace_back(std::cos(angle), std::sin(angle), 0);
    const Index a = 2 + i, b = 2 + (i + 1) % n;
    cones.triangles.push_back({a, b, 0});
    cones.triangles.push_back({b, a, 1});
  }
  SelfIntersections found = self_intersections(cones);
  CHECK(found.empty());
  CHECK(found.is_complete);
  TriangleMesh bent = cones;
  bent.positions[2] = {-2, 0.004, 0.1};
  found = self_intersections(bent);
  CHECK(found.is_complete);
  CHECK(!found.empty());
  for (const auto& [t, s] : found.pairs) {
    const auto& a = bent.triangles[t];
    const auto& b = bent.triangles[s];
    CHECK((std::count(a.begin(), a.end(), 2) > 0 || std::count(b.begin(), b.end(), 2) > 0));
  }

  TriangleMesh heap;
  for (int i = 0; i < 1500; ++i) add(heap, {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  found = self_intersections(heap);
  CHECK(found.pairs.size() == kMostIntersectingPairs);
  CHECK(!found.is_complete);
  CHECK(std::is_sorted(found.pairs.begin(), found.pairs.end()));
  found = self_intersections(heap, [] { return true; });
  CHECK(!found.is_complete);
  CHECK(found.pairs.size() < kMostIntersectingPairs);
  CHECK(count_intersecting_pairs(heap, [] { return true; }) == kMostIntersectingPairs);
  CHECK(count_intersecting_pairs(bent) == self_intersections(bent).pairs.size());
}

TEST_CASE("with marked triangles, exactly the pairs with one of them are found", "[self_intersection]") {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> place(0, 3);
  TriangleMesh mesh;
  for (int i = 0; i < 30; ++i) add(mesh, tetrahedron(1.5, {place(random), place(random), place(random)}));
  std::vector<std::uint8_t> marked(mesh.triangles.size());
  for (auto& mark : marked) mark = random() % 4 == 0;
  Pairs expected;
  for (const auto& pair : self_intersections(mesh).pairs)
    if (marked[pair[0]] || marked[pair[1]]) expected.push_back(pair);
  REQUIRE(expected.size() > 20);
  CHECK(self_intersections(mesh, {}, marked).pairs == expected);
  CHECK(self_intersections(mesh, {}, std::vector<std::uint8_t>(marked.size(), 0)).empty());
  CHECK_THROWS_AS(self_intersections(mesh, {}, std::vector<std::uint8_t>(3, 1)), InputError);
}

TEST_CASE("self-intersection refuses broken surfaces", "[self_intersection]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(self_intersections({{{0, 0, 0}}, {{0, 1, 0}}}), InputError);
  CHECK_THROWS_AS(self_intersections({{{0, nan, 0}}, {{0, 0, 0}}}), InputError);
}
