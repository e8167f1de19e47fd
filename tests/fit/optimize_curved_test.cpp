// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/optimize_curved.h"

#include "subvol/base/error.h"
#include "subvol/fit/certificate/high_order_certificate.h"
#include "subvol/fit/fits/sheet_projectors.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/surface/boundary.h"
#include "tests/support/element_fixtures.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// A block of n^3 cubes whose side x = n bulges outward by up to `bulge`: that of the modes of order 2 of its edges.
HighOrderMesh bulged_block(const VolumeMesh& block, int order, int n, double bulge) {
  HighOrderMesh mesh(ElementSpace(block, Basis::legendre, order), block);
  const MeshTopology& topology = mesh.space.topology();
  for (std::size_t e = 0; e < topology.num_edges(); ++e) {
    const auto [v, w] = topology.edge(static_cast<Index>(e));
    if (block.positions[v].x() == n && block.positions[w].x() == n)
      mesh.coefficients[mesh.space.edge_nodes(e)] += Vec3(bulge, 0, 0);
  }
  return mesh;
}

/// True for nodes inside the cells: those that may move in every direction.
std::vector<bool> inner_nodes(const HighOrderMesh& mesh, const VolumeMesh& labels) {
  std::vector<bool> result;
  for (const Mat3& projector : sheet_projectors(mesh, labels, true)) result.push_back(!projector.isZero());
  return result;
}

/// Moves inner vertices and modes anywhere within a box.
void tangle(HighOrderMesh& mesh, const VolumeMesh& labels, double amount) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> shift(-amount, amount);
  const std::vector<bool> is_inner = inner_nodes(mesh, labels);
  for (std::size_t i = 0; i < mesh.coefficients.size(); ++i)
    if (is_inner[i]) mesh.coefficients[i] += Vec3(shift(random), shift(random), shift(random));
}

}  // namespace

TEST_CASE("Nodes of curved cells move within flat faces, along straight borders, and not on curved faces",
          "[optimize][elements]") {
  constexpr int kSize = 2;
  VolumeMesh block = test::lattice(kSize, kSize, kSize);
  const HighOrderMesh mesh = bulged_block(block, 3, kSize, 0.1);
  const auto rank_at = [&](const HighOrderMesh& of, const VolumeMesh& labels, const Vec3& x, bool fixed = false) {
    const std::vector<Mat3> projectors = sheet_projectors(of, labels, fixed);
    const auto v = std::ranges::find(block.positions, x) - block.positions.begin();
    return std::lround(projectors[static_cast<std::size_t>(v)].trace());
  };
  CHECK(rank_at(mesh, block, {1, 1, 1}) == 3);
  CHECK(rank_at(mesh, block, {0, 1, 1}) == 2);
  CHECK(rank_at(mesh, block, {0, 0, 1}) == 1);
  CHECK(rank_at(mesh, block, {0, 0, 0}) == 0);
  CHECK(rank_at(mesh, block, {2, 1, 1}) == 0);  // on the curved side
  CHECK(rank_at(mesh, block, {2, 0, 1}) == 0);
  CHECK(rank_at(mesh, block, {0, 1, 1}, true) == 0);
  CHECK(rank_at(mesh, block, {1, 1, 1}, true) == 3);

  block.references = {1, 2, 1, 2, 1, 2, 1, 2};  // their interface is the plane x = 1
  CHECK(rank_at(mesh, block, {1, 1, 1}) == 2);
  CHECK(rank_at(mesh, block, {1, 0, 1}) == 1);  // where it reaches the boundary
  CHECK(rank_at(mesh, block, {1, 0, 1}, true) == 0);

  block.references.clear();
  const MeshTopology topology(block);
  block.face_groups.groups = {{"half", 1, 2}};
  for (const Index f : topology.boundary_faces())
    if (std::ranges::all_of(topology.face(f), [&](Index v) { return block.positions[v].x() == 0; }) &&
        std::ranges::all_of(topology.face(f), [&](Index v) { return block.positions[v].y() <= 1; }))
      block.face_groups.faces.push_back({face_key(topology.face(f)), 0});
  normalize(block.face_groups);
  CHECK(rank_at(mesh, block, {0, 1, 1}) == 1);  // on the border of the group
  CHECK(rank_at(mesh, block, {0, 1, 0}) == 0);  // where it reaches an edge
}

TEST_CASE("Curved cells that are tangled inside become valid, and their boundary stays", "[optimize][elements]") {
  const int order = GENERATE(2, 3);
  constexpr int kSize = 3;
  const VolumeMesh block = test::lattice(kSize, kSize, kSize);
  HighOrderMesh mesh = bulged_block(block, order, kSize, 0.15);
  tangle(mesh, block, 0.6);
  REQUIRE(certify(mesh.space, mesh.coefficients).not_certified.size() > 5);
  const CurvedOptimizeResult result = optimize_curved(mesh, block, {});
  CHECK(result.uncertified.empty());
  CHECK(result.report.stop_reason == StopReason::converged);
  CHECK(measure_quality(result.mesh).min_scaled_jacobian > 0.5);
  const std::vector<Mat3> projectors = sheet_projectors(mesh, block, false);
  double along = 0, across = 0;
  for (std::size_t i = 0; i < projectors.size(); ++i) {
    const Vec3 moved = result.mesh.coefficients[i] - mesh.coefficients[i];
    across = std::max(across, (moved - projectors[i] * moved).norm());
    if (std::lround(projectors[i].trace()) < 3) along = std::max(along, moved.norm());
  }
  CHECK(across < 1e-12);
  CHECK(along > 1e-3);

  const CurvedOptimizeResult fixed = optimize_curved(mesh, block, {.fixed_boundary = true});
  CHECK(fixed.uncertified.empty());
  const std::vector<bool> is_inner = inner_nodes(mesh, block);
  for (std::size_t i = 0; i < is_inner.size(); ++i)
    if (!is_inner[i]) CHECK((fixed.mesh.coefficients[i] - mesh.coefficients[i]).norm() < 1e-13);
}

TEST_CASE("Curved cells that cannot be better come back as they are", "[optimize][elements]") {
  const VolumeMesh block = test::lattice(2, 2, 1);
  const HighOrderMesh mesh(ElementSpace(block, Basis::legendre, 2), block);
  const CurvedOptimizeResult result = optimize_curved(mesh, block, {});
  CHECK(result.mesh.coefficients == mesh.coefficients);
  CHECK(result.uncertified.empty());
}

TEST_CASE("Optimizing curved cells refuses what it cannot take", "[optimize][elements]") {
  const VolumeMesh block = test::lattice(2, 1, 1);
  HighOrderMesh mesh(ElementSpace(block, Basis::legendre, 2), block);
  CHECK_THROWS_AS(optimize_curved(mesh, test::lattice(1, 1, 1), {}), InputError);
  CHECK_THROWS_AS(optimize_curved(mesh, block, {.quality = 0.9}), InputError);
  mesh.coefficients[0].x() = NAN;
  CHECK_THROWS_AS(optimize_curved(mesh, block, {}), InputError);
}

TEST_CASE("A fit goes on from curved cells, with their orders or higher ones", "[slow][high_order][elements]") {
  const VolumeMesh block = test::lattice(2, 2, 2);
  constexpr int kFine = 12;
  VolumeMesh fine = test::lattice(kFine, kFine, kFine);
  for (Vec3& x : fine.positions) x *= 2.0 / kFine;
  TriangleMesh target = refined_triangles(boundary_surface(fine, MeshTopology(fine)));
  for (Vec3& x : target.positions) {
    const Vec3 from_center = x - Vec3::Ones();
    x = Vec3::Ones() + 1.3 * from_center / std::pow(from_center.array().pow(4).sum(), 0.25);  // a rounded box
  }
  HighOrderFitOptions options;
  options.order = 2;
  HighOrderFitResult first = fit_high_order(target, block, options);
  const int order = GENERATE(1, 3);
  options.order = order;
  HighOrderFitResult second = fit_high_order(target, first.mesh, block, options);
  CHECK(second.mesh.space.max_order() == std::max(2, order));
  CHECK(certify(second.mesh.space, second.mesh.coefficients).not_certified.empty());
  const double mean = first.report.last_kept_stage()->mean_distance_percent;
  CHECK(second.report.initial_distance_mean_percent == Approx(mean).epsilon(0.1));
  CHECK(second.report.last_kept_stage()->mean_distance_percent < 1.02 * mean);
}
