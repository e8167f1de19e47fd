// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/restricted_voronoi.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/fit/geometry/triangle_cutter.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

namespace subvol::internal {

namespace {

/// Triangles whose sums are made together, and positions that are located so: the same for any number of threads.
constexpr std::size_t kVoronoiChunkSize = 256;
constexpr double kMaxLooseness = 2;  // of the tree's boxes; beyond it, the tree is built anew

Vec3 box_center(std::span<const Vec3> points) {
  Vec3 low = points[0], high = points[0];
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return low + 0.5 * (high - low);
}

/// Computes the positions relative to a center and the nearest site of each. Each search starts from the site before,
/// which does not change the result.
void locate(std::span<const Vec3> positions, const Vec3& center, const SiteTree& tree, std::vector<Vec3>& moved,
            std::vector<Index>& nearest) {
  moved.resize(positions.size());
  nearest.resize(positions.size());
  const std::size_t num_chunks = (positions.size() + kVoronoiChunkSize - 1) / kVoronoiChunkSize;
#pragma omp parallel for schedule(dynamic)
  for (std::size_t chunk = 0; chunk < num_chunks; ++chunk) {
    Index before = kNoIndex;
    for (std::size_t i = chunk * kVoronoiChunkSize; i < std::min(positions.size(), (chunk + 1) * kVoronoiChunkSize);
         ++i) {
      moved[i] = positions[i] - center;
      before = before == kNoIndex ? tree.nearest(moved[i]).place
                                  : tree.nearest(moved[i], (tree.position(before) - moved[i]).squaredNorm()).place;
      nearest[i] = before;
    }
  }
}

}  // namespace

RestrictedVoronoi::RestrictedVoronoi(std::span<const Vec3> sites) {
  if (sites.empty()) throw InputError("RestrictedVoronoi: sites must not be empty");
  take_sites(sites);
}

void RestrictedVoronoi::update_sites(std::span<const Vec3> sites) {
  if (sites.size() != num_sites()) throw InputError("RestrictedVoronoi::update_sites: the number of sites has changed");
  take_sites(sites);
}

void RestrictedVoronoi::take_sites(std::span<const Vec3> sites) {
  for (const Vec3& s : sites)
    if (!s.allFinite()) throw InputError("RestrictedVoronoi: sites must be finite");
  center_ = box_center(sites);
  std::vector<Vec3> moved(sites.size());
  for (std::size_t i = 0; i < sites.size(); ++i) moved[i] = sites[i] - center_;
  if (num_sites() == moved.size()) tree_.refit(moved);
  if (num_sites() != moved.size() || tree_.looseness() > kMaxLooseness) tree_ = SiteTree(moved);
}

Index RestrictedVoronoi::nearest_site(const Vec3& point) const {
  const Index place = tree_.nearest(point - center_).place;
  return place == kNoIndex ? kNoIndex : tree_.site(place);
}

void RestrictedVoronoi::compute(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles,
                                std::vector<VoronoiPiece>& pieces) const {
  for (const auto& t : triangles)
    for (Index v : t)
      if (v < 0 || static_cast<std::size_t>(v) >= positions.size())
        throw InputError("RestrictedVoronoi::compute: triangle corners must be in [0, positions.size())");
  if (!std::ranges::all_of(positions, [](const Vec3& p) { return p.allFinite(); }))
    for (const auto& t : triangles)
      for (Index v : t)
        if (!positions[v].allFinite())
          throw InputError("RestrictedVoronoi::compute: position " + std::to_string(v) + " is not finite");
  std::vector<Vec3> moved;
  std::vector<Index> nearest;
  locate(positions, center_, tree_, moved, nearest);

  const std::size_t num_chunks = (triangles.size() + kVoronoiChunkSize - 1) / kVoronoiChunkSize;
  struct Segment {
    int thread;
    std::size_t begin, end, target;
  };
  std::vector<Segment> segments(num_chunks);
  std::vector<std::vector<VoronoiPiece>> found(static_cast<std::size_t>(omp_get_max_threads()));
  const auto cut = [&](std::size_t chunk, int thread, TriangleCutter& cutter, std::vector<VoronoiPiece>& mine) {
    segments[chunk] = {thread, mine.size(), 0, 0};
    for (std::size_t t = chunk * kVoronoiChunkSize; t < std::min(triangles.size(), (chunk + 1) * kVoronoiChunkSize);
         ++t) {
      const auto& v = triangles[t];
      cutter.cut(static_cast<Index>(t), {moved[v[0]], moved[v[1]], moved[v[2]]},
                 {nearest[v[0]], nearest[v[1]], nearest[v[2]]}, mine);
    }
    segments[chunk].end = mine.size();
  };
  const auto make_room = [&] {
    std::size_t total = 0;
    for (Segment& s : segments) {
      s.target = total;
      total += s.end - s.begin;
    }
    pieces.resize(total);
  };
  const auto join = [&](const Segment& s) {
    const auto from = found[s.thread].begin();
    std::copy(from + static_cast<std::ptrdiff_t>(s.begin), from + static_cast<std::ptrdiff_t>(s.end),
              pieces.begin() + static_cast<std::ptrdiff_t>(s.target));
  };
  ParallelErrors errors;
#pragma omp parallel
  {
    const int thread = omp_get_thread_num();
    std::vector<VoronoiPiece>& mine = omp_get_num_threads() == 1 ? pieces : found[thread];
    mine.clear();
    std::optional<TriangleCutter> cutter;
    errors.guard([&] { cutter.emplace(tree_); });
#pragma omp for schedule(dynamic)
    for (std::size_t chunk = 0; chunk < num_chunks; ++chunk) errors.guard([&] { cut(chunk, thread, *cutter, mine); });
#pragma omp single
    if (omp_get_num_threads() > 1) errors.guard(make_room);
    if (omp_get_num_threads() > 1)
#pragma omp for schedule(dynamic)
      for (std::size_t chunk = 0; chunk < num_chunks; ++chunk) errors.guard([&] { join(segments[chunk]); });
  }
  errors.rethrow();
}

std::vector<VoronoiPiece> RestrictedVoronoi::compute(std::span<const Vec3> positions,
                                                     std::span<const std::array<Index, 3>> triangles) const {
  std::vector<VoronoiPiece> pieces;
  compute(positions, triangles, pieces);
  return pieces;
}

}  // namespace subvol::internal
