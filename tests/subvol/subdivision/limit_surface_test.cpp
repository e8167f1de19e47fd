// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/limit_surface.h"
#include "subvol/base/error.h"
#include "subvol/subdivision/subdivision.h"
#include "tests/support/opensubdiv_oracle.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

namespace subvol::test {

namespace {

constexpr double kRounding = 1e-12;

std::vector<VolumeMesh> some_meshes() {
  std::vector<VolumeMesh> meshes = {lattice(1, 1, 1), lattice(3, 2, 2), l_shape(2), fan(5, 340, 1), mixed_cells()};
  for (VolumeMesh& mesh : meshes) jitter(mesh, 0.1);
  return meshes;
}

/// Largest distance between the limit positions now and after `levels` refinements, at the boundary vertices of `mesh`.
double limit_drift(const VolumeMesh& mesh, int levels) {
  const std::vector<Vec3> now = limit_map(mesh).apply(mesh.positions);
  const MeshTopology topology(mesh);
  VolumeMesh fine = mesh;
  for (int i = 0; i < levels; ++i) fine = subdivide(fine).fine;
  const std::vector<Vec3> later = limit_map(fine).apply(fine.positions);
  double drift = 0;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (topology.is_boundary_vertex(static_cast<Index>(v))) drift = std::max(drift, (now[v] - later[v]).norm());
  return drift;
}

}  // namespace

TEST_CASE("limit positions are the same before and after refinement", "[limit]") {
  for (const VolumeMesh& untagged : some_meshes())
    for (double sharpness : {0.0, kInfiniteSharpness, 2.5, 1.3, 0.4}) {
      VolumeMesh mesh = untagged;
      if (sharpness > 0) tag_creases(mesh, 40, sharpness);
      CAPTURE(mesh.num_cells(), sharpness);
      CHECK(limit_drift(mesh, 2) <= kRounding);
    }
}

TEST_CASE("limit positions of darts, corners and mixed sharpness are the same after refinement", "[limit]") {
  VolumeMesh mesh = lattice(3, 2, 2);
  jitter(mesh, 0.1);
  tag_creases(mesh, 40);
  const std::vector<CreaseEdge> all = mesh.tags.creases;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    std::mt19937 random(seed);
    const std::array<double, 5> choices = {0.3, 1.0, 1.6, 2.2, kInfiniteSharpness};
    mesh.tags = {};
    for (CreaseEdge crease : all)
      if (random() % 3) mesh.tags.creases.push_back({crease.v0, crease.v1, choices[random() % choices.size()]});
    mesh.tags.corners = {{3, choices[random() % choices.size()]}};
    CAPTURE(seed);
    CHECK(limit_drift(mesh, 2) <= kRounding);
  }
}

TEST_CASE("refined boundaries approach their limit positions", "[limit]") {
  VolumeMesh mesh = lattice(2, 2, 1);
  jitter(mesh, 0.1);
  const std::vector<Vec3> limit = limit_map(mesh).apply(mesh.positions);
  const MeshTopology topology(mesh);
  double previous = 1e30;
  VolumeMesh fine = mesh;
  for (int level = 0; level < 4; ++level) {
    fine = subdivide(fine).fine;
    double distance = 0;
    for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
      if (topology.is_boundary_vertex(static_cast<Index>(v)))
        distance = std::max(distance, (fine.positions[v] - limit[v]).norm());
    if (level > 0) CHECK(distance < previous / 3);  // the third eigenvalue of valence 4 is 1/4
    previous = distance;
  }
}

TEST_CASE("limit positions and normals are OpenSubdiv's", "[limit][opensubdiv]") {
  for (const VolumeMesh& untagged : some_meshes())
    for (double sharpness : {0.0, kInfiniteSharpness}) {
      VolumeMesh mesh = untagged;
      if (sharpness > 0) tag_creases(mesh, 40, sharpness);
      const OracleLevels oracle = oracle_refine(mesh, 1);
      const BoundaryRefinement refined = refine_boundary(mesh, 1, true);
      const std::vector<Vec3> points = refined.positions.apply(mesh.positions);
      const std::vector<Vec3> normals = limit_normals(refined, mesh.positions, points);
      REQUIRE(points.size() == oracle.limit_positions.size());
      // The numberings differ, so points are found by their nearest.
      std::vector<std::vector<Index>> sites(points.size());
      for (std::size_t q = 0; q < refined.quads.size(); ++q)
        for (int i = 0; i < 4; ++i) {
          auto& list = sites[refined.quads[q][i]];
          const Index site = refined.quad_sites[q][i];
          if (std::find(list.begin(), list.end(), site) == list.end()) list.push_back(site);
        }
      double distance = 0, angle = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        std::size_t nearest = 0;
        for (std::size_t j = 1; j < points.size(); ++j)
          if ((oracle.limit_positions[j] - points[i]).norm() < (oracle.limit_positions[nearest] - points[i]).norm())
            nearest = j;
        distance = std::max(distance, (oracle.limit_positions[nearest] - points[i]).norm());
        if (sites[i].size() == 1)  // one of several normals is all OpenSubdiv gives on a crease
          angle = std::max(angle, (oracle.limit_normals[nearest] - normals[sites[i][0]]).norm());
      }
      CAPTURE(mesh.num_cells(), sharpness);
      CHECK(distance <= kRounding);
      CHECK(angle <= 1e-9);
    }
}

TEST_CASE("normals are the same before and after refinement, at darts nearly so", "[limit]") {
  constexpr double kDartTolerance = 5e-5;  // what 24 refinements of a dart's ring leave
  VolumeMesh mesh = lattice(3, 2, 2);
  jitter(mesh, 0.1);
  const auto normals_at_vertices = [&](int levels) {
    const BoundaryRefinement refined = refine_boundary(mesh, levels, true);
    const std::vector<Vec3> normals = limit_normals(refined, mesh.positions, refined.positions.apply(mesh.positions));
    std::vector<Vec3> result(refined.vertices.size(), Vec3::Zero());
    for (std::size_t q = 0; q < refined.quads.size(); ++q)
      for (int i = 0; i < 4; ++i)
        if (refined.quads[q][i] < static_cast<Index>(result.size()))
          result[refined.quads[q][i]] = normals[refined.quad_sites[q][i]];
    return result;
  };
  for (bool dart : {false, true}) {
    mesh.tags = {};
    if (dart) mesh.tags.creases = {{0, 1, kInfiniteSharpness}};
    const std::vector<Vec3> coarse = normals_at_vertices(0), fine = normals_at_vertices(2);
    for (std::size_t v = 0; v < coarse.size(); ++v)
      CHECK((coarse[v] - fine[v]).norm() <= (dart ? kDartTolerance : kRounding));
  }
}

TEST_CASE("normals at the sides of creases are the limits of normals nearby", "[limit]") {
  VolumeMesh mesh = lattice(3, 2, 2);
  jitter(mesh, 0.1);
  tag_creases(mesh, 40);
  // Each refinement brings the quads next to a site closer to the site's own tangent plane.
  double previous = 2;
  for (int level = 1; level <= 4; ++level) {
    const BoundaryRefinement refined = refine_boundary(mesh, level, true);
    const std::vector<Vec3> points = refined.positions.apply(mesh.positions);
    const std::vector<Vec3> normals = limit_normals(refined, mesh.positions, points);
    double worst = 0;
    for (std::size_t q = 0; q < refined.quads.size(); ++q) {
      const auto& quad = refined.quads[q];
      const Vec3 facet = (points[quad[2]] - points[quad[0]]).cross(points[quad[3]] - points[quad[1]]).normalized();
      for (int i = 0; i < 4; ++i) worst = std::max(worst, (facet - normals[refined.quad_sites[q][i]]).norm());
    }
    if (level > 1) CHECK(worst < 0.7 * previous);
    previous = worst;
  }
}

TEST_CASE("a refined boundary is closed and keeps track of its faces", "[limit]") {
  VolumeMesh mesh = mixed_cells();
  const MeshTopology topology(mesh);
  const BoundaryRefinement coarse = refine_boundary(mesh, 0);
  CHECK(coarse.quads.size() == topology.boundary_faces().size());
  CHECK(std::any_of(coarse.quads.begin(), coarse.quads.end(), [](const auto& q) { return q[3] == kNoIndex; }));
  const BoundaryRefinement fine = refine_boundary(mesh, 2);
  std::map<std::array<Index, 2>, int> edges;
  for (const auto& quad : fine.quads)
    for (int i = 0; i < 4; ++i) ++edges[{quad[i], quad[(i + 1) % 4]}];
  for (const auto& [edge, count] : edges) CHECK((count == 1 && edges.count({edge[1], edge[0]}) == 1));
  for (std::size_t q = 0; q < fine.quads.size(); ++q) {
    CHECK(fine.face_of_quad[q] >= 0);
    CHECK(fine.face_of_quad[q] < static_cast<Index>(topology.boundary_faces().size()));
  }
  const std::vector<Vec3> limit = limit_map(mesh).apply(mesh.positions), points = fine.positions.apply(mesh.positions);
  for (std::size_t i = 0; i < fine.vertices.size(); ++i)
    CHECK((points[i] - limit[fine.vertices[i]]).norm() <= kRounding);
}

TEST_CASE("the evaluator agrees with refined limit positions and normals", "[limit][opensubdiv]") {
  VolumeMesh mesh = lattice(3, 2, 2);
  jitter(mesh, 0.1);
  const LimitSurface surface(mesh);
  const BoundaryRefinement refined = refine_boundary(mesh, 1, true);
  const std::vector<Vec3> points = refined.positions.apply(mesh.positions);
  const std::vector<Vec3> normals = limit_normals(refined, mesh.positions, points);
  REQUIRE(surface.num_faces() * 4 == refined.quads.size());
  for (std::size_t q = 0; q < refined.quads.size(); ++q) {
    // Children of a face follow its corners; their third vertex is the face's middle, their first its corner.
    constexpr std::array<std::array<double, 2>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    const LimitPoint middle = surface.evaluate(refined.face_of_quad[q], 0.5, 0.5);
    CHECK((middle.position - points[refined.quads[q][2]]).norm() <= kRounding);
    CHECK((middle.normal() - normals[refined.quad_sites[q][2]]).norm() <= 1e-9);
    const LimitPoint corner = surface.evaluate(refined.face_of_quad[q], kCorners[q % 4][0], kCorners[q % 4][1]);
    CHECK((corner.position - points[refined.quads[q][0]]).norm() <= 1e-9);
    CHECK((corner.normal() - normals[refined.quad_sites[q][0]]).norm() <= 1e-4);
  }
}

TEST_CASE("arguments of the limit surface out of range are refused", "[limit]") {
  CHECK_THROWS_AS(refine_boundary(lattice(1, 1, 1), -1), InputError);
  CHECK_THROWS_AS(refine_boundary(lattice(1, 1, 1), 9), InputError);
  CHECK_THROWS_AS(LimitSurface(mixed_cells()), InputError);
  const LimitSurface surface(lattice(1, 1, 1));
  CHECK_THROWS_AS(surface.evaluate(6, 0.5, 0.5), InputError);
  CHECK_THROWS_AS(surface.evaluate(0, 1.5, 0.5), InputError);
  const BoundaryRefinement refined = refine_boundary(lattice(1, 1, 1), 1);
  CHECK_THROWS_AS(limit_normals(refined, {}, {}), InputError);
}

}  // namespace subvol::test
