// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/label_surface.h"

#include "subvol/base/dense_solve.h"
#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/sort_unique.h"
#include "subvol/templates/search_stop.h"
#include "subvol/templates/voxel_labels.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

constexpr int kRim = kLabelRim;

/// A face between two voxels, its normal pointing from `pair[0]` to `pair[1]`; labels are places in the list of
/// regions, 0: outside.
struct Face {
  std::array<Index, 4> corners;
  std::array<int, 2> pair;
};

/// The sheets between voxels and the way they are smoothed, in units of voxels.
class LabelSheets {
 public:
  LabelSheets(const LabelGrid& grid, const LabelSurfaceOptions& options)
      : grid_(grid), options_(options), stop_([&options] { return !options.cancelled || !options.cancelled(); }) {
    const auto [nx, ny, nz] = grid.counts;
    if (nx < 1 || ny < 1 || nz < 1 || static_cast<double>(nx) * ny * nz != static_cast<double>(grid.labels.size()))
      throw InputError(formatted("segmentation: it has %zu labels, expected those of %d x %d x %d voxels",
                                 grid.labels.size(), nx, ny, nz));
    if (!can_number_voxels(grid.counts))
      throw InputError("segmentation: it has more than 2^31 - 1 voxels, those of the empty layers around it included");
    values_ = grid.labels;
    sort_unique(values_);
    std::erase(values_, kOutsideRegion);
    if (values_.empty()) throw InputError("segmentation: no voxel has a label above 0");
  }

  RegionSurface run() {
    const VoxelLabels labels = cleaned();
    if (stop_.is_stopped()) return {};
    list_faces(labels);
    find_neighbors();
    smooth();
    restore_volumes();
    return stop_.is_stopped() ? RegionSurface{} : result();
  }

 private:
  VoxelLabels cleaned();
  std::size_t drop_specks(VoxelLabels& labels, bool keeps_regions);
  void require_regions(const VoxelLabels& labels) const;
  void list_faces(const VoxelLabels& labels);
  void find_neighbors();
  void smooth();
  void restore_volumes();
  std::vector<double> volumes() const;
  RegionSurface result() const;

  const LabelGrid& grid_;
  const LabelSurfaceOptions& options_;
  SearchStop stop_;
  std::vector<int> values_;     ///< the label of each region
  std::vector<double> wanted_;  ///< volume of each region
  std::vector<Face> faces_;
  std::vector<Vec3> start_, positions_;  ///< in voxels, the first one's center being at (0, 0, 0)
  std::vector<std::size_t> offsets_;     ///< where the neighbors of each vertex begin
  std::vector<Index> neighbors_;
  std::size_t specks_ = 0;
};

/// Gives specks to their neighbors, those of one label after the other. Returns how many there were.
/// keeps_regions  the largest component of each region stays, even if it is a speck.
std::size_t LabelSheets::drop_specks(VoxelLabels& labels, bool keeps_regions) {
  std::vector<int> component;
  const auto count = static_cast<std::size_t>(labels.components(component));
  const int outside = component.front();
  std::vector<std::size_t> size(count, 0);
  for (const int c : component) ++size[c];
  const auto is_small = [&](int c) { return c != outside && size[c] < options_.least_voxels; };
  std::vector<std::vector<Index>> cells(count);  // of small components
  std::vector<int> label_of(count);
  for (std::size_t c = 0; c < component.size(); ++c) {
    label_of[component[c]] = labels.label(static_cast<Index>(c));
    if (is_small(component[c])) cells[component[c]].push_back(static_cast<Index>(c));
  }
  std::vector<std::vector<int>> of_label(static_cast<std::size_t>(labels.num_regions()) + 1);
  for (std::size_t c = 0; c < count; ++c) of_label[label_of[c]].push_back(static_cast<int>(c));
  DisjointSets sets(count);  // of components that specks have connected
  const auto join = [&](Index a, Index b) {
    const Index kept = std::min(sets.of(a), sets.of(b)), other = std::max(sets.of(a), sets.of(b));
    if (kept == other) return;
    const bool were_small = is_small(kept) && is_small(other);
    sets.join(kept, other);
    size[kept] += size[other];
    if (were_small) cells[kept].insert(cells[kept].end(), cells[other].begin(), cells[other].end());
    cells[other].clear();
  };
  std::size_t dropped = 0;
  for (int label = 0; label <= labels.num_regions() && !stop_.is_stopped(); ++label) {
    std::vector<int>& of_this = of_label[label];
    for (int& c : of_this) c = sets.of(c);
    sort_unique(of_this);
    if (keeps_regions && label != kOutsideRegion && !of_this.empty()) {
      const auto largest =
          std::max_element(of_this.begin(), of_this.end(), [&](int a, int b) { return size[a] < size[b]; });
      of_this.erase(largest);
    }
    for (const int c : of_this) {
      if (!is_small(c)) continue;
      std::map<int, int> votes;
      for (const Index cell : cells[c])
        for (const Index offset : labels.face_offsets())
          if (const int other = labels.label(cell + offset); other != label) ++votes[other];
      if (votes.empty()) continue;
      ++dropped;
      const int most = std::max_element(votes.begin(), votes.end(), [](const auto& a, const auto& b) {
                         return a.second < b.second;
                       })->first;
      const std::vector<Index> own = cells[c];
      for (const Index cell : own) labels.set(cell, most);
      for (const Index cell : own)
        for (const Index offset : labels.face_offsets())
          if (labels.label(cell + offset) == most) join(c, component[cell + offset]);
    }
  }
  return dropped;
}

VoxelLabels LabelSheets::cleaned() {
  // Making points good may leave specks, and dropping these may make points bad.
  constexpr int kMostSpeckRepairRounds = 4;
  const auto [nx, ny, nz] = grid_.counts;
  VoxelLabels labels({nx + 2 * kRim, ny + 2 * kRim, nz + 2 * kRim}, static_cast<int>(values_.size()),
                     VertexRule::manifold);
  std::vector<int> given(labels.num_cells(), kOutsideRegion);
  std::size_t from = 0;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i, ++from) {
        const int value = grid_.labels[from];
        const Index c = i + kRim + (nx + 2 * kRim) * (j + kRim + (ny + 2 * kRim) * (k + kRim));
        if (value != kOutsideRegion)
          given[c] = 1 + static_cast<int>(std::ranges::lower_bound(values_, value) - values_.begin());
        labels.set(c, given[c]);
      }
  const auto share = [&](int label, Index cell) {     // a voxel is much more its own label than that of a neighbor
    constexpr double kNeighborVoxelShare = 0.5 / 26;  // half of the share, for each of the 26 neighbors
    double sum = given[cell] == label ? 0.5 : 0;
    for (const Index offset : labels.all_offsets()) sum += given[cell + offset] == label ? kNeighborVoxelShare : 0;
    return sum;
  };
  specks_ = drop_specks(labels, false);
  wanted_.assign(values_.size(), 0.0);
  for (const int label : labels.labels())
    if (label != kOutsideRegion) wanted_[static_cast<std::size_t>(label - 1)] += 1;
  for (std::size_t r = 0; r < values_.size(); ++r)
    if (wanted_[r] == 0)
      throw InputError("segmentation: label " + std::to_string(values_[r]) + " has only specks of fewer than " +
                       std::to_string(options_.least_voxels) + " voxels");
  std::vector<char> changes(labels.num_cells(), 0);
  for (int round = 0; round < kMostSpeckRepairRounds; ++round) {
    // An edge of four faces may stay. It does no harm.
    make_points_good(labels, share, changes, &stop_);
    if (stop_.is_stopped()) break;
    const std::size_t dropped = drop_specks(labels, true);
    if (dropped == 0) break;
    specks_ += dropped;
  }
  if (!stop_.is_stopped()) require_regions(labels);
  return labels;
}

/// Throws if less than a speck and less than half is left of a region.
void LabelSheets::require_regions(const VoxelLabels& labels) const {
  std::vector<std::size_t> left(values_.size(), 0);
  for (const int label : labels.labels())
    if (label != kOutsideRegion) ++left[static_cast<std::size_t>(label - 1)];
  for (std::size_t r = 0; r < values_.size(); ++r) {
    const auto count = static_cast<double>(left[r]);
    if (count > 0 && (left[r] >= options_.least_voxels || 2 * count >= wanted_[r])) continue;
    throw InputError(
        formatted("segmentation: of the %.0f voxels of label %d, %zu are left without the places where "
                  "regions touch along an edge or at a corner alone: it is too thin for its voxels",
                  wanted_[r], values_[r], left[r]));
  }
}

void LabelSheets::list_faces(const VoxelLabels& labels) {
  constexpr std::array<unsigned, 3> kAxes{1, 2, 4};
  const auto [nx, ny, nz] = grid_.counts;
  const std::array<int, 3> cells{nx + 2 * kRim, ny + 2 * kRim, nz + 2 * kRim};
  const std::array<Index, 3> steps{1, cells[0], cells[0] * cells[1]};
  std::vector<Index> number(labels.num_points(), kNoIndex);
  const auto vertex = [&](Index point) {
    if (number[point] == kNoIndex) {
      number[point] = static_cast<Index>(start_.size());
      const Index row = cells[0] + 1, layer = row * (cells[1] + 1);
      // A voxel's center is half a voxel from its corners.
      start_.push_back(Vec3(point % row, point % layer / row, point / layer) - Vec3::Constant(kRim + 0.5));
    }
    return number[point];
  };
  for (std::size_t c = 0; c < labels.num_cells(); ++c) {
    if (!labels.may_set(static_cast<Index>(c))) continue;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const bool up : {false, true}) {
        const int behind = labels.label(static_cast<Index>(c));
        const int front = labels.label(static_cast<Index>(c) + (up ? steps[axis] : -steps[axis]));
        // Each face is listed once, from the side that is behind it.
        const bool is_mine = behind != kOutsideRegion && (front == kOutsideRegion || behind < front);
        if (behind == front || !is_mine) continue;
        const unsigned a = kAxes[axis], u = kAxes[(axis + 1) % 3], v = kAxes[(axis + 2) % 3];
        const auto points = labels.points(static_cast<Index>(c));
        // The point of which the cell is octant o lies on the other side of it: bit 0 is the far side.
        const unsigned base = up ? 0 : a;
        std::array<Index, 4> corners{points[base | u | v], points[base | v], points[base], points[base | u]};
        if (!up) std::swap(corners[1], corners[3]);
        Face face{{}, {behind, front}};
        for (std::size_t i = 0; i < 4; ++i) face.corners[i] = vertex(corners[i]);
        faces_.push_back(face);
      }
  }
  positions_ = start_;
}

void LabelSheets::find_neighbors() {
  std::vector<std::tuple<Index, Index, std::array<int, 2>>> sides;
  for (const Face& face : faces_)
    for (std::size_t i = 0; i < 4; ++i) {
      const auto [low, high] = std::minmax(face.corners[i], face.corners[(i + 1) % 4]);
      sides.emplace_back(low, high, face.pair);
    }
  std::sort(sides.begin(), sides.end());
  std::vector<std::array<Index, 2>> smooth, curves;
  for (std::size_t first = 0, last; first < sides.size(); first = last) {
    const auto& [low, high, pair] = sides[first];
    bool same = true;
    for (last = first; last < sides.size() && std::get<0>(sides[last]) == low && std::get<1>(sides[last]) == high;
         ++last)
      same = same && std::get<2>(sides[last]) == pair;
    (same && last - first == 2 ? smooth : curves).push_back({low, high});
  }
  std::vector<char> on_curve(start_.size(), 0);
  for (const auto& edge : curves)
    for (const Index v : edge) on_curve[v] = 1;
  std::vector<std::vector<Index>> lists(start_.size());
  for (const auto& [a, b] : smooth)
    for (const auto& [v, w] : {std::pair(a, b), std::pair(b, a)})
      if (!on_curve[v]) lists[v].push_back(w);
  for (const auto& [a, b] : curves) {
    lists[a].push_back(b);
    lists[b].push_back(a);
  }
  offsets_.assign(1, 0);
  for (const auto& list : lists) {
    neighbors_.insert(neighbors_.end(), list.begin(), list.end());
    offsets_.push_back(neighbors_.size());
  }
}

void LabelSheets::smooth() {
  constexpr double kShrinkingStep = 0.5, kInflatingStep = -0.53, kMostSmoothingMove = 1;  // voxels
  std::vector<Vec3> next(positions_.size());
  for (int round = 0; round < options_.rounds && !stop_.is_stopped(); ++round)
    for (const double step : {kShrinkingStep, kInflatingStep}) {
      for (std::size_t v = 0; v < positions_.size(); ++v) {
        next[v] = positions_[v];
        const std::size_t count = offsets_[v + 1] - offsets_[v];
        if (count == 0) continue;
        Vec3 mean = Vec3::Zero();
        for (std::size_t i = offsets_[v]; i < offsets_[v + 1]; ++i) mean += positions_[neighbors_[i]];
        next[v] += step * (mean / static_cast<double>(count) - positions_[v]);
        const Vec3 moved = next[v] - start_[v];
        if (moved.norm() > kMostSmoothingMove) next[v] = start_[v] + kMostSmoothingMove / moved.norm() * moved;
      }
      std::swap(positions_, next);
    }
}

/// Area vector of a face.
Vec3 area_vector(const Face& face, std::span<const Vec3> x) {
  return 0.5 * (x[face.corners[2]] - x[face.corners[0]]).cross(x[face.corners[3]] - x[face.corners[1]]);
}

std::vector<double> LabelSheets::volumes() const {
  std::vector<double> result(values_.size(), 0.0);
  for (const Face& face : faces_) {
    double below = 0;
    for (const auto& [i, j] : {std::pair(1, 2), std::pair(2, 3)})  // the two triangles that the face becomes
      below += positions_[face.corners[0]].dot(positions_[face.corners[i]].cross(positions_[face.corners[j]])) / 6;
    if (face.pair[0] != kOutsideRegion) result[static_cast<std::size_t>(face.pair[0] - 1)] += below;
    if (face.pair[1] != kOutsideRegion) result[static_cast<std::size_t>(face.pair[1] - 1)] -= below;
  }
  return result;
}

/// Moves each sheet along its normals: of all moves that give the regions their volumes to first order, the one with
/// the least integral of its square.
void LabelSheets::restore_volumes() {
  constexpr int kMostVolumeNewtonSteps = 8;          // they end at kRelativeVolumeTolerance
  constexpr double kRelativeVolumeTolerance = 1e-5;  // of each region
  constexpr double kMostSheetStep = 0.3;             // voxels
  std::map<std::array<int, 2>, Index> sheet_of_pair;
  for (const Face& face : faces_) sheet_of_pair.try_emplace(face.pair, 0);
  Index count = 0;
  for (auto& [pair, number] : sheet_of_pair) number = count++;
  const auto n = static_cast<Eigen::Index>(values_.size());
  for (int round = 0; round < kMostVolumeNewtonSteps && !stop_.is_stopped(); ++round) {
    const std::vector<double> now = volumes();
    Eigen::VectorXd missing(n);
    double worst = 0;
    for (Eigen::Index r = 0; r < n; ++r) {
      const auto place = static_cast<std::size_t>(r);
      missing[r] = wanted_[place] - now[place];
      worst = std::max(worst, std::abs(missing[r]) / wanted_[place]);
    }
    if (worst < kRelativeVolumeTolerance) return;
    std::vector<double> area(static_cast<std::size_t>(count), 0.0);
    for (const Face& face : faces_)
      area[static_cast<std::size_t>(sheet_of_pair[face.pair])] += area_vector(face, positions_).norm();
    std::vector<MatrixEntry> matrix;  // M A M^T, M: signs of the sheets in the regions
    for (const auto& [pair, number] : sheet_of_pair)
      for (const int a : pair)
        for (const int b : pair)
          if (a != kOutsideRegion && b != kOutsideRegion)
            matrix.push_back({a - 1, b - 1, (a == b ? 1 : -1) * area[static_cast<std::size_t>(number)]});
    const Eigen::VectorXd y = least_norm_solution(matrix, missing);
    // Normals of each sheet at each vertex, one after the other: at a curve, each sheet asks for its own move.
    std::vector<std::pair<std::pair<Index, Index>, Vec3>> normals;  // vertex, sheet
    for (const Face& face : faces_)
      for (const Index v : face.corners)
        normals.push_back({{v, sheet_of_pair[face.pair]}, area_vector(face, positions_)});
    std::stable_sort(normals.begin(), normals.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<double> step(static_cast<std::size_t>(count), 0.0);
    for (const auto& [pair, number] : sheet_of_pair)
      step[static_cast<std::size_t>(number)] = std::clamp(
          (pair[0] == kOutsideRegion ? 0 : y[pair[0] - 1]) - (pair[1] == kOutsideRegion ? 0 : y[pair[1] - 1]),
          -kMostSheetStep, kMostSheetStep);
    for (std::size_t first = 0, last; first < normals.size();) {
      const Index v = normals[first].first.first;
      Mat3 sum = 1e-3 * Mat3::Identity();
      Vec3 right = Vec3::Zero();
      while (first < normals.size() && normals[first].first.first == v) {
        Vec3 normal = Vec3::Zero();
        for (last = first; last < normals.size() && normals[last].first == normals[first].first; ++last)
          normal += normals[last].second;
        normal.normalize();
        sum += normal * normal.transpose();
        right += step[static_cast<std::size_t>(normals[first].first.second)] * normal;
        first = last;
      }
      const Vec3 move = sum.ldlt().solve(right);
      positions_[v] += move.norm() > kMostSheetStep ? Vec3(kMostSheetStep / move.norm() * move) : move;
    }
  }
}

RegionSurface LabelSheets::result() const {
  RegionSurface surface;
  for (const int value : values_) surface.regions.push_back({"", value, 3});
  for (const Vec3& p : positions_) surface.mesh.positions.push_back(grid_.origin + grid_.edges * p);
  const bool is_mirrored = grid_.edges.determinant() < 0;
  const auto value_of = [&](int label) {
    return label == kOutsideRegion ? kOutsideRegion : values_[static_cast<std::size_t>(label - 1)];
  };
  for (const Face& face : faces_) {
    const auto& [a, b, c, d] = face.corners;
    for (std::array<Index, 3> triangle : {std::array{a, b, c}, std::array{a, c, d}}) {
      if (is_mirrored) std::swap(triangle[1], triangle[2]);
      surface.mesh.triangles.push_back(triangle);
      surface.sides.push_back({value_of(face.pair[0]), value_of(face.pair[1])});
    }
  }
  orient_sheets(surface);
  if (specks_ > 0)
    surface.notes.push_back(formatted("%zu specks of fewer than %zu voxels were given to what is around them", specks_,
                                      options_.least_voxels));
  return surface;
}

}  // namespace

RegionSurface surface_of_labels(const LabelGrid& grid, const LabelSurfaceOptions& options) {
  return LabelSheets(grid, options).run();
}

}  // namespace subvol
