// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/limit_patches.h"

#include "subvol/mesh/feature_tags.h"
#include "subvol/subdivision/limit_masks.h"
#include "subvol/subdivision/regular_patch.h"
#include "subvol/subdivision/surface_refinement.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>

namespace subvol::internal {

namespace {

Vec3 combine(const std::array<double, 4>& w, const std::array<Vec3, 4>& p) {
  return w[0] * p[0] + w[1] * p[1] + w[2] * p[2] + w[3] * p[3];
}

std::array<Vec3, 4> combine_rows(const std::array<double, 4>& w, const ControlNet& net) {
  std::array<Vec3, 4> row;
  for (int i = 0; i < 4; ++i) row[i] = w[0] * net[0][i] + w[1] * net[1][i] + w[2] * net[2][i] + w[3] * net[3][i];
  return row;
}

/// The vertex at a corner with its ring, which starts at that corner.
class VertexRing {
 public:
  VertexRing(const SurfaceTopology& surface, std::span<const Vec3> points, Index corner)
      : points_{points[surface.corner_vertices[corner]]},
        sharpness_{surface.vertex_sharpness[surface.corner_vertices[corner]], {}} {
    std::vector<Vec3> diagonals;
    Index h = corner;
    do {
      const Index n = surface.next(h);
      points_.push_back(points[surface.corner_vertices[n]]);
      diagonals.push_back(points[surface.corner_vertices[surface.next(n)]]);
      sharpness_.edges.push_back(surface.edge_sharpness[surface.corner_edges[h]]);
      h = surface.rotate(h);
    } while (h != corner);
    points_.insert(points_.end(), diagonals.begin(), diagonals.end());
  }

  Vec3 position() const { return apply(limit_mask(sharpness_)); }

  /// Returns the normal of the smooth piece that the corner belongs to.
  Vec3 normal() const {
    const int valence = static_cast<int>(sharpness_.edges.size());
    for (const TangentSector& sector : tangent_sectors(sharpness_)) {
      if ((valence - sector.first) % valence >= sector.count) continue;
      const auto [u, v] = tangent_masks(sharpness_, sector);
      return unit_normal(apply(u), apply(v));
    }
    return Vec3::Zero();
  }

 private:
  Vec3 apply(const RingMask& mask) const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < mask.size(); ++i) sum += mask[i] * points_[i];
    return sum;
  }

  std::vector<Vec3> points_;
  RingSharpness sharpness_;
};

}  // namespace

struct LimitPatches::Samples {
  std::span<const int> u, v;
  Vec3 *positions, *normals;
  std::size_t at(std::size_t i, std::size_t j) const { return j * u.size() + i; }
};

/// A quad of some level and the samples to take in it: u[first_u .. last_u - 1] and so on.
struct LimitPatches::Block {
  int level;
  Index face;
  int turn;  // the quad's corner of lowest parameters
  int u, v;  // the lowest parameters
  std::size_t first_u, last_u, first_v, last_v;
  int size() const { return kPatchSideUnits >> level; }
  bool empty() const { return first_u == last_u || first_v == last_v; }
};

LimitPatches::LimitPatches(const VolumeMesh& cage) {
  const BoundarySurface boundary = tagged_boundary(cage, MeshTopology(cage));
  const SurfaceTopology& coarse = boundary.topology;
  std::vector<Vec3> points;
  for (const Index v : boundary.vertices) points.push_back(cage.positions[v]);
  layout_ = patch_layout(coarse);
  levels_.push_back({refined_topology(coarse), refined_points(coarse, points), {}, {}});
  classify(levels_[0], num_patches());
}

void LimitPatches::classify(Level& level, std::size_t num_faces) const {
  level.regular.resize(num_faces);
#pragma omp parallel for schedule(static)
  for (std::size_t f = 0; f < num_faces; ++f) level.regular[f] = is_regular(level.surface, static_cast<Index>(f));
}

void LimitPatches::prepare(int depth) {
  assert(depth <= kMostPatchDepth);
  while (static_cast<int>(levels_.size()) <= depth) {
    Level& last = levels_.back();
    std::vector<Index> irregular;
    last.first_children.assign(last.regular.size(), kNoIndex);
    for (std::size_t f = 0; f < last.regular.size(); ++f) {
      if (last.regular[f]) continue;
      last.first_children[f] = static_cast<Index>(4 * irregular.size());
      irregular.push_back(static_cast<Index>(f));
    }
    const SurfacePiece piece = surface_piece(last.surface, irregular);
    std::vector<Vec3> points;
    for (const Index v : piece.vertices) points.push_back(last.points[v]);
    Level next{refined_topology(piece.topology), refined_points(piece.topology, points), {}, {}};
    classify(next, 4 * irregular.size());
    levels_.push_back(std::move(next));
  }
}

void LimitPatches::evaluate(Index patch, std::span<const int> u, std::span<const int> v, Vec3* positions,
                            Vec3* normals) const {
  fill({0, patch, 0, 0, 0, 0, u.size(), 0, v.size()}, {u, v, positions, normals});
}

void LimitPatches::fill(const Block& block, const Samples& samples) const {
  if (block.empty()) return;
  const Level& level = levels_[block.level];
  if (level.regular[block.face]) {
    const ControlNet net = control_net(level.surface, level.points, block.face, block.turn);
    const double scale = 1.0 / block.size();
    for (std::size_t j = block.first_v; j < block.last_v; ++j) {
      const CubicWeights wv = cubic_weights((samples.v[j] - block.v) * scale);
      const std::array<Vec3, 4> row = combine_rows(wv.value, net);
      const std::array<Vec3, 4> slope = samples.normals ? combine_rows(wv.slope, net) : row;
      for (std::size_t i = block.first_u; i < block.last_u; ++i) {
        const CubicWeights wu = cubic_weights((samples.u[i] - block.u) * scale);
        samples.positions[samples.at(i, j)] = combine(wu.value, row);
        if (samples.normals)
          samples.normals[samples.at(i, j)] = unit_normal(combine(wu.slope, row), combine(wu.value, slope));
      }
    }
    return;
  }
  const auto on_ends = [&](std::span<const int> t, std::size_t first, std::size_t last, int low) {
    return std::all_of(t.begin() + first, t.begin() + last, [&](int x) { return x == low || x == low + block.size(); });
  };
  if (!on_ends(samples.u, block.first_u, block.last_u, block.u) ||
      !on_ends(samples.v, block.first_v, block.last_v, block.v)) {
    fill_children(block, samples);
    return;
  }
  for (std::size_t j = block.first_v; j < block.last_v; ++j)
    for (std::size_t i = block.first_u; i < block.last_u; ++i) {
      const bool right = samples.u[i] != block.u, upper = samples.v[j] != block.v;
      const int corner = upper ? (right ? 2 : 3) : (right ? 1 : 0);
      const VertexRing ring(level.surface, level.points,
                            level.surface.face_offsets[block.face] + (block.turn + corner) % 4);
      samples.positions[samples.at(i, j)] = ring.position();
      if (samples.normals) samples.normals[samples.at(i, j)] = ring.normal();
    }
}

// Child k has its corner 0 at its parent's corner k, so its corner of lowest parameters has another number.
void LimitPatches::fill_children(const Block& block, const Samples& samples) const {
  assert(block.level + 1 < static_cast<int>(levels_.size()));
  const int half = block.size() / 2;
  const auto split = [&](std::span<const int> t, std::size_t first, std::size_t last, int middle) {
    return static_cast<std::size_t>(std::upper_bound(t.begin() + first, t.begin() + last, middle) - t.begin());
  };
  const std::size_t middle_u = split(samples.u, block.first_u, block.last_u, block.u + half);
  const std::size_t middle_v = split(samples.v, block.first_v, block.last_v, block.v + half);
  for (int quadrant = 0; quadrant < 4; ++quadrant) {
    const bool right = quadrant == 1 || quadrant == 2, upper = quadrant >= 2;
    Block child;
    child.level = block.level + 1;
    child.face = levels_[block.level].first_children[block.face] + (block.turn + quadrant) % 4;
    child.turn = (4 - quadrant) % 4;
    child.u = block.u + (right ? half : 0);
    child.v = block.v + (upper ? half : 0);
    child.first_u = right ? middle_u : block.first_u;
    child.last_u = right ? block.last_u : middle_u;
    child.first_v = upper ? middle_v : block.first_v;
    child.last_v = upper ? block.last_v : middle_v;
    fill(child, samples);
  }
}

}  // namespace subvol::internal
