// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/auto_template.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/templates/pillow.h"
#include "subvol/templates/plane_grid.h"
#include "subvol/templates/search_stop.h"
#include "subvol/templates/solid_fraction.h"
#include "subvol/templates/template_frames.h"
#include "subvol/templates/voxel_evolution.h"
#include "subvol/templates/voxel_score.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

/// Axes of a grid, and the bounding box of the surface in their coordinates.
struct Frame {
  Mat3 axes;
  Eigen::AlignedBox3d box;
};

/// Orientation, cell size and offset of a grid.
struct Placement {
  Frame frame;
  double size = 0;                    ///< edge length of a cell
  std::array<bool, 3> half_offset{};  ///< true: the grid is shifted by half a cell along this axis
};

/// Edge lengths to try, relative to the length that follows from the count and the volume.
constexpr std::array<double, 7> kCellSizeFactors{1, 0.97, 1.03, 0.94, 1.06, 0.9, 1.1};
constexpr double kLeastCellSizeFactor = *std::min_element(kCellSizeFactors.begin(), kCellSizeFactors.end());
/// Largest number of cells of one grid, including the empty and spare ones, if `cells` are requested in the solid: half
/// a gigabyte per thread or less.
double most_grid_cells(std::size_t cells) { return 1e6 + 64 * static_cast<double>(cells); }

/// Returns the frames whose grids have at most `most` cells in all if about `cells` of them lie in the solid. The
/// farther apart the solid's parts are, or the thinner its walls, the more of a grid is empty.
std::vector<Frame> frames_of_small_grids(double volume, std::size_t cells, double most, std::span<const Frame> frames) {
  const double size = kLeastCellSizeFactor * std::cbrt(volume / static_cast<double>(cells));
  std::vector<Frame> result;
  for (const Frame& frame : frames)
    if (cells_around(frame.box, size).prod() <= most) result.push_back(frame);
  return result;
}

/// The grid around the surface; the placement must be such that its cells can be numbered.
VoxelGrid placed_grid(const Placement& placement) {
  Vec3 offset = Vec3::Zero();
  for (int a = 0; a < 3; ++a)
    if (placement.half_offset[static_cast<std::size_t>(a)]) offset[a] = 0.5;
  return grid_around(placement.frame.axes, placement.frame.box, placement.size, offset);
}

/// A carved grid with the right topology and count.
struct Candidate {
  Mat3 frame;
  VoxelGrid grid;
  std::vector<char> kept;
  double score = 0;
  double share = 0;  ///< number of cells of the template, as a multiple of the requested one
};

/// Range of the numbers of cells that a search accepts, as multiples of the requested one.
struct ShareRange {
  double least = 0, most = std::numeric_limits<double>::infinity();
  bool holds(double share) const { return share >= least && share <= most; }
};

std::size_t num_boundary_faces(const VoxelSolid& solid) {
  std::size_t count = 0;
  for (std::size_t c = 0; c < solid.num_cells(); ++c)
    if (solid.filled(static_cast<Index>(c)))
      for (Index offset : solid.face_offsets()) count += !solid.filled(static_cast<Index>(c) + offset);
  return count;
}

/// The search for templates with one number of cells.
class Search {
 public:
  Search(const SolidBoundary& solid, const AutoTemplateOptions& options, std::size_t cells, std::vector<Frame> frames)
      : solid_(solid), options_(options), cells_(static_cast<double>(cells)), frames_(std::move(frames)), stop_([this] {
          return !options_.progress || options_.progress(fraction_);
        }) {}

  /// Tries grids through the planes of the surface with cells of several sizes; returns the best candidate, if any.
  /// result  receives the numbers of grids and of candidates, and whether the search was cancelled.
  std::optional<Candidate> best_through(const AxisPlanes& planes, double most_cells, AutoTemplateResult& result) const;

  /// Returns false if cancelled. Candidates are in the order of their grids.
  bool run(std::vector<Candidate>& candidates, AutoTemplateResult& result, double fraction_before,
           double fraction_share);

 private:
  std::vector<Placement> placements() const;
  double pillowed_size(const Frame& frame) const;
  double size_through(const AxisPlanes& planes) const;
  std::optional<Candidate> best_of(const Placement& placement, std::size_t& num_right) const {
    constexpr ShareRange kAcceptedCellShares{kLeastCellShare, kMostCellShare};
    if (stop_.is_stopped()) return std::nullopt;
    return best_in(placement.frame.axes, placed_grid(placement), kAcceptedCellShares, num_right);
  }
  std::optional<Candidate> best_in(const Mat3& frame, VoxelGrid grid, const ShareRange& range,
                                   std::size_t& num_right) const;
  double count_of(const VoxelSolid& solid) const {
    return static_cast<double>(solid.num_filled() + (options_.pillow ? num_boundary_faces(solid) : 0));
  }

  const SolidBoundary& solid_;
  const AutoTemplateOptions& options_;
  double cells_;
  std::vector<Frame> frames_;
  double fraction_ = 0;  ///< progress that was told last
  mutable SearchStop stop_;
};

/// Cell size for which the inner cells of a grid and a layer around them add up to the requested count.
double Search::pillowed_size(const Frame& frame) const {
  // The size is found to 0.14 %. kLines lines along each edge of a cell's face estimate its fraction.
  constexpr int kPillowedSizeHalvings = 10, kLines = 3;
  const double plain = std::cbrt(solid_.volume / cells_);
  double low = plain, high = 4 * plain;
  for (int i = 0; i < kPillowedSizeHalvings && !stop_.is_stopped(); ++i) {
    const double size = std::sqrt(low * high);
    const VoxelGrid grid = placed_grid({frame, size, {}});
    const std::vector<double> fractions = solid_fractions(solid_.surface, grid, kLines, &stop_);
    VoxelSolid solid(grid.cells, VertexRule::pillowable);
    for (std::size_t c = 0; c < fractions.size() && !stop_.is_stopped_at(c); ++c)
      if (fractions[c] > 0.5 && solid.may_flip(static_cast<Index>(c))) solid.flip(static_cast<Index>(c));
    (count_of(solid) > cells_ ? low : high) = size;
  }
  return std::sqrt(low * high);
}

/// All combinations of size, frame and offset, the most promising first.
std::vector<Placement> Search::placements() const {
  std::vector<double> sizes;
  for (const Frame& frame : frames_)
    sizes.push_back(options_.pillow ? pillowed_size(frame) : std::cbrt(solid_.volume / cells_));
  std::vector<Placement> result;
  for (double factor : kCellSizeFactors)
    for (int offset = 0; offset < 8; ++offset)
      for (std::size_t f = 0; f < frames_.size(); ++f)
        result.push_back({frames_[f], factor * sizes[f], {(offset & 1) != 0, (offset & 2) != 0, (offset & 4) != 0}});
  return result;
}

/// Returns the best solid in a grid.
std::optional<Candidate> Search::best_in(const Mat3& frame, VoxelGrid grid, const ShareRange& range,
                                         std::size_t& num_right) const {
  constexpr int kLinesOfCell = 4;  // as by default
  // Least fraction of a cell that belongs to the solid. Counts cost |log(share of the count asked for)| times
  // kCountWeight, apart from the first kFreeCount.
  constexpr double kWantedFraction = 0.5, kCountWeight = 0.5, kFreeCount = 0.05;
  constexpr std::array<double, 9> kThresholds{0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.12, 0.9};
  Candidate best{frame, std::move(grid), {}, 0, 0};
  std::vector<double> fractions = solid_fractions(solid_.surface, best.grid, kLinesOfCell, &stop_);
  if (stop_.is_stopped()) return std::nullopt;
  if (!best.grid.lines[0].empty()) empty_cells_at_chamfers(best.grid, fractions);
  const std::vector<double> volumes = cell_volumes(best.grid);
  const auto look_at = [&](VoxelStart start, double threshold) {
    if (stop_.is_stopped()) return;
    VoxelGoal goal{fractions, threshold, solid_.topology, &stop_};
    std::optional<VoxelSolid> solid = start_solid(start, best.grid.cells, VertexRule::pillowable, goal);
    if (!solid || stop_.is_stopped()) return;
    goal.threshold = kWantedFraction;
    evolve(*solid, goal);
    reach_thin_parts(*solid, goal);
    if (stop_.is_stopped()) return;
    const double share = count_of(*solid) / cells_;
    if (!range.holds(share)) return;
    ++num_right;
    const double score = voxel_score(*solid, fractions, volumes, &stop_) +
                         kCountWeight * std::max(0.0, std::abs(std::log(share)) - kFreeCount);
    if (stop_.is_stopped() || (!best.kept.empty() && score >= best.score)) return;
    best.score = score;
    best.share = share;
    best.kept.assign(solid->filled().begin(), solid->filled().end());
  };
  for (double threshold : kThresholds) look_at(VoxelStart::cut, threshold);
  look_at(VoxelStart::grown, kWantedFraction);
  look_at(VoxelStart::shrunk, kWantedFraction);
  if (best.kept.empty()) return std::nullopt;
  return best;
}

/// Estimated cell size for which a grid through planes has the requested count: volume / size^3 cells fill a thick
/// solid, and area / size^2 / 2 a thin one. A pillow adds about area / size^2.
double Search::size_through(const AxisPlanes& planes) const {
  constexpr double kThin = 4;  // twice what flat cells alone need, so that a solid of a few cells across is not thin
  const auto count = [&](double size) {
    const double flat = planes.area / (size * size);
    return std::max(solid_.volume / (size * size * size), flat / kThin) + (options_.pillow ? flat : 0);
  };
  double low = std::cbrt(solid_.volume / cells_), high = low + 2 * std::sqrt(planes.area / cells_);
  if (options_.pillow) high *= 2;
  for (int i = 0; i < 40; ++i) {
    const double size = std::sqrt(low * high);
    (count(size) > cells_ ? low : high) = size;
  }
  return high;
}

/// The size of cells of a grid through planes, corrected until the count is right. The count does not change smoothly
/// with the size, so a size between two that are known is their mean.
class SizeSearch {
 public:
  explicit SizeSearch(double first) : size_(first) {}
  double size() const { return size_; }
  /// The count is `share` times the requested one.
  void correct(double share) {
    constexpr double kMostBelievedShare = 8;  // no size changes as if the count were off by more
    step(share > 1, std::cbrt(std::clamp(share, 1 / kMostBelievedShare, kMostBelievedShare)));
  }
  void be_finer() { step(false, 0.85); }   ///< the topology is out of reach
  void be_coarser() { step(true, 1.25); }  ///< the grid has too many cells

 private:
  void step(bool too_fine, double factor) {
    (too_fine ? finer_ : coarser_) = size_;
    size_ = finer_ > 0 && coarser_ > 0 ? std::sqrt(finer_ * coarser_) : factor * size_;
  }

  double size_, finer_ = 0, coarser_ = 0;  ///< the last ones that were too fine and too coarse; 0: none
};

std::optional<Candidate> Search::best_through(const AxisPlanes& planes, double most_cells,
                                              AutoTemplateResult& result) const {
  constexpr int kGrids = 5;               // grids of different sizes at most
  constexpr double kLeastAligned = 0.03;  // share of the area on planes below which these are no help
  constexpr ShareRange kNearCellShares{0.8, 1.25};
  constexpr ShareRange kAcceptedSharesThroughPlanes{kLeastShareThroughPlanes, kMostShareThroughPlanes};
  std::optional<Candidate> best;
  SizeSearch search(size_through(planes));
  for (int attempt = 0; attempt < kGrids; ++attempt) {
    if (options_.progress && !options_.progress(static_cast<double>(attempt) / kGrids)) {
      result.cancelled = true;
      return std::nullopt;
    }
    const double size = search.size();
    std::array<std::vector<double>, 3> lines = lines_through_planes(solid_.surface, planes, size, most_cells);
    if (lines[0].empty()) {
      search.be_coarser();
      continue;
    }
    if (share_on_lines(planes, lines) < kLeastAligned) break;
    ++result.grids;
    std::size_t num_right = 0;
    std::optional<Candidate> found =
        best_in(planes.frame, grid_through(planes.frame, with_spare_layers(std::move(lines), size)), {}, num_right);
    if (stop_.is_stopped()) {
      result.cancelled = true;
      return std::nullopt;
    }
    if (!found) {
      search.be_finer();
      continue;
    }
    const double share = found->share;
    if (kAcceptedSharesThroughPlanes.holds(share)) {
      result.candidates += num_right;
      if (!best || std::abs(std::log(share)) < std::abs(std::log(best->share))) best = std::move(found);
    }
    if (kNearCellShares.holds(share)) break;
    search.correct(share);
  }
  return best;
}

bool Search::run(std::vector<Candidate>& candidates, AutoTemplateResult& result, double fraction_before,
                 double fraction_share) {
  constexpr std::size_t kMostBatch = 16, kLeastBatch = 4;  // grids between two calls of the progress callback
  constexpr double kEnoughCandidates = 200;                // valid ones, after which a better one hardly ever turns up
  constexpr double kUsualCells = 10'000;  // of larger grids, which differ less, fewer are tried in proportion
  const double share = std::min(1.0, kUsualCells / cells_);
  const double enough = share * kEnoughCandidates;
  const auto batch = std::max(kLeastBatch, static_cast<std::size_t>(share * kMostBatch));
  const std::vector<Placement> all = placements();
  std::size_t right = 0;
  for (std::size_t first = 0; first < all.size() && static_cast<double>(right) < enough; first += batch) {
    const auto fraction = static_cast<double>(first) / static_cast<double>(all.size());
    fraction_ = fraction_before + fraction_share * fraction;
    if (options_.progress && !options_.progress(fraction_)) return false;
    const std::size_t count = std::min(batch, all.size() - first);
    std::array<std::optional<Candidate>, kMostBatch> found;
    std::array<std::size_t, kMostBatch> num_right{};
    ParallelErrors errors;
    std::atomic<int> left = static_cast<int>(count);
#pragma omp parallel
    {
#pragma omp for schedule(dynamic) nowait
      for (std::size_t i = 0; i < count; ++i) {
        errors.guard([&] { found[i] = best_of(all[first + i], num_right[i]); });
        --left;
      }
#pragma omp master
      errors.guard([&] { stop_.wait_for(left); });
    }
    errors.rethrow();
    if (stop_.is_stopped()) return false;
    for (std::size_t i = 0; i < count; ++i) {
      right += num_right[i];
      if (found[i]) candidates.push_back(std::move(*found[i]));
    }
    result.grids += count;
  }
  result.candidates += right;
  return true;
}

/// The lines of a grid from the first to the last that a kept cell touches.
std::array<std::vector<double>, 3> used_lines(const VoxelGrid& grid, std::span<const char> kept) {
  std::array<int, 3> first = grid.cells, last{};
  for (std::size_t c = 0; c < kept.size(); ++c) {
    if (!kept[c]) continue;
    const std::array<int, 3> at = grid.place(static_cast<Index>(c));
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = std::min(first[a], at[a]);
      last[a] = std::max(last[a], at[a] + 1);
    }
  }
  std::array<std::vector<double>, 3> lines;
  for (std::size_t a = 0; a < 3; ++a)
    if (!grid.lines[a].empty()) lines[a].assign(grid.lines[a].begin() + first[a], grid.lines[a].begin() + last[a] + 1);
  return lines;
}

AutoTemplate finished(const Candidate& candidate, const AutoTemplateOptions& options, const BettiNumbers& topology,
                      std::size_t cells) {
  AutoTemplate result{.mesh = voxel_mesh(candidate.grid, candidate.kept),
                      .topology = topology,
                      .cells_asked = cells,
                      .pillowed = options.pillow,
                      .axes = candidate.frame,
                      .score = candidate.score,
                      .lines = used_lines(candidate.grid, candidate.kept),
                      .grid = candidate.grid,
                      .kept = candidate.kept};
  if (options.pillow) result.mesh = pillow(result.mesh);
  return result;
}

}  // namespace

AutoTemplateResult auto_templates(const TriangleMesh& surface, const AutoTemplateOptions& options, std::size_t most) {
  return auto_templates(solid_boundary(surface), options, most);
}

AutoTemplateResult auto_templates(const SolidBoundary& solid, const AutoTemplateOptions& options, std::size_t most) {
  if (options.cells < kLeastTemplateCells || options.cells > kMostTemplateCells)
    throw InputError("the number of cells must be in [" + std::to_string(kLeastTemplateCells) + ", " +
                     std::to_string(kMostTemplateCells) + "], got " + std::to_string(options.cells));
  if (most < 1) throw InputError("auto_templates: at least one template must be asked for");
  std::vector<Frame> frames;
  for (const Mat3& axes : template_frames(solid.surface)) frames.push_back({axes, box_in(axes, solid.surface)});
  constexpr std::array<double, 10> kTemplateCountLadder{1, 1.3, 1.7, 2.2, 3, 4, 6, 9, 14, kMostTemplateGrowth};
  AutoTemplateResult result;
  result.wanted = solid.topology;
  const double most_cells = most_grid_cells(options.cells);
  std::optional<AxisPlanes> planes;
  if (options.through_planes) {
    planes = axis_planes(solid.surface, frame_along_planes(solid.surface));
    planes->levels = edge_levels(solid.surface, planes->frame, planes->tolerance);
  }
  for (std::size_t rung = 0; rung < kTemplateCountLadder.size(); ++rung) {
    const auto cells =
        static_cast<std::size_t>(std::lround(kTemplateCountLadder[rung] * static_cast<double>(options.cells)));
    std::vector<Frame> usable = frames_of_small_grids(solid.volume, cells, most_cells, frames);
    const bool none_usable = usable.empty();
    Search search(solid, options, cells, std::move(usable));
    if (planes) {
      const std::optional<Candidate> best = search.best_through(*planes, most_cells, result);
      if (best) {
        result.templates.push_back(finished(*best, options, solid.topology, cells));
        result.templates.back().aligned_share = share_on_lines(*planes, result.templates.back().lines);
      }
      if (best || result.cancelled) return result;
    }
    if (none_usable && rung == 0) throw too_sparse(cells, most_cells);
    if (none_usable) break;
    std::vector<Candidate> candidates;
    const double done = static_cast<double>(rung) / kTemplateCountLadder.size();
    // Most often only the first count is needed.
    if (!search.run(candidates, result, rung == 0 ? 0 : done, rung == 0 ? 1 : 1.0 / kTemplateCountLadder.size())) {
      result.cancelled = true;
      return result;
    }
    if (candidates.empty()) continue;
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const auto& a, const auto& b) { return a.score < b.score; });
    for (std::size_t i = 0; i < std::min(most, candidates.size()); ++i)
      result.templates.push_back(finished(candidates[i], options, solid.topology, cells));
    break;
  }
  return result;
}

}  // namespace subvol
