// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/crisp_edges.h"
#include "subvol/surface/welded_surface.h"
#include "tests/support/feature_fixtures.h"
#include "tests/support/region_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// A block of many cells with bumps of the given height on all sides, as of a rough stone.
TriangleMesh rough_block(double height) {
  TriangleMesh mesh = surface_of(voxels(12, 12, 12, [](int, int, int) { return true; }));
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const double phase = static_cast<double>(v);
    mesh.positions[v] += height * Vec3(std::sin(17 * phase), std::sin(23 * phase), std::sin(29 * phase));
  }
  return mesh;
}

/// Returns the triangles of a mesh, each with vertices of its own.
TriangleMesh soup(const TriangleMesh& mesh) {
  TriangleMesh result;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<Index>(result.positions.size());
    for (const Index v : t) result.positions.push_back(mesh.positions[v]);
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto first = static_cast<Index>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
}

}  // namespace

TEST_CASE("A scan with a covered hole is no designed part") {
  CHECK_FALSE(EdgeCrispness{.crisp_share = 0.77, .relative_length = 3.64}.is_designed());
  CHECK(EdgeCrispness{.crisp_share = 0.77, .relative_length = 4.5}.is_designed());
}

TEST_CASE("edges of parts are followed, bends of rough surfaces are not") {
  const TriangleMesh cube = cube_surface(2, false);
  CHECK(has_edges_to_follow(cube, 40, false));
  CHECK_FALSE(has_edges_to_follow(cube, std::nullopt, true));
  CHECK_FALSE(has_edges_to_follow(cube, 100, true));
  const TriangleMesh stone = rough_block(0.3);
  CHECK(has_edges_to_follow(stone, 40, true));
  CHECK_FALSE(has_edges_to_follow(stone, 40, false));
  CHECK(decide_about_edges(cube, 40, false).warning.empty());
  CHECK(edge_crispness(cube, feature_curves(cube, 40)).crisp_share == Approx(1));
}

TEST_CASE("edges that bound planes are followed beside coarse roundings") {
  // A cylinder of ten sides: its sides bend by 36 degrees, more than a third of the angle at its rims.
  constexpr int kSides = 10;
  TriangleMesh cylinder;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    for (const double z : {0.0, 1.0}) cylinder.positions.push_back({std::cos(angle), std::sin(angle), z});
  }
  for (Index i = 0; i < kSides; ++i) {
    const Index a = 2 * i, b = 2 * ((i + 1) % kSides);
    cylinder.triangles.push_back({a, b, b + 1});
    cylinder.triangles.push_back({a, b + 1, a + 1});
    if (i == 0 || i == kSides - 1) continue;
    cylinder.triangles.push_back({0, b, a});
    cylinder.triangles.push_back({1, a + 1, b + 1});
  }
  const EdgeCrispness crispness = edge_crispness(cylinder, feature_curves(cylinder, 40));
  CHECK(crispness.crisp_share == Approx(0).margin(1e-12));
  CHECK(crispness.planar_share == Approx(1));
  CHECK(has_edges_to_follow(cylinder, 40, false));
}

TEST_CASE("Edges sharper than a right angle are crisp, whatever way their triangles run") {
  // A blade with an edge of 10 degrees: each of its sides bends by 5 degrees beside the edge.
  constexpr double kHalf = 5 * std::numbers::pi / 180;
  TriangleMesh blade;
  for (const double y : {0.0, 4.0}) {
    for (const double x : {0.0, 1.0, 2.0}) {
      const double bent = x < 2 ? x * std::tan(kHalf) : std::tan(kHalf) + std::tan(2 * kHalf);
      blade.positions.push_back({x, y, bent});
      blade.positions.push_back({x, y, -bent});
    }
  }
  const auto quad = [&](Index a, Index b, Index c, Index d) {
    blade.triangles.push_back({a, b, c});
    blade.triangles.push_back({a, c, d});
  };
  const Index next = 6;  // from one end of the blade to the other
  quad(0, next, next + 2, 2);
  quad(2, next + 2, next + 4, 4);
  quad(0, 3, next + 3, next);
  quad(3, 5, next + 5, next + 3);
  quad(4, next + 4, next + 5, 5);
  const FeatureCurves curves = feature_curves(blade, 40);
  REQUIRE(curves.curves.size() == 3);  // the edge of the blade, and those of its back
  CHECK(edge_crispness(blade, curves).crisp_share == Approx(1));
  std::swap(blade.triangles[0][0], blade.triangles[0][1]);
  std::swap(blade.triangles[1][0], blade.triangles[1][1]);
  CHECK(edge_crispness(blade, curves).crisp_share == Approx(1));
}

TEST_CASE("Faces with vertices of their own are joined, closed parts that touch are not") {
  const TriangleMesh box = box_surface(Vec3::Zero(), Vec3(1, 2, 3));
  const TriangleMesh joined = joined_at_open_edges(soup(box));
  CHECK(feature_curves(soup(box), 40).curves.empty());
  CHECK(feature_curves(joined, 40).curves.size() == 12);
  CHECK(joined.positions.size() == 3 * box.triangles.size());
  TriangleMesh touching = box;
  append(touching, box_surface(Vec3(1, 0, 0), Vec3(2, 2, 3)));
  CHECK(joined_at_open_edges(touching).triangles == touching.triangles);
  TriangleMesh wrong = box;
  wrong.triangles[0][0] = 1000;
  CHECK(joined_at_open_edges(wrong).triangles == wrong.triangles);
}

TEST_CASE("Edges are judged by the size of their part") {
  TriangleMesh boxes = box_surface(Vec3::Zero(), Vec3::Ones());
  append(boxes, box_surface(Vec3(1000, 0, 0), Vec3(1001, 1, 1)));
  CHECK(has_edges_to_follow(boxes, 40, false));
}
