// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/voxel_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/templates/voxel_evolution.h"
#include "subvol/templates/voxel_grid.h"
#include "tests/support/sample_meshes.h"

#include <catch2/catch.hpp>

#include <algorithm>

using namespace subvol;
using namespace subvol::internal;

namespace {

constexpr std::array<int, 3> kSize{9, 9, 9};

template <class Keep>
VoxelSolid filled(VertexRule rule, Keep&& keep) {
  VoxelSolid solid(kSize, rule);
  const VoxelGrid grid{kSize};
  for (std::size_t c = 0; c < solid.num_cells(); ++c) {
    const auto [i, j, k] = grid.place(static_cast<Index>(c));
    if (solid.may_flip(static_cast<Index>(c)) && keep(i, j, k)) solid.flip(static_cast<Index>(c));
  }
  return solid;
}

bool between(int low, int value, int high) { return low <= value && value <= high; }

/// A box of 5^3 cells, and shapes cut from it.
bool in_box(int i, int j, int k) { return between(2, i, 6) && between(2, j, 6) && between(2, k, 6); }
bool in_ring(int i, int j, int k) { return in_box(i, j, k) && k < 4 && !(between(3, i, 5) && between(3, j, 5)); }
bool in_shell(int i, int j, int k) {
  return in_box(i, j, k) && !(between(3, i, 5) && between(3, j, 5) && between(3, k, 5));
}

bool all_good(const VoxelSolid& solid) {
  for (std::size_t p = 0; p < solid.num_points(); ++p)
    if (!solid.good(static_cast<Index>(p))) return false;
  return true;
}

std::vector<double> fractions_of(const VoxelSolid& solid) {
  std::vector<double> fractions(solid.num_cells());
  for (std::size_t c = 0; c < fractions.size(); ++c) fractions[c] = solid.filled(static_cast<Index>(c)) ? 1 : 0;
  return fractions;
}

}  // namespace

TEST_CASE("The vertex table agrees with the defects of the cells around a point", "[templates]") {
  for (unsigned mask = 1; mask < 256; ++mask) {
    const VolumeMesh mesh =
        test::voxels(2, 2, 2, [&](int i, int j, int k) { return (mask >> (i + 2 * j + 4 * k) & 1) != 0; });
    bool at_center = false;
    for (const MeshDefect& defect : validate(mesh)) {
      if (defect.kind == MeshDefect::Kind::nonmanifold_vertex)
        at_center |= mesh.positions[defect.entity] == Vec3(1, 1, 1);
      // An edge of two diagonal cells ends at the center, as all inner edges do.
      if (defect.kind == MeshDefect::Kind::nonmanifold_edge) at_center = true;
    }
    INFO(mask);
    CHECK(vertex_table(VertexRule::manifold)[mask] == !at_center);
    if (vertex_table(VertexRule::pillowable)[mask]) CHECK(vertex_table(VertexRule::manifold)[mask]);
  }
  // Three cells in a row along a diagonal staircase see faces both ways.
  CHECK(vertex_table(VertexRule::manifold)[0] == true);
  CHECK(vertex_table(VertexRule::manifold)[255] == true);
}

TEST_CASE("Betti numbers of a ball, a ring and a hollow box", "[templates]") {
  CHECK(filled(VertexRule::manifold, in_box).topology() == BettiNumbers{1, 0, 0});
  CHECK(filled(VertexRule::manifold, in_ring).topology() == BettiNumbers{1, 1, 0});
  CHECK(filled(VertexRule::manifold, in_shell).topology() == BettiNumbers{1, 0, 1});
  const VoxelSolid two =
      filled(VertexRule::manifold, [](int i, int j, int k) { return in_box(i, j, k) && (i == 2 || i == 6); });
  CHECK(two.topology() == BettiNumbers{2, 0, 0});
  CHECK(two.euler_number() == 2);
}

TEST_CASE("Simple flips are those that leave the Betti numbers and a manifold", "[templates]") {
  std::mt19937 random(3);
  VoxelSolid solid = filled(VertexRule::manifold, in_ring);
  int simple = 0, other = 0;
  for (int n = 0; n < 400; ++n) {
    const auto c = static_cast<Index>(std::uniform_int_distribution<std::size_t>(0, solid.num_cells() - 1)(random));
    if (!solid.may_flip(c)) continue;
    const BettiNumbers before = solid.topology();
    const bool is_simple = solid.is_simple(c);
    solid.flip(c);
    if (is_simple) {
      CHECK(solid.topology() == before);
      CHECK(all_good(solid));
      ++simple;
    } else {
      CHECK((!all_good(solid) || solid.topology() != before));
      solid.flip(c);
      ++other;
    }
  }
  CHECK(simple > 20);
  CHECK(other > 20);
}

TEST_CASE("Evolving keeps the topology and reaches what it can", "[templates]") {
  VoxelSolid solid = filled(VertexRule::pillowable, in_box);
  const VoxelSolid wanted = filled(VertexRule::pillowable, in_ring);
  const std::vector<double> fractions = fractions_of(wanted);
  VoxelGoal goal{fractions, 0.5, {1, 0, 0}};
  evolve(solid, goal);
  CHECK(solid.topology() == BettiNumbers{1, 0, 0});
  CHECK(all_good(solid));
  // A ring without a handle: cells stay that stop the hole.
  CHECK(solid.num_filled() > wanted.num_filled());
  goal.topology.handles = 1;
  REQUIRE(match_handles(solid, goal));
  CHECK(solid.topology() == BettiNumbers{1, 1, 0});
  CHECK(std::equal(solid.filled().begin(), solid.filled().end(), wanted.filled().begin()));
}

TEST_CASE("Every start gives the topology asked for", "[templates]") {
  const VoxelSolid wanted = filled(VertexRule::pillowable, in_ring);
  const std::vector<double> fractions = fractions_of(wanted);
  for (const VoxelStart start : {VoxelStart::cut, VoxelStart::grown, VoxelStart::shrunk}) {
    const auto ring = start_solid(start, kSize, VertexRule::pillowable, {fractions, 0.5, {1, 1, 0}});
    REQUIRE(ring);
    CHECK(ring->topology() == BettiNumbers{1, 1, 0});
    CHECK(all_good(*ring));
  }
  // One cell out of a ring of single cells parts it.
  const std::vector<double> thin =
      fractions_of(filled(VertexRule::pillowable, [](int i, int j, int k) { return k == 2 && in_ring(i, j, k); }));
  const auto parted = start_solid(VoxelStart::cut, kSize, VertexRule::pillowable, {thin, 0.5, {1, 0, 0}});
  REQUIRE(parted);
  CHECK(parted->topology() == BettiNumbers{1, 0, 0});
  CHECK(!start_solid(VoxelStart::cut, kSize, VertexRule::pillowable, {fractions, 0.5, {2, 1, 0}}));
}

TEST_CASE("A part thinner than a cell is reached", "[templates]") {
  VoxelSolid solid = filled(VertexRule::pillowable, [](int i, int j, int k) { return i == 1 && j == 4 && k == 4; });
  std::vector<double> fractions(solid.num_cells(), 0.0);
  const VoxelGrid grid{kSize};
  for (int i = 1; i < 8; ++i) fractions[grid.cell(i, 4, 4)] = i == 1 ? 1 : 0.1;
  reach_thin_parts(solid, {fractions, 0.5, {1, 0, 0}});
  CHECK(solid.num_filled() == 7);
}
