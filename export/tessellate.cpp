// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/tessellate.h"

#include "export/patch_grid.h"
#include "subvol/error.h"
#include "subvol/limit_surface.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace subvol {
namespace {

constexpr int kMaxLevels = 7;             // one below what refine_boundary makes: the measure looks one level further
constexpr double kBetweenSamples = 4.0 / 3;  // see the header: what a quadratic patch may add between the samples

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

  RefinedBoundary(const VolumeMesh& cage, int levels, bool with_tangents = false)
      : refinement(refine_boundary(cage, levels, with_tangents)),
        points(refinement.positions.apply(cage.positions)),
        patch_levels(levels - 1) {}

  std::size_t num_patches() const { return refinement.quads.size() >> (2 * patch_levels); }
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

/// Chord errors of every patch with 2^a x 2^b quads, a and b up to one level below the refinement's.
class ChordErrors {
 public:
  explicit ChordErrors(const RefinedBoundary& fine) : num_counts_(fine.patch_levels) {
    const auto num_patches = static_cast<std::ptrdiff_t>(fine.num_patches());
    errors_.resize(num_patches * num_counts_ * num_counts_);
#pragma omp parallel for schedule(static)
    for (std::ptrdiff_t p = 0; p < num_patches; ++p) {
      const PatchGrid grid = fine.grid(p);
      for (int b = 0; b < num_counts_; ++b)
        for (int a = 0; a < num_counts_; ++a)
          errors_[slot(p, {a, b})] = kBetweenSamples * chord_distance(grid, fine.points, {grid.size >> a, grid.size >> b});
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

/// The largest chord error of a uniform tessellation one level coarser than `fine`.
double uniform_error(const RefinedBoundary& fine) {
  const auto num_patches = static_cast<std::ptrdiff_t>(fine.num_patches());
  double largest = 0;
#pragma omp parallel for schedule(static) reduction(max : largest)
  for (std::ptrdiff_t p = 0; p < num_patches; ++p)
    largest = std::max(largest, chord_distance(fine.grid(p), fine.points, {2, 2}));
  return kBetweenSamples * largest;
}

/// The uniform refinement that shows how fine the tessellation must be: one level finer than it.
RefinedBoundary refine_until(const VolumeMesh& cage, double max_chord_error, std::size_t max_refined_quads) {
  for (int levels = 1;;) {
    RefinedBoundary fine(cage, levels + 1);
    const double error = uniform_error(fine);
    int further = 0;
    if (error > max_chord_error)  // a level divides the error by four
      further = std::max(1, static_cast<int>(std::min(std::log2(error / max_chord_error) / 2, 1.0 * kMaxLevels)));
    further = std::min(further, kMaxLevels - levels);
    while (further > 0 && fine.refinement.quads.size() > (max_refined_quads >> (2 * further))) --further;
    if (further == 0) return fine;
    levels += further;
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

std::vector<SurfacePatch> list_patches(const RefinedBoundary& boundary) {
  std::vector<SurfacePatch> patches;
  for (std::size_t p = 0; p < boundary.num_patches(); ++p) {
    const Index face = boundary.refinement.face_of_quad[p << (2 * boundary.patch_levels)];
    const bool same = !patches.empty() && patches.back().face == face;
    patches.push_back({face, same ? patches.back().corner + 1 : 0});
  }
  return patches;
}

}  // namespace

TessellatedSurface tessellate(const VolumeMesh& cage, double max_chord_error, std::size_t max_refined_quads) {
  if (!(max_chord_error > 0)) throw InputError("tessellate: max_chord_error: expected a positive length");
  const ChordErrors errors(refine_until(cage, max_chord_error, max_refined_quads));
  const RefinedBoundary boundary(cage, errors.max_level() + 1, true);
  const Strips strips(boundary.patch_corners());
  const std::vector<int> levels = strip_levels(errors, strips, max_chord_error);
  const std::vector<Vec3> normals = limit_normals(boundary.refinement, cage.positions, boundary.points);

  TessellatedSurface surface;
  surface.patches = list_patches(boundary);
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
