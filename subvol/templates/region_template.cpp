// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/region_template.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/templates/auto_template.h"
#include "subvol/templates/plane_grid.h"
#include "subvol/templates/search_stop.h"
#include "subvol/templates/solid_fraction.h"
#include "subvol/templates/template_frames.h"
#include "subvol/templates/voxel_grid.h"
#include "subvol/templates/voxel_labels.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

constexpr double kNoPlanes = 0.03;    ///< share of the area on planes below which these are no help
constexpr double kAllPlanes = 0.999;  ///< share from which on the grid is taken to be exact, and needs no pillows

double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) area += triangle_area(mesh, t);
  return area;
}

/// A labeled grid.
struct LabeledGrid {
  VoxelGrid grid;
  std::vector<int> labels;
  std::size_t wrong_sheets = 0;
  double score = 0;  ///< share of the solid's volume in cells of wrong labels
  double share = 0;  ///< number of cells, as a multiple of the requested one
  double aligned = 0;
};

bool is_better(const LabeledGrid& a, const LabeledGrid& b) {
  return a.wrong_sheets != b.wrong_sheets ? a.wrong_sheets < b.wrong_sheets : a.score < b.score;
}

class RegionSearch {
 public:
  RegionSearch(const RegionSurface& surface, const RegionTemplateOptions& options)
      : surface_(surface),
        options_(options),
        stop_([this] { return !options_.progress || options_.progress(fraction_); }),
        wanted_(topology_of(surface, &stop_)) {
    boundaries_ = boundaries_of_regions(surface);
    for (const TriangleMesh& boundary : boundaries_) {
      areas_.push_back(area_of(boundary));
      area_ += areas_.back();
    }
    for (const double volume : surface.volumes) volume_ += volume;
    voids_ = solid_boundary(outer_surface(surface)).topology.cavities + 1;
    misses_.assign(surface.regions.size(), 0);
  }

  RegionTemplateResult run();

 private:
  std::optional<LabeledGrid> best_through(const AxisPlanes& planes, double cells, double most_cells);
  std::optional<LabeledGrid> best_of_cubes(double cells, double most_cells);
  std::optional<LabeledGrid> labeled(VoxelGrid grid, double cells, bool is_exact);
  LabelFractions fractions_in(const VoxelGrid& grid);
  LabeledGrid scored(VoxelGrid grid, const VoxelLabels& labels, const LabelFractions& fractions) const;
  struct Faults {
    std::vector<char> is_wrong;  ///< by region
    bool same_pairs = false;     ///< true if the same regions meet as in the surface
    std::size_t wrong_sheets = 0;

    bool none() const { return same_pairs && std::ranges::count(is_wrong, 0) == std::ssize(is_wrong); }
  };
  /// found  topology of the labels; null: not all cells could be labeled.
  Faults faults_of(const VoxelLabels& labels, const RegionTopology* found) const;
  /// Raises the weights of wrong regions that are thin. Returns false if there are none.
  bool raise_weights(std::span<const char> is_wrong, double cell_length, std::vector<double>& weights);
  double size_for(double cells, bool counts_pillow) const;
  double count_of(const VoxelLabels& labels, bool counts_pillow) const;
  RegionTemplate finished(const LabeledGrid& candidate, std::size_t cells) const;

  const RegionSurface& surface_;
  const RegionTemplateOptions& options_;
  double fraction_ = 0;
  SearchStop stop_;
  RegionTopology wanted_;
  int voids_ = 1;
  std::vector<TriangleMesh> boundaries_;
  std::vector<double> areas_;        ///< of the boundaries of regions
  double area_ = 0, volume_ = 0;     ///< sums
  std::vector<std::size_t> misses_;  ///< by region
  std::size_t num_grids_ = 0;        ///< that were labeled
};

/// Returns the edge length for which volume / size^3 cells, and a layer of cells on the sheets' sides, are as many as
/// requested.
double RegionSearch::size_for(double cells, bool counts_pillow) const {
  constexpr double kStairsAreaFactor = 1.4;  // area of a staircase, as a multiple of the smooth surface's
  double low = std::cbrt(volume_ / cells), high = 8 * low;
  if (!counts_pillow) return low;
  for (int i = 0; i < 40; ++i) {
    const double size = std::sqrt(low * high);
    (volume_ / std::pow(size, 3) + kStairsAreaFactor * area_ / (size * size) > cells ? low : high) = size;
  }
  return high;
}

double RegionSearch::count_of(const VoxelLabels& labels, bool counts_pillow) const {
  std::size_t count = 0;
  for (std::size_t c = 0; c < labels.num_cells(); ++c) {
    const int label = labels.label(static_cast<Index>(c));
    if (label == kOutsideRegion) continue;
    ++count;
    for (const Index offset : labels.face_offsets())
      count += counts_pillow && labels.label(static_cast<Index>(c) + offset) != label;
  }
  return static_cast<double>(count);
}

/// Returns the shares of each cell that lie outside and in each region; incomplete if the search was stopped.
LabelFractions RegionSearch::fractions_in(const VoxelGrid& grid) {
  constexpr int kLinesOfCell = 4;  // along each edge of a cell's face; they estimate its fractions
  const auto num_regions = static_cast<int>(surface_.regions.size());
  LabelFractions fractions(static_cast<std::size_t>(num_regions) + 1);
  ParallelErrors errors;
#pragma omp parallel for schedule(dynamic)
  for (int r = 0; r < num_regions; ++r)
    errors.guard([&] { fractions[r + 1] = solid_fractions(boundaries_[r], grid, kLinesOfCell, &stop_); });
  errors.rethrow();
  if (stop_.is_stopped()) return fractions;
  fractions[0].assign(grid.num_cells(), 1.0);
  for (int r = 1; r <= num_regions; ++r)
    for (std::size_t c = 0; c < grid.num_cells(); ++c)
      fractions[0][c] = std::max(0.0, fractions[0][c] - fractions[r][c]);
  return fractions;
}

/// Labels a grid. Returns nothing if its regions cannot be made right.
std::optional<LabeledGrid> RegionSearch::labeled(VoxelGrid grid, double cells, bool is_exact) {
  constexpr int kWeightRounds = 5;  // of changing the weights of regions that came out too small or too large
  ++num_grids_;
  const LabelFractions fractions = fractions_in(grid);
  std::vector<double> weights(fractions.size(), 1.0);
  for (int round = 0; round < kWeightRounds; ++round) {
    if (stop_.is_stopped()) return std::nullopt;
    VoxelLabels labels(grid.cells, static_cast<int>(surface_.regions.size()),
                       is_exact ? VertexRule::manifold : VertexRule::pillowable);
    const bool assigned = assign_labels(labels, fractions, weights, wanted_, voids_, &stop_);
    if (stop_.is_stopped()) return std::nullopt;
    RegionTopology found;
    if (assigned) {
      evolve(labels, fractions, &stop_);
      found = labels.topology(&stop_);
      if (stop_.is_stopped()) return std::nullopt;
    }
    const Faults faults = faults_of(labels, assigned ? &found : nullptr);
    if (faults.none()) {
      LabeledGrid result = scored(std::move(grid), labels, fractions);
      result.wrong_sheets = faults.wrong_sheets;
      result.share = count_of(labels, options_.for_pillow && !is_exact) / cells;
      return result;
    }
    if (!raise_weights(faults.is_wrong, std::cbrt(volume_ / cells), weights)) break;
  }
  return std::nullopt;
}

LabeledGrid RegionSearch::scored(VoxelGrid grid, const VoxelLabels& labels, const LabelFractions& fractions) const {
  const std::vector<double> volumes = cell_volumes(grid);
  const double unit = std::abs(grid.edges.determinant());
  LabeledGrid result{std::move(grid), {labels.labels().begin(), labels.labels().end()}};
  for (std::size_t c = 0; c < labels.num_cells(); ++c)
    result.score +=
        (1 - fractions[labels.label(static_cast<Index>(c))][c]) * unit * (volumes.empty() ? 1 : volumes[c]) / volume_;
  return result;
}

RegionSearch::Faults RegionSearch::faults_of(const VoxelLabels& labels, const RegionTopology* found) const {
  Faults faults{std::vector<char>(surface_.regions.size(), 0)};
  if (!found) {
    for (std::size_t r = 0; r < faults.is_wrong.size(); ++r) {
      std::vector<int> component;
      faults.is_wrong[r] = labels.components(static_cast<int>(r) + 1, component) != wanted_.regions[r].components;
    }
    return faults;
  }
  for (std::size_t r = 0; r < faults.is_wrong.size(); ++r) faults.is_wrong[r] = found->regions[r] != wanted_.regions[r];
  faults.same_pairs = found->sheets.size() == wanted_.sheets.size();
  for (const auto& [pair, sheet] : wanted_.sheets) {
    const auto at = found->sheets.find(pair);
    if (at == found->sheets.end()) {
      faults.same_pairs = false;
      for (const int side : pair)
        if (side != kOutsideRegion) faults.is_wrong[static_cast<std::size_t>(side - 1)] = 1;
    } else {
      faults.wrong_sheets += at->second != sheet;
    }
  }
  // A layer that separates two regions is thinner than a cell, so that they touch although they must not.
  for (const auto& [pair, sheet] : found->sheets)
    if (!wanted_.sheets.contains(pair))
      for (std::size_t r = 0; r < faults.is_wrong.size(); ++r) {
        const auto touches = [&](int other) {
          const auto [low, high] = std::minmax({static_cast<int>(r) + 1, other});
          return wanted_.sheets.contains({low, high});
        };
        if (touches(pair[0]) && touches(pair[1])) faults.is_wrong[r] = 1;
      }
  return faults;
}

bool RegionSearch::raise_weights(std::span<const char> is_wrong, double cell_length, std::vector<double>& weights) {
  constexpr double kRegionWeightRise = 1.7, kThinRegionCells = 4;  // regions that are thicker need no weight
  bool raised = false;
  for (std::size_t r = 0; r < is_wrong.size(); ++r) {
    misses_[r] += is_wrong[r] != 0;
    if (!is_wrong[r] || 2 * surface_.volumes[r] / areas_[r] > kThinRegionCells * cell_length) continue;
    weights[r + 1] *= kRegionWeightRise;
    raised = true;
  }
  return raised;
}

std::optional<LabeledGrid> RegionSearch::best_through(const AxisPlanes& planes, double cells, double most_cells) {
  constexpr int kGrids = 5;                                                 // grids of different sizes at most
  constexpr double kLeastNearCountShare = 0.6, kMostNearCountShare = 1.25;  // of the count asked for
  // A grid without right regions makes the next size finer, one without room for planes coarser.
  constexpr double kFinerSizeFactor = 0.85, kCoarserSizeFactor = 1.25;
  constexpr double kMostBelievedShare = 8;  // no size changes as if counts were off by more
  std::optional<LabeledGrid> best;
  double size = size_for(cells, options_.for_pillow), finer = 0, coarser = 0;
  const auto step = [&](bool too_fine, double factor) {
    (too_fine ? finer : coarser) = size;
    size = finer > 0 && coarser > 0 ? std::sqrt(finer * coarser) : factor * size;
  };
  for (int attempt = 0; attempt < kGrids && !stop_.is_stopped(); ++attempt) {
    auto lines = lines_through_planes(surface_.mesh, planes, size, most_cells);
    if (lines[0].empty()) {
      step(true, kCoarserSizeFactor);
      continue;
    }
    const double aligned = share_on_lines(planes, lines);
    if (aligned < kNoPlanes) break;
    std::optional<LabeledGrid> found =
        labeled(grid_through(planes.frame, with_spare_layers(std::move(lines), size)), cells, aligned > kAllPlanes);
    if (!found) {
      step(false, kFinerSizeFactor);
      continue;
    }
    found->aligned = aligned;
    const double share = found->share;
    const bool is_near = share >= kLeastNearCountShare && share <= kMostNearCountShare;
    if (!best || is_better(*found, *best) || (is_near && !(best->share <= kMostNearCountShare)))
      best = std::move(found);
    if (is_near && best->wrong_sheets == 0) break;
    step(share > 1, std::cbrt(std::clamp(share, 1 / kMostBelievedShare, kMostBelievedShare)));
  }
  return best;
}

std::optional<LabeledGrid> RegionSearch::best_of_cubes(double cells, double most_cells) {
  // Share of the count asked for, or its inverse, beyond which the size is corrected.
  constexpr double kMostUncorrectedShare = 1.25;
  constexpr std::array<double, 3> kCubeSizes{1, 0.95, 1.06};
  constexpr std::array<double, 2> kCubeGridOffsets{0, 0.5};
  const std::vector<Mat3> frames = template_frames(surface_.mesh);
  const auto labeled_cubes = [&](const Mat3& frame, double size, double offset) -> std::optional<LabeledGrid> {
    const Eigen::AlignedBox3d box = box_in(frame, surface_.mesh);
    if (!(cells_around(box, size).prod() <= most_cells)) return std::nullopt;
    return labeled(grid_around(frame, box, size, Vec3::Constant(offset)), cells, false);
  };
  double size = size_for(cells, options_.for_pillow);
  std::optional<LabeledGrid> best;
  for (const double factor : kCubeSizes)
    for (const Mat3& frame : frames)
      for (const double offset : kCubeGridOffsets) {
        if (stop_.is_stopped()) return std::nullopt;
        std::optional<LabeledGrid> found = labeled_cubes(frame, factor * size, offset);
        if (!found) continue;
        if (found->share > kMostUncorrectedShare || found->share < 1 / kMostUncorrectedShare) {
          // The estimate was wrong: for all grids alike.
          const double corrected = size * std::cbrt(found->share);
          found = labeled_cubes(frame, factor * corrected, offset);
          if (found) size = corrected;
        }
        if (found && (!best || is_better(*found, *best))) best = std::move(found);
        if (best && best->wrong_sheets == 0 && factor != kCubeSizes.front()) return best;
      }
  return best;
}

RegionTemplate RegionSearch::finished(const LabeledGrid& candidate, std::size_t cells) const {
  RegionTemplate result;
  std::vector<char> kept;
  for (const int label : candidate.labels) kept.push_back(label != kOutsideRegion);
  result.mesh = voxel_mesh(candidate.grid, kept);
  for (const int label : candidate.labels)
    if (label != kOutsideRegion)
      result.mesh.references.push_back(surface_.regions[static_cast<std::size_t>(label - 1)].number);
  result.mesh.regions = surface_.regions;
  std::erase_if(result.mesh.regions, [](const Group& region) { return region.name.empty(); });
  result.cells_asked = cells;
  result.through_planes = candidate.aligned > 0;
  result.aligned_share = candidate.aligned;
  result.wrong_sheets = candidate.wrong_sheets;
  return result;
}

RegionTemplateResult RegionSearch::run() {
  constexpr std::array<double, 8> kRegionCountLadder{1, 1.3, 1.7, 2.2, 3, 4, 6, 9};
  // Cells of a grid, empty ones counted, for each one requested.
  constexpr double kGridRoomPerCell = 64, kLeastGridRoom = 1e6;
  const AxisPlanes planes = axis_planes(surface_.mesh, frame_along_planes(surface_.mesh));
  RegionTemplateResult result;
  if (stop_.is_stopped()) {  // the topology is not known then
    result.cancelled = true;
    return result;
  }
  std::optional<LabeledGrid> best;
  std::size_t asked = 0;
  for (std::size_t rung = 0; rung < kRegionCountLadder.size(); ++rung) {
    fraction_ = rung == 0 ? 0 : static_cast<double>(rung) / kRegionCountLadder.size();
    if (options_.progress && !options_.progress(fraction_)) result.cancelled = true;
    if (result.cancelled) return result;
    const double cells = kRegionCountLadder[rung] * static_cast<double>(options_.cells);
    const double most_cells = kLeastGridRoom + kGridRoomPerCell * cells;
    std::optional<LabeledGrid> found = best_through(planes, cells, most_cells);
    if (!found && !stop_.is_stopped()) found = best_of_cubes(cells, most_cells);
    if (stop_.is_stopped()) {
      result.cancelled = true;
      return result;
    }
    if (num_grids_ == 0) throw too_sparse(options_.cells, most_cells);
    if (found && (!best || is_better(*found, *best))) {
      best = std::move(found);
      asked = static_cast<std::size_t>(std::lround(cells));
    }
    constexpr std::size_t kTriesForSheets = 4;  // rungs; then an interface may have holes or bridges
    if (best && (best->wrong_sheets == 0 || rung + 1 >= kTriesForSheets)) {
      result.made = finished(*best, asked);
      return result;
    }
  }
  const std::size_t most = *std::max_element(misses_.begin(), misses_.end());
  for (std::size_t r = 0; r < misses_.size(); ++r)
    if (misses_[r] > 0 && 2 * misses_[r] >= most) result.missed.push_back(static_cast<Index>(r));
  return result;
}

}  // namespace

RegionTemplateResult region_template(const RegionSurface& surface, const RegionTemplateOptions& options) {
  if (options.cells < kLeastTemplateCells || options.cells > kMostTemplateCells)
    throw InputError("the number of cells must be in [" + std::to_string(kLeastTemplateCells) + ", " +
                     std::to_string(kMostTemplateCells) + "], got " + std::to_string(options.cells));
  return RegionSearch(surface, options).run();
}

}  // namespace subvol
