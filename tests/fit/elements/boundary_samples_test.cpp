// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/base/error.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/io/mesh_io.h"
#include "subvol/mesh/features.h"
#include "subvol/surface/boundary.h"
#include "subvol/templates/cell_split.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/require_data.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <random>
#include <set>
#include <string>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

/// Every directed edge once, and its opposite too.
bool is_closed(const std::vector<std::array<Index, 3>>& triangles) {
  std::set<std::array<Index, 2>> edges;
  for (const auto& t : triangles)
    for (int i = 0; i < 3; ++i)
      if (!edges.insert({t[i], t[(i + 1) % 3]}).second) return false;
  return std::all_of(edges.begin(), edges.end(), [&](const auto& e) { return edges.contains({e[1], e[0]}); });
}

double volume(const std::vector<Vec3>& x, const std::vector<std::array<Index, 3>>& triangles) {
  double sum = 0;
  for (const auto& t : triangles) sum += x[t[0]].dot(x[t[1]].cross(x[t[2]])) / 6;
  return sum;
}

/// Samples of a closed boundary: vertices + edges (n - 1) + what is inside of faces.
void check_samples(const VolumeMesh& mesh, const ElementSpace& space, int n) {
  const BoundarySamples samples = make_boundary_samples(space, n, mesh.tags.creases);
  const MeshTopology& topology = space.topology();
  std::size_t expected = 0, num_triangles = 0;
  for (std::size_t v = 0; v < topology.num_vertices(); ++v)
    expected += topology.is_boundary_vertex(static_cast<Index>(v));
  for (std::size_t e = 0; e < topology.num_edges(); ++e)
    expected += topology.is_boundary_edge(static_cast<Index>(e)) ? n - 1 : 0;
  for (const Index f : topology.boundary_faces()) {
    const bool quad = topology.face(f).size() == 4;
    expected += quad ? (n - 1) * (n - 1) : (n - 1) * (n - 2) / 2;
    num_triangles += quad ? 2 * n * n : n * n;
  }
  CHECK(samples.points.size() == expected);
  CHECK(samples.positions.num_rows() == expected);
  CHECK(samples.triangles.size() == num_triangles);
  CHECK(samples.triangle_faces.size() == num_triangles);
  CHECK(is_closed(samples.triangles));
  CHECK(samples.crease_edges.size() == n * mesh.tags.creases.size());
}

}  // namespace

TEST_CASE("boundary samples are closed, face outwards and lie where their points are", "[boundary samples]") {
  PointSource source(5);
  for (const Basis basis : kBothBases)
    for (const int n : {1, 2, 3, 7}) {
      VolumeMesh mesh = renumbered(mixed_cells(), source.random());
      tag_creases(mesh, 40);
      const ElementSpace space(mesh, basis, 4);
      check_samples(mesh, space, n);
      const BoundarySamples samples = make_boundary_samples(space, n, mesh.tags.creases);
      const std::vector<Vec3> straight = samples.positions.apply(HighOrderMesh(space, mesh).coefficients);
      const TriangleMesh plain = triangulate(boundary_surface(mesh, space.topology()));  // all faces are planar
      CHECK(volume(straight, samples.triangles) == Approx(volume(plain.positions, plain.triangles)));
      for (std::size_t i = 0; i < samples.crease_edges.size(); ++i) {
        const CreaseEdge& crease = mesh.tags.creases[i / n];
        const auto step = static_cast<double>(i % n);
        const Vec3 &a = mesh.positions[crease.v0], &b = mesh.positions[crease.v1];
        CHECK((straight[samples.crease_edges[i][0]] - (a + step / n * (b - a))).norm() < 1e-13);
        CHECK((straight[samples.crease_edges[i][1]] - (a + (step + 1) / n * (b - a))).norm() < 1e-13);
      }
      const HighOrderMesh curved = random_mesh(space, source);
      const std::vector<Vec3> positions = samples.positions.apply(curved.coefficients);
      for (std::size_t i = 0; i < positions.size(); ++i)
        CHECK((positions[i] - curved.position(samples.points[i].cell, samples.points[i].point)).norm() < 1e-12);
    }
}

TEST_CASE("boundary samples depend on nodes of the boundary alone", "[boundary samples]") {
  const ElementSpace space(lattice(3, 3, 3), Basis::fourier, 3);
  const BoundarySamples samples = make_boundary_samples(space, 4);
  std::set<Index> inner;
  for (std::size_t c = 0; c < space.num_cells(); ++c)
    for (std::size_t node = space.cell_nodes(c); node < space.cell_nodes(c + 1); ++node)
      inner.insert(static_cast<Index>(node));
  for (std::size_t f = 0; f < space.topology().num_faces(); ++f)
    if (!space.topology().is_boundary_face(static_cast<Index>(f)))
      for (std::size_t node = space.face_nodes(f); node < space.face_nodes(f + 1); ++node)
        inner.insert(static_cast<Index>(node));
  for (const Index node : samples.positions.columns) CHECK_FALSE(inner.contains(node));
}

TEST_CASE("a surface term takes boundary samples as they are", "[boundary samples]") {
  const VolumeMesh mesh = mixed_cells();
  const ElementSpace space(mesh, Basis::fourier, 3);
  const BoundarySamples samples = make_boundary_samples(space, 4);
  std::vector<Vec3> coefficients = HighOrderMesh(space, mesh).coefficients;
  TriangleMesh surface;
  surface.positions = samples.positions.apply(coefficients);
  surface.triangles = samples.triangles;
  const TargetSurface target(surface);
  ClosestPointEnergy energy(target, samples.triangles, samples.points.size(), 0.1, 1);
  energy.assign(surface.positions);
  CHECK(energy.value(surface.positions) < 1e-20);
  const Index f = space.topology().boundary_faces()[0];
  coefficients[space.face_nodes(f)] += Vec3(0.1, 0.1, 0.1);
  const std::vector<Vec3> moved = samples.positions.apply(coefficients);
  energy.assign(moved);
  CHECK(energy.value(moved) > 1e-6);
}

TEST_CASE("boundary samples of real templates of all kinds are closed", "[boundary samples][data]") {
  const auto folder = require_data();
  if (!folder) return;
  for (const std::string name : {"mixed_screwdriver", "mixed_prismlayer_bone", "mixed_fandisk", "tet_hand", "bone87"}) {
    CAPTURE(name);
    const VolumeMesh mesh = read_volume_mesh(*folder / "fit" / name / "template.mesh");
    const ElementSpace space(mesh, Basis::fourier, 2);
    check_samples(mesh, space, 3);
    const BoundarySamples samples = make_boundary_samples(space, 3);
    const TriangleMesh plain = triangulate(boundary_surface(mesh, space.topology()));
    CHECK(volume(samples.positions.apply(HighOrderMesh(space, mesh).coefficients), samples.triangles) ==
          Approx(volume(plain.positions, plain.triangles)).epsilon(0.05));
  }
}

TEST_CASE("samples of edges are those of the boundary's creases", "[boundary samples]") {
  std::mt19937 random(2);
  for (const VolumeMesh& cells :
       {lattice(2, 1, 2), split_into_tets(lattice(2, 1, 2)), split_into_prisms(lattice(2, 1, 2), 0, 1)}) {
    const VolumeMesh mesh = renumbered(cells, random);
    const FeatureTags tags = features_by_angle(mesh, 40);
    REQUIRE(tags.creases.size() == 4 * (2 + 1 + 2));
    HighOrderMesh curved(ElementSpace(mesh, Basis::legendre, 3), mesh);
    for (Vec3& c : curved.coefficients) c += 0.1 * Vec3::Random();
    const BoundarySamples whole = make_boundary_samples(curved.space, 5, tags.creases);
    const EdgeSamples edges = make_edge_samples(curved.space, tags.creases, 5);
    const std::vector<Vec3> of_whole = whole.positions.apply(curved.coefficients);
    const std::vector<Vec3> of_edges = edges.positions.apply(curved.coefficients);
    REQUIRE(edges.segments.size() == whole.crease_edges.size());
    double largest = 0;
    for (std::size_t k = 0; k < edges.segments.size(); ++k)
      for (int end = 0; end < 2; ++end)
        largest = std::max(largest, (of_edges[edges.segments[k][end]] - of_whole[whole.crease_edges[k][end]]).norm());
    CHECK(largest < 1e-12);
  }
}

TEST_CASE("what cannot be sampled is refused", "[boundary samples]") {
  const ElementSpace space(lattice(2, 2, 2), Basis::fourier, 2);
  CHECK_THROWS_AS(make_boundary_samples(space, 0), InputError);
  CHECK_THROWS_AS(make_boundary_samples(space, 2, std::vector<CreaseEdge>{{0, 99, 1}}), InputError);
  CHECK_THROWS_AS(make_boundary_samples(space, 2, std::vector<CreaseEdge>{{0, 26, 1}}), InputError);
  CHECK_THROWS_AS(make_edge_samples(space, {}, 0), InputError);
  CHECK_THROWS_AS(make_edge_samples(space, std::vector<CreaseEdge>{{-1, 1, 1}}, 2), InputError);
  CHECK_THROWS_AS(make_edge_samples(space, std::vector<CreaseEdge>{{0, 26, 1}}, 2), InputError);
}
