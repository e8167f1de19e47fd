// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/tessellate.h"

#include "export/patch_grid.h"
#include "subvol/error.h"
#include "subvol/limit_surface.h"
#include "subvol/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace subvol {
namespace {

constexpr int kMaxLevels = 7;             // one below what refine_boundary makes: the measure looks one level further
constexpr double kBetweenSamples = 4.0 / 3;  // see the header: what a quadratic patch may add between the samples
constexpr double kSlowDecay = 0.5;           // of the error from look to look, where smooth parts have 1/4 a level
constexpr double kSingularShare = 0.01;      // of the patches, for which all are not refined again

/// Side k of a patch runs from its corner k to corner k + 1; sides 0 and 2 share their count, and so do 1 and 3.
class Strips {
 public:
  explicit Strips(const std::vector<std::array<Index, 4>>& patches) : sides_(patches.size()), strips_(patches.size()) {
    number_sides(patches);
    std::vector<Index> parent(num_sides_);
    std::iota(parent.begin(), parent.end(), 0);
    const auto root = [&](Index side) {
      while (parent[side] != side) side = parent[side] = parent[parent[side]];
      return side;
    };
    for (const auto& sides : sides_)
      for (int k = 0; k < 2; ++k) {
        const auto [low, high] = std::minmax({root(sides[k]), root(sides[k + 2])});
        parent[high] = low;
      }
    for (std::size_t p = 0; p < patches.size(); ++p) strips_[p] = {root(sides_[p][0]), root(sides_[p][1])};
  }

  Index num_sides() const { return num_sides_; }
  const std::array<Index, 4>& sides(std::size_t patch) const { return sides_[patch]; }
  /// Strip numbers (those of one of their sides) across i and across j.
  const std::array<Index, 2>& of_patch(std::size_t patch) const { return strips_[patch]; }

 private:
  void number_sides(const std::vector<std::array<Index, 4>>& patches) {
    using Edge = std::pair<Index, Index>;
    std::vector<Edge> edges;
    const auto edge_of = [&](std::size_t p, int k) { return Edge(std::minmax({patches[p][k], patches[p][(k + 1) % 4]})); };
    for (std::size_t p = 0; p < patches.size(); ++p)
      for (int k = 0; k < 4; ++k) edges.push_back(edge_of(p, k));
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    num_sides_ = static_cast<Index>(edges.size());
    for (std::size_t p = 0; p < patches.size(); ++p)
      for (int k = 0; k < 4; ++k)
        sides_[p][k] = static_cast<Index>(std::lower_bound(edges.begin(), edges.end(), edge_of(p, k)) - edges.begin());
  }

  Index num_sides_ = 0;
  std::vector<std::array<Index, 4>> sides_;
  std::vector<std::array<Index, 2>> strips_;
};

/// Uniform refinement of the boundary with its points; patches are the quads of its first level.
struct RefinedBoundary {
  BoundaryRefinement refinement;
  std::vector<Vec3> points;
  int patch_levels;  ///< refinements of a patch
  std::vector<SurfacePatch> patches;

  RefinedBoundary(const VolumeMesh& cage, int levels, bool with_tangents = false)
      : refinement(refine_boundary(cage, levels, with_tangents)),
        points(refinement.positions.apply(cage.positions)),
        patch_levels(levels - 1) {
    for (std::size_t q = 0; q < refinement.quads.size(); q += std::size_t{1} << (2 * patch_levels)) {
      const bool same = !patches.empty() && patches.back().face == refinement.face_of_quad[q];
      patches.push_back({refinement.face_of_quad[q], same ? patches.back().corner + 1 : 0});
    }
  }

  std::size_t num_patches() const { return patches.size(); }
  PatchGrid grid(std::size_t patch) const { return patch_grid(refinement.quads, patch, patch_levels); }

  std::vector<std::array<Index, 4>> patch_corners() const {
    std::vector<std::array<Index, 4>> corners(num_patches());
    for (std::size_t p = 0; p < corners.size(); ++p) {
      const PatchGrid nodes = grid(p);
      const int n = nodes.size;
      corners[p] = {nodes.at(0, 0), nodes.at(n, 0), nodes.at(n, n), nodes.at(0, n)};
    }
    return corners;
  }
};

using HardSides = std::vector<std::array<bool, 2>>;

/// For every patch, whether its sides along cage edges (j = 0, then i = 0) are tagged.
HardSides hard_sides(const VolumeMesh& cage, const std::vector<SurfacePatch>& patches) {
  const MeshTopology topology(cage);
  std::vector<char> tagged(topology.num_edges(), 0);
  for (const CreaseEdge& crease : cage.tags.creases) tagged[topology.find_edge(crease.v0, crease.v1)] = 1;
  HardSides hard;
  for (const SurfacePatch& patch : patches) {
    const auto face = topology.face(topology.boundary_faces()[patch.face]);
    const std::size_t n = face.size(), k = patch.corner;
    const auto is_tagged = [&](std::size_t other) { return tagged[topology.find_edge(face[k], face[other % n])] != 0; };
    hard.push_back({is_tagged(k + 1), is_tagged(k + n - 1)});
  }
  return hard;
}

/// Chord errors of every patch with 2^a x 2^b quads, a and b up to one level below the refinement's.
class ChordErrors {
 public:
  ChordErrors(const RefinedBoundary& fine, const HardSides& hard) : num_counts_(fine.patch_levels) {
    const auto num_patches = static_cast<std::ptrdiff_t>(fine.num_patches());
    errors_.resize(num_patches * num_counts_ * num_counts_);
#pragma omp parallel for schedule(static)
    for (std::ptrdiff_t p = 0; p < num_patches; ++p) {
      const PatchGrid grid = fine.grid(p);
      for (int b = 0; b < num_counts_; ++b)
        for (int a = 0; a < num_counts_; ++a)
          errors_[slot(p, {a, b})] =
              kBetweenSamples * chord_distance(grid, fine.points, {{grid.size >> a, grid.size >> b}, hard[p]});
    }
  }

  double operator()(std::size_t patch, const std::array<int, 2>& levels) const { return errors_[slot(patch, levels)]; }
  int max_level() const { return num_counts_ - 1; }
  std::size_t num_patches() const { return errors_.size() / (num_counts_ * num_counts_); }

 private:
  std::size_t slot(std::size_t patch, const std::array<int, 2>& levels) const {
    return (patch * num_counts_ + levels[1]) * num_counts_ + levels[0];
  }
  int num_counts_;
  std::vector<double> errors_;
};

/// Chord errors of a uniform tessellation one level coarser than `fine`: the largest, and the share of patches above a
/// bound.
struct UniformError {
  double largest = 0, failing_share = 0;
};

UniformError uniform_error(const RefinedBoundary& fine, const HardSides& hard, double bound) {
  const auto num_patches = static_cast<std::ptrdiff_t>(fine.num_patches());
  double largest = 0;
  std::ptrdiff_t num_failing = 0;
#pragma omp parallel for schedule(static) reduction(max : largest) reduction(+ : num_failing)
  for (std::ptrdiff_t p = 0; p < num_patches; ++p) {
    const double error = kBetweenSamples * chord_distance(fine.grid(p), fine.points, {{2, 2}, hard[p]});
    largest = std::max(largest, error);
    num_failing += error > bound;
  }
  return {largest, static_cast<double>(num_failing) / static_cast<double>(num_patches)};
}

/// Levels to add before looking again: a level divides the error of a smooth part by four.
int further_levels(const UniformError& now, double error_before, double bound) {
  if (now.largest <= bound) return 0;
  if (now.largest > kSlowDecay * error_before && now.failing_share < kSingularShare) return 0;
  return std::max(1, static_cast<int>(std::min(std::log2(now.largest / bound) / 2, 1.0 * kMaxLevels)));
}

/// Measured on the uniform refinement that shows how fine the tessellation must be: one level finer than it.
ChordErrors measure_until(const VolumeMesh& cage, double max_chord_error, std::size_t max_refined_quads) {
  double error_before = INFINITY;
  for (int levels = 1;;) {
    const RefinedBoundary fine(cage, levels + 1);
    const HardSides hard = hard_sides(cage, fine.patches);
    const UniformError error = uniform_error(fine, hard, max_chord_error);
    int further = std::min(further_levels(error, error_before, max_chord_error), kMaxLevels - levels);
    while (further > 0 && fine.refinement.quads.size() > (max_refined_quads >> (2 * further))) --further;
    if (further == 0) return ChordErrors(fine, hard);
    levels += further;
    error_before = error.largest;
  }
}

/// Levels of every strip, by strip number: raised from 0 until every patch is close enough or as fine as can be.
std::vector<int> strip_levels(const ChordErrors& errors, const Strips& strips, double max_chord_error) {
  std::vector<int> levels(strips.num_sides(), 0);
  const int top = errors.max_level();
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t p = 0; p < errors.num_patches(); ++p) {
      const auto& strip = strips.of_patch(p);
      const std::array<int, 2> now{levels[strip[0]], levels[strip[1]]};
      if (errors(p, now) <= max_chord_error || (now[0] == top && now[1] == top)) continue;
      const double if_first = now[0] < top ? errors(p, {now[0] + 1, now[1]}) : INFINITY;
      const double if_second = now[1] < top ? errors(p, {now[0], now[1] + 1}) : INFINITY;
      ++levels[strip[if_second < if_first ? 1 : 0]];
      changed = true;
    }
  }
  return levels;
}

/// Picks every patch's grid out of the uniform refinement; numbers vertices by first use.
class Assembler {
 public:
  Assembler(const RefinedBoundary& boundary, std::span<const Vec3> normals, TessellatedSurface& out)
      : boundary_(boundary), normals_(normals), out_(out), number_of_site_(normals.size(), kNoIndex) {}

  void add_patch(std::size_t patch, const std::array<int, 2>& levels) {
    const PatchGrid vertices = boundary_.grid(patch);
    const PatchGrid sites = patch_grid(boundary_.refinement.quad_sites, patch, boundary_.patch_levels);
    const std::array<int, 2> step{vertices.size >> levels[0], vertices.size >> levels[1]};
    const auto number = [&](int i, int j) { return add_vertex(vertices.at(i, j), sites.at(i, j)); };
    for (int j = 0; j < vertices.size; j += step[1])
      for (int i = 0; i < vertices.size; i += step[0]) {
        const Index a = number(i, j), b = number(i + step[0], j), c = number(i + step[0], j + step[1]);
        out_.quads.push_back({a, b, c, number(i, j + step[1])});
        out_.quad_patches.push_back(static_cast<Index>(patch));
      }
  }

  /// The side of a patch along a cage edge: i = 0 (`across` 1) or j = 0 (`across` 0).
  void add_wire(std::size_t patch, int across, int level) {
    const PatchGrid sites = patch_grid(boundary_.refinement.quad_sites, patch, boundary_.patch_levels);
    const int step = sites.size >> level;
    const auto number = [&](int i) { return number_of_site_[across == 0 ? sites.at(i, 0) : sites.at(0, i)]; };
    for (int i = 0; i < sites.size; i += step) out_.wireframe.push_back({number(i), number(i + step)});
  }

 private:
  Index add_vertex(Index vertex, Index site) {
    if (number_of_site_[site] == kNoIndex) {
      number_of_site_[site] = static_cast<Index>(out_.positions.size());
      out_.positions.push_back(boundary_.points[vertex]);
      out_.normals.push_back(normals_[site]);
    }
    return number_of_site_[site];
  }

  const RefinedBoundary& boundary_;
  std::span<const Vec3> normals_;
  TessellatedSurface& out_;
  std::vector<Index> number_of_site_;
};

}  // namespace

TessellatedSurface tessellate(const VolumeMesh& cage, double max_chord_error, std::size_t max_refined_quads) {
  if (!(max_chord_error > 0)) throw InputError("tessellate: max_chord_error: expected a positive length");
  const ChordErrors errors = measure_until(cage, max_chord_error, max_refined_quads);
  const RefinedBoundary boundary(cage, errors.max_level() + 1, true);
  const Strips strips(boundary.patch_corners());
  const std::vector<int> levels = strip_levels(errors, strips, max_chord_error);
  const std::vector<Vec3> normals = limit_normals(boundary.refinement, cage.positions, boundary.points);

  TessellatedSurface surface;
  surface.patches = boundary.patches;
  Assembler assembler(boundary, normals, surface);
  std::vector<char> drawn(strips.num_sides(), 0);
  for (std::size_t p = 0; p < boundary.num_patches(); ++p) {
    const auto& strip = strips.of_patch(p);
    const std::array<int, 2> patch_levels{levels[strip[0]], levels[strip[1]]};
    assembler.add_patch(p, patch_levels);
    surface.chord_error = std::max(surface.chord_error, errors(p, patch_levels));
    // Sides 0 and 3 lie on cage edges; the other two run to the middle of the face.
    for (const int across : {0, 1})
      if (!std::exchange(drawn[strips.sides(p)[across == 0 ? 0 : 3]], 1))
        assembler.add_wire(p, across, patch_levels[across]);
  }
  return surface;
}

}  // namespace subvol
