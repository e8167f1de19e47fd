// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/pads.h"
#include "subvol/base/error.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/quality_caps.h"
#include "subvol/mesh/validate.h"
#include "tests/support/feature_fixtures.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// The patch whose faces all have a vertex at this place of the grid.
Index patch_at(const PatchedMesh& patched, const Vec3& place) {
  const MeshTopology topology(patched.mesh);
  const auto faces = topology.boundary_faces();
  double distance = 1e300;
  Index patch = kNoIndex;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    Vec3 center = Vec3::Zero();
    for (Index v : topology.face(faces[f])) center += patched.mesh.positions[v] / 4;
    if ((center - place).norm() < distance) distance = (center - place).norm(), patch = patched.patches.of_face[f];
  }
  return patch;
}

/// Number of boundary edges by (rounded angle of the path there, or 180; number of cells).
std::map<std::pair<int, int>, int> edges_by_angle(const PatchedMesh& patched, const SignedFeatures& features) {
  const MeshTopology topology(patched.mesh);
  std::map<Index, double> angles;
  for (const CreasePath& path : patched.paths)
    for (std::size_t i = 0; i + 1 < path.vertices.size(); ++i) {
      const Index edge = topology.find_edge(path.vertices[i], path.vertices[i + 1]);
      REQUIRE(edge != kNoIndex);
      CHECK(topology.is_boundary_edge(edge));
      CHECK(angles.emplace(edge, features.angles[path.curve]).second);
    }
  std::map<std::pair<int, int>, int> count;
  for (std::size_t e = 0; e < topology.num_edges(); ++e) {
    const auto edge = static_cast<Index>(e);
    if (!topology.is_boundary_edge(edge)) continue;
    const auto at = angles.find(edge);
    ++count[{at == angles.end() ? 180 : static_cast<int>(std::lround(at->second)), topology.num_edge_cells(edge)}];
  }
  return count;
}

/// Checks what every pad must keep: a valid mesh, closed paths that end at the same corners, and patches bounded by
/// paths.
void require_sound_pads(const PatchedMesh& patched, const PatchedMesh& before) {
  CHECK(validate(patched.mesh).empty());
  CHECK(patched.fitted.size() == patched.mesh.num_vertices());
  CHECK(patched.corners == before.corners);
  REQUIRE(patched.paths.size() == before.paths.size());
  for (std::size_t p = 0; p < patched.paths.size(); ++p) {
    CHECK(patched.paths[p].vertices.front() == before.paths[p].vertices.front());
    CHECK(patched.paths[p].vertices.back() == before.paths[p].vertices.back());
  }
  const BoundaryPatches found = boundary_patches(MeshTopology(patched.mesh), patched.paths);
  CHECK(found.count == patched.patches.count);
  REQUIRE(found.of_face.size() == patched.patches.of_face.size());
  std::set<std::pair<Index, Index>> pairs;
  for (std::size_t f = 0; f < found.of_face.size(); ++f) pairs.insert({found.of_face[f], patched.patches.of_face[f]});
  CHECK(pairs.size() == found.count);
}

}  // namespace

TEST_CASE("a grid along a cube needs no pad") {
  const TriangleMesh target = cube_surface(2, false);
  const RoutedLattice cube(target, 4);
  PatchedMesh patched = cube.patched(target);
  const PadReport report = add_pads(patched, cube.features);
  CHECK(report.pads.empty());
  CHECK(report.missed.empty());
  CHECK(patched.mesh.num_cells() == 64);
  CHECK(patched.patches.count == 6);
  CHECK(patched.mesh.positions == cube.grid.positions);
}

TEST_CASE("a pad under one side of a cube leaves one cell at its edges and belongs to the patches") {
  const TriangleMesh target = cube_surface(2, false);
  const RoutedLattice cube(target, 4);
  PatchedMesh patched = cube.patched(target);
  const PatchedMesh before = patched;
  const Index top = patch_at(patched, {0, 0, 1}), side = patch_at(patched, {1, 0, 0});
  REQUIRE_FALSE(pad(patched, std::vector<Index>{top, top}));
  require_sound_pads(patched, before);
  CHECK(patched.mesh.num_cells() == 80);
  CHECK(patched.mesh.num_vertices() == 150);
  CHECK(std::ranges::count(patched.patches.of_face, top) == 16);
  CHECK(std::ranges::count(patched.patches.of_face, side) == 20);
  // Upright paths are one edge longer: from the new vertex to the corner.
  int longer = 0;
  for (const CreasePath& path : patched.paths) longer += path.vertices.size() == 6;
  CHECK(longer == 4);
  CHECK(edges_by_angle(patched, cube.features).at({90, 1}) == 52);
  // Old vertices stay; new ones lie 0.2 of an edge below.
  for (std::size_t v = 0; v < 125; ++v) CHECK(patched.mesh.positions[v] == before.mesh.positions[v]);
  for (std::size_t v = 125; v < 150; ++v) CHECK(patched.mesh.positions[v].z() == Approx(1 - 0.2 * 0.5));
}

TEST_CASE("a cube turned in its grid gets a pad at each side that edges cross") {
  const TriangleMesh target = prism_surface(4);
  const SignedFeatures features = features_of(target);
  // Upright edges of the cube lie on the axes, those of the grid between them.
  const VolumeMesh grid = centered_lattice(4);
  VolumeMesh fitted = grid;
  for (Vec3& p : fitted.positions)
    if (const double sum = p.head<2>().lpNorm<1>(); sum > 0) p.head<2>() *= p.head<2>().lpNorm<Eigen::Infinity>() / sum;
  const FeatureRouting routing = route_features(fitted, features);
  REQUIRE(routing.paths.size() == 12);
  PatchedMesh patched = patched_mesh(grid, fitted.positions, routing, target);
  const PatchedMesh before = patched;
  const auto start = edges_by_angle(patched, features);
  CHECK(start.at({180, 1}) == 16);
  CHECK(start.at({90, 2}) == 16);
  const PadReport report = add_pads(patched, features);
  CHECK(report.pads.size() == 4);
  CHECK(report.missed.empty());
  require_sound_pads(patched, before);
  for (const auto& [edge, count] : edges_by_angle(patched, features))
    CHECK((edge.first == 90 ? edge.second == 1 : edge.second > 1));
  std::set<Index> padded;
  for (const Pad& pad : report.pads) padded.insert(pad.patches.begin(), pad.patches.end());
  CHECK_FALSE(padded.contains(patch_at(before, {0, 0, 1})));
  CHECK_FALSE(padded.contains(patch_at(before, {0, 0, -1})));
}

TEST_CASE("pads leave one cell at the edges of a prism, a tetrahedron and a cylinder") {
  const TriangleMesh target =
      GENERATE(prism_surface(3, 0.2), tetrahedron_surface(), prism_surface(32), prism_surface(4));
  const RoutedLattice solid(target, 6);
  REQUIRE(solid.routing.unfollowed.empty());
  PatchedMesh patched = solid.patched(target);
  const PatchedMesh before = patched;
  const PadReport report = add_pads(patched, solid.features);
  CHECK_FALSE(report.pads.empty());
  CHECK(report.missed.empty());
  require_sound_pads(patched, before);
  for (const auto& [edge, count] : edges_by_angle(patched, solid.features)) {
    if (edge.first == 180)
      CHECK(edge.second > 1);
    else
      CHECK((edge.second == 1 || edge.first / edge.second >= 42));
  }
  CHECK(patched.mesh.num_cells() > before.mesh.num_cells());
}

TEST_CASE("an L in its grid needs no pad: three cells are at its reflex edge") {
  VolumeMesh mesh = voxels(4, 4, 4, [](int i, int j, int) { return i < 2 || j < 2; });
  const TriangleMesh target = surface_of(mesh);
  const SignedFeatures features = features_of(target);
  const FeatureRouting routing = route_features(mesh, features);
  REQUIRE(routing.unfollowed.empty());
  PatchedMesh patched = patched_mesh(mesh, mesh.positions, routing, target);
  CHECK(patched.patches.count == 8);
  CHECK(add_pads(patched, features).pads.empty());
  CHECK(edges_by_angle(patched, features).at({270, 3}) == 4);
}

TEST_CASE("patches on both sides of a reflex edge are padded together") {
  // Two cells at the reflex edge: the corner of the target lies in the middle of a row of faces.
  VolumeMesh mesh = voxels(4, 4, 4, [](int i, int j, int) { return i < 2 || j < 2; });
  const TriangleMesh target = surface_of(mesh);
  const SignedFeatures features = features_of(target);
  PatchedMesh patched = patched_mesh(mesh, mesh.positions, route_features(mesh, features), target);
  const PatchedMesh before = patched;
  // One side alone: the pad ends in a fold, but it is a pad.
  PatchedMesh one = patched;
  REQUIRE_FALSE(pad(one, std::vector<Index>{patch_at(patched, {2, 3, 2})}));
  require_sound_pads(one, before);
  REQUIRE_FALSE(pad(patched, std::vector<Index>{patch_at(patched, {2, 3, 2}), patch_at(patched, {3, 2, 2})}));
  require_sound_pads(patched, before);
  CHECK(edges_by_angle(patched, features).at({270, 2}) == 4);
}

TEST_CASE("patches are not padded where the pad would touch itself or split a corner") {
  const TriangleMesh target = cube_surface(2, false);
  RoutedLattice cube(target, 2);
  // The top is cut into quarters.
  const auto vertex = [&](double x, double y) {
    const auto at = std::ranges::find(cube.grid.positions, Vec3(x, y, 1));
    return static_cast<Index>(at - cube.grid.positions.begin());
  };
  cube.routing.paths.push_back({0, {vertex(-1, 0), vertex(0, 0)}});
  cube.routing.paths.push_back({0, {vertex(0, 0), vertex(1, 0)}});
  cube.routing.paths.push_back({0, {vertex(0, -1), vertex(0, 0)}});
  cube.routing.paths.push_back({0, {vertex(0, 0), vertex(0, 1)}});
  PatchedMesh patched = cube.patched(target);
  REQUIRE(patched.patches.count == 9);
  const PatchedMesh before = patched;
  const auto quarter = [&](double x, double y) { return patch_at(patched, {x, y, 1}); };
  const auto opposite = pad(patched, std::vector<Index>{quarter(0.5, 0.5), quarter(-0.5, -0.5)});
  REQUIRE(opposite);
  CHECK(opposite->problem == PadProblem::touches_itself);
  CHECK(opposite->vertex == vertex(0, 0));
  const auto alone = pad(patched, std::vector<Index>{quarter(0.5, 0.5)});
  REQUIRE(alone);
  CHECK(alone->problem == PadProblem::too_many_paths);
  CHECK(alone->vertex == vertex(0, 0));
  CHECK(patched.mesh.positions == before.mesh.positions);
  CHECK(patched.mesh.cell_vertices == before.mesh.cell_vertices);
  CHECK(patched.patches.of_face == before.patches.of_face);
  for (PadProblem problem : {PadProblem::touches_itself, PadProblem::too_many_paths, PadProblem::inverted})
    CHECK_FALSE(to_string(problem).empty());
}

TEST_CASE("a pad that no step keeps valid is refused") {
  const TriangleMesh target = cube_surface(2, false);
  PatchedMesh patched = RoutedLattice(target, 2).patched(target);
  // A vertex of the top lies below the one under it.
  const auto at = std::ranges::find(patched.mesh.positions, Vec3(0, 0, 1));
  REQUIRE(at != patched.mesh.positions.end());
  *at = Vec3(0, 0, -0.5);
  const PatchedMesh before = patched;
  const auto top = pad(patched, std::vector<Index>{patch_at(patched, {0.9, 0.9, 1})});
  REQUIRE(top);
  CHECK(top->problem == PadProblem::inverted);
  CHECK(patched.mesh.cell_vertices == before.mesh.cell_vertices);
}

TEST_CASE("pads refuse patches out of range, and meshes that do not belong to their paths") {
  const TriangleMesh target = cube_surface(2, false);
  const RoutedLattice cube(target, 2);
  PatchedMesh patched = cube.patched(target);
  CHECK_THROWS_AS(pad(patched, std::vector<Index>{-1}), InputError);
  CHECK_THROWS_AS(pad(patched, std::vector<Index>{6}), InputError);
  CHECK_THROWS_AS(patched_mesh(cube.grid, {}, cube.routing, target), InputError);
  CHECK_THROWS_AS(patched_mesh(lattice(1, 1, 1), std::vector<Vec3>(8, Vec3::Zero()), cube.routing, target), InputError);
  CHECK_THROWS_AS(add_pads(patched, {}), InputError);
  CHECK_THROWS_AS(quality_caps(patched, {}), InputError);
  PatchedMesh broken = patched;
  broken.patches.of_face.pop_back();
  CHECK_THROWS_AS(pad(broken, std::vector<Index>{0}), InputError);
  broken = patched;
  broken.fitted.pop_back();
  CHECK_THROWS_AS(pad(broken, std::vector<Index>{0}), InputError);
}

TEST_CASE("caps are the best that edges and corners allow") {
  const TriangleMesh cube = cube_surface(2, false);
  const RoutedLattice routed(cube, 2);
  const QualityCaps of_cube = quality_caps(routed.patched(cube), routed.features);
  CHECK(of_cube.edges.size() == 24);
  CHECK(of_cube.vertices.size() == 8);
  for (const EdgeCap& edge : of_cube.edges) CHECK(edge.cap == Approx(0.93));
  for (const VertexCap& corner : of_cube.vertices) CHECK(corner.cap == Approx(0.93));

  const TriangleMesh target = tetrahedron_surface();
  const RoutedLattice tetrahedron(target, 6);
  PatchedMesh patched = tetrahedron.patched(target);
  add_pads(patched, tetrahedron.features);
  const QualityCaps caps = quality_caps(patched, tetrahedron.features);
  CHECK(std::ranges::is_sorted(caps.edges, {}, &EdgeCap::ends));
  for (const EdgeCap& edge : caps.edges) CHECK(edge.cap == Approx(0.93 * std::sqrt(8.0) / 3));
  REQUIRE(caps.vertices.size() == 4);
  for (const VertexCap& corner : caps.vertices) CHECK(corner.cap == Approx(0.93 * std::sqrt(0.5)));

  // Edges that are not cut by cells as they should be.
  const TriangleMesh turned = prism_surface(4);
  const RoutedLattice in_grid(turned, 4);
  for (const EdgeCap& edge : quality_caps(in_grid.patched(turned), in_grid.features).edges)
    CHECK((edge.cap == Approx(0.93) || edge.cap == Approx(0.93 * std::sqrt(0.5))));
}
