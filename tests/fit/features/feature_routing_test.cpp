// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/feature_routing.h"
#include "subvol/base/error.h"
#include "subvol/fit/features/corner_clusters.h"
#include "subvol/fit/features/corner_placement.h"
#include "subvol/fit/features/joined_curves.h"
#include "subvol/fit/features/not_followed.h"
#include "subvol/fit/features/polyline.h"
#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/geometry/closest_point.h"
#include "tests/support/feature_fixtures.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// A block of n^3 cells with a smaller one of half the width and the given height on its top, both in one piece.
TriangleMesh block_with_step(double height) {
  VolumeMesh mesh = voxels(4, 4, 5, [](int i, int j, int k) { return k < 4 || (i < 2 && j < 2); });
  for (Vec3& p : mesh.positions) p = Vec3(p.x() / 2 - 1, p.y() / 2 - 1, p.z() > 4 ? 1 + height : p.z() / 2 - 1);
  return surface_of(mesh);
}

/// No edge, and no vertex but the ends, is in two paths.
void require_apart(const FeatureRouting& routing) {
  std::set<Index> inner;
  std::set<std::array<Index, 2>> edges;
  for (const CreasePath& path : routing.paths)
    for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i) {
      const auto [v, w] = std::minmax(path.vertices[i], path.vertices[i + 1]);
      CHECK(edges.insert({v, w}).second);
      if (i > 0) CHECK(inner.insert(path.vertices[i]).second);
    }
  for (const CreasePath& path : routing.paths)
    if (!std::ranges::binary_search(routing.joined, path.curve) && path.vertices.front() != path.vertices.back())
      for (Index end : {path.vertices.front(), path.vertices.back()}) CHECK_FALSE(inner.contains(end));
}

}  // namespace

TEST_CASE("a lattice in a cube follows all of its edges, corner to corner") {
  const TriangleMesh target = cube_surface(2, false);
  const RoutedLattice cube(target, 4);
  REQUIRE(cube.routing.paths.size() == 12);
  CHECK(cube.routing.unfollowed.empty());
  CHECK(cube.routing.joined.empty());
  CHECK(cube.routing.corners.size() == 8);
  require_apart(cube.routing);
  for (const CreasePath& path : cube.routing.paths) {
    CHECK(path.vertices.size() == 5);
    const FeatureCurve& curve = cube.features.curves.curves[path.curve];
    CHECK(cube.fitted.positions[path.vertices.front()].isApprox(curve.points.front()));
    CHECK(cube.fitted.positions[path.vertices.back()].isApprox(curve.points.back()));
  }
  for (const PlacedCorner& placed : cube.routing.corners)
    CHECK(cube.fitted.positions[placed.vertex].isApprox(target.positions[placed.corner]));
}

TEST_CASE("corners of small features give way to a long edge") {
  VolumeMesh mesh = voxels(8, 8, 8, [](int, int, int) { return true; });
  // A long edge, and three curves that start beside it: their corners' nearest vertices block the edge and all ways
  // around that are near it.
  SignedFeatures features;
  const auto add = [&](const Vec3& from, const Vec3& to, double angle) {
    const auto first = static_cast<Index>(2 * features.angles.size());
    features.curves.curves.push_back({{first, first + 1}, {from, to}});
    features.curves.corners.insert(features.curves.corners.end(), {first, first + 1});
    features.curves.corner_edges.insert(features.curves.corner_edges.end(), {1, 1});
    features.segment_angles.push_back({angle});
    features.angles.push_back(angle);
  };
  add({0, 0, 8}, {8, 0, 8}, 90);
  add({4.1, 0.45, 8}, {7, 4, 8}, 170);
  add({4, 1.1, 8}, {4, 6, 8}, 170);
  add({4, 0, 6.9}, {4, 0, 2}, 170);
  const FeatureRouting routing = route_features(mesh, features);
  REQUIRE(routing.paths.size() == 4);
  CHECK(routing.unfollowed.empty());
  require_apart(routing);
  CHECK(routing.paths[0].vertices.size() == 9);
  for (const Index v : routing.paths[0].vertices) CHECK(mesh.positions[v].tail<2>() == Eigen::Vector2d(0, 8));
  const auto corner = std::ranges::find(routing.corners, 2, &PlacedCorner::corner);
  REQUIRE(corner != routing.corners.end());
  CHECK(mesh.positions[corner->vertex] == Vec3(5, 1, 8));
}

TEST_CASE("paths follow the edges of a prism, a tetrahedron and the rims of a cylinder") {
  CHECK(RoutedLattice(prism_surface(3, 0.2), 6).routing.unfollowed.empty());
  CHECK(RoutedLattice(tetrahedron_surface(), 6).routing.unfollowed.empty());
  const RoutedLattice cylinder(prism_surface(32), 4);
  REQUIRE(cylinder.features.angles.size() == 2);
  REQUIRE(cylinder.routing.paths.size() == 2);
  CHECK(cylinder.routing.corners.empty());
  for (const CreasePath& path : cylinder.routing.paths) {
    CHECK(path.vertices.size() == 17);
    CHECK(path.vertices.front() == path.vertices.back());
  }
  require_apart(cylinder.routing);
}

TEST_CASE("the reflex edge of an L prefers the edge of three cells") {
  // The target's reflex edge lies halfway between that edge and those of two cells beside it.
  VolumeMesh mesh = voxels(6, 6, 6, [](int i, int j, int) { return i < 3 || j < 3; });
  TriangleMesh target = surface_of(mesh);
  for (Vec3& p : target.positions)
    if (p.x() == 3 && p.y() >= 3) p.x() = 2.5;
  const SignedFeatures features = features_of(target);
  const FeatureRouting routing = route_features(mesh, features);
  CHECK(routing.unfollowed.empty());
  const MeshTopology topology(mesh);
  for (const CreasePath& path : routing.paths)
    for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i)
      CHECK(topology.num_edge_cells(topology.find_edge(path.vertices[i], path.vertices[i + 1])) ==
            (features.is_convex(path.curve) ? 1 : 3));
}

TEST_CASE("curves that are not followed have a reason and a place") {
  const VolumeMesh mesh = centered_lattice(4);
  const auto reasons = [&](const TriangleMesh& target, const RoutingOptions& options = {}) {
    std::map<NotFollowed, int> count;
    const SignedFeatures features = features_of(target);
    const FeatureRouting routing = route_features(mesh, features, options);
    CHECK(routing.paths.size() + routing.unfollowed.size() == features.angles.size());
    for (const UnfollowedCurve& lost : routing.unfollowed) {
      ++count[lost.reason];
      const ClosestPoint tree = polyline_tree(features.curves.curves[lost.curve].points);
      CHECK(tree.closest(lost.place).distance < 1e-12);
      CHECK_FALSE(to_string(lost.reason).empty());
    }
    return count;
  };
  CHECK(reasons(cube_surface(2, false)).empty());
  CHECK(reasons(block_with_step(0.1)).count(NotFollowed::shorter_than_cell) == 1);
  TriangleMesh far = cube_surface(2, false);
  for (Vec3& p : far.positions) p.x() += 10;
  CHECK(reasons(far) == std::map<NotFollowed, int>{{NotFollowed::no_vertex_at_corner, 12}});
  RoutingOptions options;
  options.excluded.assign(12, 0);
  options.excluded[3] = 1;
  CHECK(reasons(cube_surface(2, false), options) == std::map<NotFollowed, int>{{NotFollowed::excluded, 1}});
  // A wedge of 10 degrees.
  TriangleMesh wedge = prism_surface(3);
  for (Vec3& p : wedge.positions) p.y() *= 0.15;
  CHECK(reasons(wedge)[NotFollowed::too_acute] == 1);
}

TEST_CASE("where a vertex has fewer edges than its corner, a curve joins its neighbor") {
  // A cube whose top has a ridge from corner to corner; the corner vertices of its lattice have three edges.
  const auto ridged = [](VolumeMesh mesh) {
    for (Vec3& p : mesh.positions)
      if (p.z() > -1) p.z() -= (p.z() + 1) / 4 * std::abs(p.x() - p.y());
    return mesh;
  };
  const VolumeMesh fitted = ridged(centered_lattice(6));
  TriangleMesh target = surface_of(ridged(centered_lattice(1)));
  const SignedFeatures features = features_of(target);
  REQUIRE(features.angles.size() == 13);
  const FeatureRouting routing = route_features(fitted, features);
  CHECK(routing.paths.size() == 13);
  REQUIRE(routing.joined.size() == 1);
  require_apart(routing);
  const FeatureCurves parts = followed_parts(fitted, features, routing);
  for (std::size_t c = 0; c < parts.curves.size(); ++c) {
    const FeatureCurve &part = parts.curves[c], &whole = features.curves.curves[c];
    const bool is_joined = static_cast<Index>(c) == routing.joined[0];
    CHECK((part.points == whole.points) == !is_joined);
    CHECK_FALSE(part.closed());
    CHECK(part.vertices.size() == part.points.size());
    if (!is_joined) continue;
    // Both ends are on curves whose paths it joins.
    double nearest = 1;
    for (std::size_t other = 0; other < parts.curves.size(); ++other)
      if (other != c)
        nearest = std::min(nearest, polyline_tree(parts.curves[other].points).closest(part.points[0]).distance);
    CHECK(nearest < 1e-12);
    CHECK(part.length() < whole.length() + 0.5);
  }
  RoutingOptions options;
  options.not_joined.assign(13, 1);
  const FeatureRouting apart = route_features(fitted, features, options);
  CHECK(apart.joined.empty());
  REQUIRE(apart.unfollowed.size() == 1);
  CHECK(apart.unfollowed[0].curve == routing.joined[0]);
}

TEST_CASE("two curves may join a third one at the same vertex") {
  // The middle one of three paths; the others leave it at its second vertex.
  VolumeMesh mesh;
  for (int i = 0; i < 5; ++i) mesh.positions.push_back({static_cast<double>(i), 0, 0});
  for (const double y : {1.0, -1.0})
    for (int i = 2; i < 5; ++i) mesh.positions.push_back({static_cast<double>(i), y, 0});
  SignedFeatures features;
  const auto add = [&](std::vector<Index> vertices, std::vector<Vec3> points) {
    features.curves.curves.push_back({std::move(vertices), std::move(points)});
  };
  add({10, 11}, {{4, 1, 0}, {0, 0, 0}});  // ends where the next one begins
  add({11, 12}, {{0, 0, 0}, {4, 0, 0}});
  add({11, 13}, {{0, 0, 0}, {4, -1, 0}});
  FeatureRouting routing;
  routing.paths = {{0, {7, 6, 5, 1}}, {1, {0, 1, 2, 3, 4}}, {2, {1, 8, 9, 10}}};
  routing.joined = {0, 2};
  routing.corners = {{11, 0}, {12, 4}, {10, 7}, {13, 10}};
  const FeatureCurves parts = followed_parts(mesh, features, routing);
  CHECK(parts.curves[0].points.back().isApprox(Vec3(1, 0, 0)));
  CHECK(parts.curves[2].points.front().isApprox(Vec3(1, 0, 0)));
  CHECK(parts.curves[1].points == features.curves.curves[1].points);
  // Beyond the junction, each keeps its own course.
  for (const std::size_t c : {std::size_t{0}, std::size_t{2}}) {
    const std::vector<Vec3>& points = parts.curves[c].points;
    REQUIRE(points.size() == 3);
    const double y = c == 0 ? 1 : -1;
    CHECK(points[1].isApprox(Vec3(4, y, 0) / std::sqrt(17)));
    CHECK(points[c == 0 ? 0 : 2].isApprox(Vec3(4, y, 0)));
  }
}

TEST_CASE("curves that leave the mesh are followed as far as it reaches") {
  // The cube ends two edges of the lattice beyond it: no vertex is near its corners there.
  constexpr double kEnd = 2;
  TriangleMesh target = cube_surface(2, false);
  for (Vec3& p : target.positions)
    if (p.x() > 0.9) p.x() = kEnd;
  const VolumeMesh mesh = centered_lattice(4);
  const SignedFeatures features = features_of(target);
  const FeatureRouting routing = route_features(mesh, features);
  REQUIRE(routing.parts.size() == 4);
  CHECK(routing.paths.size() == 8);
  CHECK(routing.unfollowed.size() == 8);
  CHECK(routing.joined.empty());
  require_apart(routing);
  const FeatureCurves followed = followed_parts(mesh, features, routing);
  for (const FollowedPart& part : routing.parts) {
    const FeatureCurve &whole = features.curves.curves[part.curve], &curve = followed.curves[part.curve];
    CHECK(part.to - part.from < whole.length());
    CHECK(curve.length() == Approx(part.to - part.from));
    CHECK(curve.vertices.size() == curve.points.size());
    const auto lost = std::ranges::find(routing.unfollowed, part.curve, &UnfollowedCurve::curve);
    REQUIRE(lost != routing.unfollowed.end());
    CHECK(lost->length == Approx(whole.length() - (part.to - part.from)));
    CHECK(lost->place.x() > 1);
    CHECK(polyline_length(lost->points) == Approx(lost->length));
  }
  double whole = 0, all = 0;
  for (const FeatureCurve& curve : features.curves.curves) all += curve.length();
  for (const CreasePath& path : routing.paths) whole += features.curves.curves[path.curve].length();
  CHECK(routed_share(routing, features.curves) < whole / all);
}

TEST_CASE("an edge that is blocked in the middle is followed on both sides") {
  const TriangleMesh target = cube_surface(2, false);
  VolumeMesh mesh = centered_lattice(16);
  const SignedFeatures features = features_of(target);
  const double h = 2.0 / 16;
  for (Vec3& p : mesh.positions)  // a notch across the edge at x = z = 1
    if (p.x() > 0.5 && p.z() > 0.5 && std::abs(p.y()) < 1.5 * h) p -= Vec3(2 * h, 0, 2 * h);
  const FeatureRouting routing = route_features(mesh, features);
  CHECK(routing.paths.size() == 13);
  REQUIRE(routing.parts.size() == 2);
  REQUIRE(routing.unfollowed.size() == 1);
  const Index c = routing.parts[0].curve;
  CHECK(routing.parts[1].curve == c);
  CHECK(routing.parts[0].from == 0);
  CHECK(routing.parts[0].to < routing.parts[1].from);
  CHECK(routing.parts[1].to == Approx(2));
  const UnfollowedCurve& lost = routing.unfollowed[0];
  CHECK(lost.curve == c);
  CHECK(std::abs(lost.place.y()) < 2 * h);
  CHECK(lost.length == Approx(routing.parts[1].from - routing.parts[0].to));
  require_apart(routing);
  const FeatureCurves followed = followed_parts(mesh, features, routing);
  REQUIRE(followed.curves.size() == 13);
  const std::vector<CreasePath> paths = paths_of_parts(routing.paths, 12);
  std::set<Index> names;
  for (const CreasePath& path : paths) {
    names.insert(path.curve);
    const ClosestPoint tree = polyline_tree(followed.curves[path.curve].points);
    for (const Index v : path.vertices) CHECK(tree.closest(mesh.positions[v]).distance <= 1.1 * h * 1.3);
  }
  CHECK(names.size() == 13);
}

TEST_CASE("a closed curve that is blocked in one place is followed around the rest") {
  // The lattice of a cylinder has a notch, where no vertex is near its two circles.
  const TriangleMesh target = prism_surface(24, 0.1);
  VolumeMesh mesh = centered_lattice(8);
  for (Vec3& p : mesh.positions) {  // the square becomes a disk
    const double square = std::max(std::abs(p.x()), std::abs(p.y())), round = std::hypot(p.x(), p.y());
    if (round > 0) p.x() *= square / round, p.y() *= square / round;
  }
  const SignedFeatures features = features_of(target);
  REQUIRE(features.curves.curves.size() == 2);
  CHECK(route_features(mesh, features).parts.empty());
  const double h = RoutingGraph(mesh).edge_length();
  for (Vec3& p : mesh.positions)
    if (p.x() > 0.8 && std::abs(p.y()) < 1.5 * h) p.x() -= 1.5 * h;
  const FeatureRouting routing = route_features(mesh, features);
  REQUIRE(routing.parts.size() == 2);
  CHECK(routing.unfollowed.size() == 2);
  require_apart(routing);
  const FeatureCurves followed = followed_parts(mesh, features, routing);
  for (std::size_t i = 0; i < routing.parts.size(); ++i) {
    const FollowedPart& part = routing.parts[i];
    const FeatureCurve &whole = features.curves.curves[part.curve], &curve = followed.curves[part.curve];
    const UnfollowedCurve& lost = routing.unfollowed[i];
    CHECK(whole.closed());
    CHECK_FALSE(curve.closed());
    CHECK(curve.vertices.size() == curve.points.size());
    CHECK(curve.length() == Approx(part.to - part.from));
    CHECK(lost.curve == part.curve);
    CHECK(lost.length + curve.length() == Approx(whole.length()));
    CHECK(polyline_length(lost.points) == Approx(lost.length));
    CHECK(lost.place.x() > 0.5);
    CHECK(routing.paths[i].vertices.front() != routing.paths[i].vertices.back());
  }
}

TEST_CASE("corners of a step that is smaller than an edge may share a vertex") {
  const TriangleMesh target = block_with_step(0.1);
  const SignedFeatures features = features_of(target);
  const VolumeMesh mesh = centered_lattice(4);
  const RoutingGraph graph(mesh);
  std::vector<std::uint8_t> followed, vanishing;
  for (const FeatureCurve& curve : features.curves.curves) {
    vanishing.push_back(curve.length() < kLeastRoutedLength * graph.edge_length());
    followed.push_back(!vanishing.back());
  }
  const std::size_t num_short = static_cast<std::size_t>(std::ranges::count(vanishing, 1));
  REQUIRE(num_short > 0);
  const std::map<Index, Index> clusters = corner_clusters(graph, features, followed, vanishing);
  CHECK(clusters.size() == 2 * num_short);
  CornerPlacement corners(graph, features, followed, vanishing);
  const std::vector<std::uint8_t> before = corners.taken();
  for (std::size_t c = 0; c < vanishing.size(); ++c) {
    if (!vanishing[c]) continue;
    const Index a = features.curves.curves[c].vertices.front(), b = features.curves.curves[c].vertices.back();
    CHECK(clusters.at(a) == clusters.at(b));
    const bool have_two = corners.vertex_of(a) != kNoIndex && corners.vertex_of(b) != kNoIndex;
    CHECK(corners.share_all(a) == have_two);
    CHECK(corners.vertex_of(a) == corners.vertex_of(b));
    CHECK_FALSE(corners.share_all(b));
  }
  CHECK(std::ranges::count(corners.taken(), 1) < std::ranges::count(before, 1));
  CHECK_FALSE(corners.share_all(kNoIndex));

  // A corner stays alone if a curve would begin and end at one vertex.
  const std::vector<std::uint8_t> all(vanishing.size(), 1);
  CHECK(corner_clusters(graph, features, all, vanishing).empty());
}

TEST_CASE("routing that is cancelled finds no more paths") {
  const SignedFeatures features = features_of(cube_surface(2, false));
  RoutingOptions options;
  int asked = 0;
  options.cancelled = [&] { return ++asked > 20; };
  const FeatureRouting routing = route_features(centered_lattice(4), features, options);
  CHECK(routing.paths.size() < 12);
  CHECK(routing.paths.size() + routing.unfollowed.size() == 12);
  CHECK(asked < 500);
}

TEST_CASE("routing is the same for any number of threads") {
  test::ThreadGuard guard;
  guard.use(1);
  const FeatureRouting one = RoutedLattice(tetrahedron_surface(), 5).routing;
  guard.use(3);
  const FeatureRouting three = RoutedLattice(tetrahedron_surface(), 5).routing;
  REQUIRE(one.paths.size() == three.paths.size());
  for (std::size_t i = 0; i < one.paths.size(); ++i) CHECK(one.paths[i].vertices == three.paths[i].vertices);
  CHECK(one.corners == three.corners);
}

TEST_CASE("routing refuses options of another size and positions that are not finite") {
  const SignedFeatures features = features_of(cube_surface(2, false));
  VolumeMesh mesh = centered_lattice(2);
  RoutingOptions options;
  options.excluded.assign(11, 0);
  CHECK_THROWS_AS(route_features(mesh, features, options), InputError);
  mesh.positions[0].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(route_features(mesh, features), InputError);
  CHECK(route_features(centered_lattice(2), {}).paths.empty());
}
