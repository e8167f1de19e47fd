// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/tessellate.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/subdivision/limit_surface.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/threads.h"

#include <catch2/catch.hpp>

#include <limits>
#include <map>
#include <set>

using namespace subvol;
using namespace subvol::test;

namespace {

constexpr double kUnitTolerance = 1e-12;

std::array<double, 3> key(const Vec3& p) { return {p.x(), p.y(), p.z()}; }

/// Numbers positions that are the same bits alike.
std::vector<Index> weld(const std::vector<Vec3>& positions) {
  std::map<std::array<double, 3>, Index> numbers;
  std::vector<Index> welded;
  for (const Vec3& p : positions)
    welded.push_back(numbers.try_emplace(key(p), static_cast<Index>(numbers.size())).first->second);
  return welded;
}

/// Directed edges of the quads between welded vertices.
std::map<std::pair<Index, Index>, int> directed_edges(const TessellatedSurface& surface) {
  const std::vector<Index> welded = weld(surface.positions);
  std::map<std::pair<Index, Index>, int> edges;
  for (const auto& quad : surface.quads)
    for (int k = 0; k < 4; ++k) ++edges[{welded[quad[k]], welded[quad[(k + 1) % 4]]}];
  return edges;
}

bool watertight(const TessellatedSurface& surface) {
  const auto edges = directed_edges(surface);
  return std::all_of(edges.begin(), edges.end(), [&](const auto& entry) {
    const auto& [edge, count] = entry;
    const auto opposite = edges.find({edge.second, edge.first});
    return edge.first != edge.second && count == 1 && opposite != edges.end() && opposite->second == 1;
  });
}

/// Distance from the points of a dense uniform refinement to the nearest of all triangles.
double dense_chord_error(const VolumeMesh& cage, const TessellatedSurface& surface, int levels) {
  const BoundaryRefinement dense = refine_boundary(cage, levels);
  TriangleMesh triangles{surface.positions, {}};
  for (const auto& [a, b, c, d] : surface.quads) {
    triangles.triangles.push_back({a, b, c});
    triangles.triangles.push_back({a, c, d});
  }
  const ClosestPoint tree(triangles);
  double largest = 0;
  for (const Vec3& p : dense.positions.apply(cage.positions)) largest = std::max(largest, tree.closest(p).distance);
  return largest;
}

VolumeMesh bumpy() {
  VolumeMesh mesh = lattice(3, 2, 2);
  jitter(mesh, 0.2);
  return mesh;
}

}  // namespace

TEST_CASE("a tessellation is closed, of quads only, and its normals are unit and point outward") {
  VolumeMesh creased = lattice(2, 2, 2), semi_sharp = bumpy();
  tag_creases(creased, 40);
  tag_creases(semi_sharp, 40, 1.7);
  for (const VolumeMesh& cage : {bumpy(), mixed_cells(), l_shape(2), creased, semi_sharp}) {
    const TessellatedSurface surface = tessellate(cage, 0.01);
    CHECK(watertight(surface));
    CHECK(surface.chord_error <= 0.01);
    REQUIRE(surface.normals.size() == surface.positions.size());
    REQUIRE(surface.quad_patches.size() == surface.quads.size());
    for (const Vec3& normal : surface.normals) CHECK(std::abs(normal.norm() - 1) < kUnitTolerance);
    for (const auto& quad : surface.quads) {
      const auto corner = [&](int k) { return surface.positions[quad[k]]; };
      const Vec3 area = (corner(2) - corner(0)).cross(corner(3) - corner(1));
      for (const Index v : quad) CHECK(area.dot(surface.normals[v]) >= 0);
    }
  }
}

TEST_CASE("the stated chord error holds against a dense refinement", "[slow]") {
  VolumeMesh semi_sharp = bumpy();
  tag_creases(semi_sharp, 40, 1.7);
  for (const VolumeMesh& cage : {bumpy(), mixed_cells(), semi_sharp})
    for (const double bound : {0.03, 0.003}) {
      const TessellatedSurface surface = tessellate(cage, bound);
      const double measured = dense_chord_error(cage, surface, 5);
      CHECK(measured <= surface.chord_error);
      CHECK(surface.chord_error <= bound);
      CHECK(surface.chord_error > 0.2 * bound);  // not much finer than asked for
    }
}

TEST_CASE("the bound holds at singular corners, with few quads more") {
  VolumeMesh cage = l_shape(2);  // three faces on one side of a corner of creases, above and below the inner edge
  tag_creases(cage, 40);
  jitter(cage, 0.1);
  const TessellatedSurface coarse = tessellate(cage, 0.01), fine = tessellate(cage, 0.001);
  CHECK(fine.chord_error <= 0.001);
  CHECK(dense_chord_error(cage, fine, 6) <= fine.chord_error);
  CHECK(fine.quads.size() < 20 * coarse.quads.size());  // 10 where nothing is singular
}

TEST_CASE("a flat part takes one quad a patch, a round part more") {
  VolumeMesh cage = lattice(1, 1, 4);
  for (int v : {0, 1, 2, 3}) cage.tags.corners.push_back({v});
  tag_creases(cage, 40);
  const TessellatedSurface box = tessellate(cage, 1e-4);
  CHECK(box.quads.size() == 4u * 18u);
  CHECK(box.chord_error < 1e-12);
  const TessellatedSurface round = tessellate(lattice(1, 1, 4), 1e-4);
  CHECK(round.quads.size() > 10 * box.quads.size());
}

TEST_CASE("strips of patches are cut only as finely as they need") {
  VolumeMesh cage = lattice(6, 2, 2);
  tag_creases(cage, 40);
  // A dent at one end alone: the strips around the far end stay coarse.
  for (Vec3& p : cage.positions)
    if (p == Vec3(5, 1, 2)) p.z() = 1.5;
  const TessellatedSurface surface = tessellate(cage, 1e-3);
  const std::size_t num_patches = surface.patches.size();
  std::vector<int> counts(num_patches, 0);
  for (const Index p : surface.quad_patches) ++counts[p];
  CHECK(*std::min_element(counts.begin(), counts.end()) == 1);
  CHECK(*std::max_element(counts.begin(), counts.end()) >= 64);
}

TEST_CASE("any number of patches may meet at a vertex, smooth or between creases", "[slow]") {
  constexpr Index n = 2000;
  for (const bool creased : {false, true}) {
    VolumeMesh cage = prisms_round_axis(n, true);
    if (creased)
      for (Index i = 0; i < n; ++i) cage.tags.creases.push_back({1, 2 + n + i, kInfiniteSharpness});
    const TessellatedSurface surface = tessellate(cage, 0.1);
    bool at_top = false;
    for (std::size_t i = 0; i < surface.positions.size(); ++i) {
      CHECK(surface.positions[i].allFinite());
      if (surface.positions[i].head<2>().norm() > 1e-9 || surface.positions[i].z() < 0.5) continue;
      CHECK((surface.normals[i] - Vec3::UnitZ()).norm() < 1e-9);
      at_top = true;
    }
    CHECK(at_top);
  }
}

TEST_CASE("infinite creases part the normals, nothing else does") {
  VolumeMesh cube = lattice(1, 1, 1);
  tag_creases(cube, 40);
  for (Index v = 0; v < 8; ++v) cube.tags.corners.push_back({v});
  const TessellatedSurface sharp = tessellate(cube, 0.1);
  CHECK(weld(sharp.positions).size() > 0);
  const auto distinct = [](const TessellatedSurface& s) {
    const auto numbers = weld(s.positions);
    return static_cast<std::size_t>(*std::max_element(numbers.begin(), numbers.end())) + 1;
  };
  CHECK(sharp.positions.size() == 6u * 9u);  // every face has its own 3 x 3 vertices
  CHECK(distinct(sharp) == 26);
  for (const Vec3& normal : sharp.normals) CHECK(normal.cwiseAbs().maxCoeff() == Approx(1));
  const TessellatedSurface smooth = tessellate(lattice(1, 1, 1), 0.1);
  CHECK(distinct(smooth) == smooth.positions.size());
  for (CreaseEdge& edge : cube.tags.creases) edge.sharpness = 2;
  cube.tags.corners.clear();
  const TessellatedSurface semi = tessellate(cube, 0.01);
  CHECK(distinct(semi) == semi.positions.size());
}

TEST_CASE("patches go by boundary face and corner, and start at the limit of that corner") {
  for (const VolumeMesh& cage : {bumpy(), mixed_cells()}) {
    const MeshTopology topology(cage);
    const std::vector<Vec3> limit = limit_map(cage).apply(cage.positions);
    const TessellatedSurface surface = tessellate(cage, 0.05);
    std::size_t p = 0;
    for (std::size_t f = 0; f < topology.boundary_faces().size(); ++f) {
      const auto face = topology.face(topology.boundary_faces()[f]);
      for (std::size_t k = 0; k < face.size(); ++k, ++p) {
        REQUIRE(p < surface.patches.size());
        CHECK(surface.patches[p].face == static_cast<Index>(f));
        CHECK(surface.patches[p].corner == static_cast<Index>(k));
        const auto first = std::find(surface.quad_patches.begin(), surface.quad_patches.end(), static_cast<Index>(p));
        const Index v = surface.quads[first - surface.quad_patches.begin()][0];
        CHECK((surface.positions[v] - limit[face[k]]).norm() < 1e-12);
      }
    }
    CHECK(p == surface.patches.size());
  }
}

TEST_CASE("the wireframe runs along quad edges, once over every cage edge") {
  VolumeMesh cage = bumpy();
  tag_creases(cage, 60);
  const TessellatedSurface surface = tessellate(cage, 0.02);
  std::set<std::pair<Index, Index>> sides;
  for (const auto& quad : surface.quads)
    for (int k = 0; k < 4; ++k) sides.insert(std::minmax(quad[k], quad[(k + 1) % 4]));
  const std::vector<Index> welded = weld(surface.positions);
  std::set<std::pair<Index, Index>> segments;
  std::map<Index, int> ends;
  for (const auto& [a, b] : surface.wireframe) {
    CHECK(sides.contains(std::minmax(a, b)));
    CHECK(segments.insert(std::minmax(welded[a], welded[b])).second);
    ++ends[welded[a]];
    ++ends[welded[b]];
  }
  const MeshTopology topology(cage);
  std::size_t num_edges = 0, num_branching = 0, num_vertices = 0, branching_ends = 0;
  for (std::size_t e = 0; e < topology.num_edges(); ++e) num_edges += topology.is_boundary_edge(e);
  for (std::size_t v = 0; v < topology.num_vertices(); ++v) num_vertices += topology.is_boundary_vertex(v);
  for (const auto& [v, count] : ends)
    if (count != 2) ++num_branching, branching_ends += count;
  CHECK(num_branching == num_vertices);  // valence 3 and more in this cage
  CHECK(branching_ends == 2 * num_edges);
}

TEST_CASE("a tessellation is the same bits for one thread and two") {
  const VolumeMesh cage = bumpy();
  test::ThreadGuard guard;
  guard.use(1);
  const TessellatedSurface one = tessellate(cage, 0.003);
  guard.use(2);
  const TessellatedSurface two = tessellate(cage, 0.003);
  CHECK(one.positions == two.positions);
  CHECK(one.normals == two.normals);
  CHECK(one.quads == two.quads);
  CHECK(one.chord_error == two.chord_error);
}

TEST_CASE("a bound on the quads is kept, and the error reached is told") {
  const TessellatedSurface surface = tessellate(bumpy(), 1e-9, 3'000);
  CHECK(surface.quads.size() <= 3'000);
  CHECK(surface.quads.size() > 1'000);
  CHECK(surface.chord_error > 1e-9);
  CHECK(dense_chord_error(bumpy(), surface, 5) <= surface.chord_error);
}

TEST_CASE("a tessellation tells its rounds and ends with what it has") {
  double last = 0;
  int rounds = 0;
  const auto progress = [&](int most) {
    return [&, most](const char* part, double share) {
      CHECK(part == std::string("tessellation"));
      CHECK(share >= last);
      last = share;
      return ++rounds < most;
    };
  };
  const double chord = 0.003;
  const TessellatedSurface whole = tessellate(bumpy(), chord, kMostQuads, progress(1000));
  CHECK(rounds > 1);
  CHECK(last <= 1);
  CHECK(whole.positions == tessellate(bumpy(), chord).positions);
  rounds = 0;
  last = 0;
  const TessellatedSurface part = tessellate(bumpy(), chord, kMostQuads, progress(1));
  CHECK(part.quads.size() < whole.quads.size());
  CHECK(part.chord_error > chord);
  CHECK(dense_chord_error(bumpy(), part, 5) <= part.chord_error);
}

TEST_CASE("a chord error that is not positive is refused") {
  for (const double bound : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()})
    CHECK_THROWS_AS(tessellate(lattice(1, 1, 1), bound), InputError);
}
