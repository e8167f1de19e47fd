// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/strip_cuts.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/export/chord_distance.h"

#include <algorithm>
#include <bit>

namespace subvol::internal {
namespace {

constexpr double kBetweenSamples = 16.0 / 15;  // the largest value of a quadratic over a triangle, relative to that at
                                               // quarter points
constexpr double kEqualCutsRatio = 0.7;        // ratio of errors above which two ways to cut count as equally good
constexpr int kShortestStripInterval = kCellSteps;  // quads have samples between their corners

/// An interval of a strip that should be halved to improve a quad.
struct Wish {
  Index strip;
  std::size_t interval;
  double error;
};

/// State of one patch with its present cuts.
struct PatchState {
  double error = 0;
  std::vector<Wish> wishes;
};

/// Samples the quads of one patch and judges them.
class PatchJudge {
 public:
  PatchJudge(const PatchSurface& patches, const StripCuts& cuts, Index patch)
      : hard_(patches.sharp_sides(patch)), strips_(cuts.strips(patch)) {
    for (int d : {0, 1}) {
      const std::span<const int> t = cuts.cuts(strips_[d]);
      for (std::size_t i = 0; i + 1 < t.size(); ++i)
        for (int k = 0; k < kCellSteps; ++k) samples_[d].push_back(t[i] + (t[i + 1] - t[i]) / kCellSteps * k);
      samples_[d].push_back(t.back());
    }
    points_.resize(samples_[0].size() * samples_[1].size());
    patches.evaluate(patch, samples_[0], samples_[1], points_.data());
  }

  PatchState judge(double max_chord_error) const {
    PatchState state;
    for (std::size_t j = 0; j < num_intervals(1); ++j)
      for (std::size_t i = 0; i < num_intervals(0); ++i) {
        const CellSamples cell = samples(i, j);
        const std::array<bool, 2> hard = {hard_[0] && j == 0, hard_[1] && i == 0};
        const auto error_with = [&](int u, int v) { return kBetweenSamples * chord_distance(cell, {{u, v}, hard}); };
        const double error = error_with(kCellSteps, kCellSteps);
        state.error = std::max(state.error, error);
        if (error <= max_chord_error) continue;
        const bool may[2] = {can_halve(0, i), can_halve(1, j)};
        const double if_u = error_with(kCellSteps / 2, kCellSteps), if_v = error_with(kCellSteps, kCellSteps / 2);
        const double better = std::min(if_u, if_v), worse = std::max(if_u, if_v);
        const bool both = better > max_chord_error && better > kEqualCutsRatio * worse;
        if (may[0] && (both || if_u <= if_v || !may[1])) state.wishes.push_back({strips_[0], i, error});
        if (may[1] && (both || if_v < if_u || !may[0])) state.wishes.push_back({strips_[1], j, error});
      }
    return state;
  }

 private:
  std::size_t num_intervals(int d) const { return samples_[d].size() / kCellSteps; }

  bool can_halve(int d, std::size_t interval) const {
    return samples_[d][kCellSteps * (interval + 1)] - samples_[d][kCellSteps * interval] > kShortestStripInterval;
  }

  CellSamples samples(std::size_t i, std::size_t j) const {
    CellSamples cell;
    const std::size_t stride = samples_[0].size(), row = kCellSteps + 1;
    for (std::size_t k = 0; k < row; ++k)
      std::copy_n(points_.begin() + (kCellSteps * j + k) * stride + kCellSteps * i, row, cell.points.begin() + k * row);
    return cell;
  }

  std::array<bool, 2> hard_;
  std::array<Index, 2> strips_;
  std::array<std::vector<int>, 2> samples_;
  std::vector<Vec3> points_;
};

int depth_of(const StripCuts& cuts) {
  int shortest = PatchSurface::kPatchSideUnits;
  for (std::size_t s = 0; s < cuts.num_strips(); ++s) {
    const std::span<const int> t = cuts.cuts(static_cast<Index>(s));
    for (std::size_t i = 0; i + 1 < t.size(); ++i) shortest = std::min(shortest, t[i + 1] - t[i]);
  }
  return std::countr_zero(static_cast<unsigned>(PatchSurface::kPatchSideUnits / shortest));
}

/// For every interval of every strip, the largest error that asks for halving it; 0 if none does.
using Demand = std::vector<std::vector<double>>;

Demand total_demand(const StripCuts& cuts, const std::vector<PatchState>& states) {
  Demand demand(cuts.num_strips());
  for (std::size_t s = 0; s < demand.size(); ++s) demand[s].assign(cuts.num_intervals(static_cast<Index>(s)), 0.0);
  for (const PatchState& state : states)
    for (const Wish& wish : state.wishes) {
      double& most = demand[wish.strip][wish.interval];
      most = std::max(most, wish.error);
    }
  return demand;
}

/// Number of quads if all demands above a threshold are met.
std::size_t num_quads_above(double threshold, const Demand& demand, const StripCuts& cuts, std::size_t num_patches) {
  std::vector<std::size_t> intervals(demand.size());
  for (std::size_t s = 0; s < demand.size(); ++s)
    intervals[s] = demand[s].size() +
                   std::count_if(demand[s].begin(), demand[s].end(), [&](double error) { return error > threshold; });
  std::size_t sum = 0;
  for (std::size_t p = 0; p < num_patches; ++p) {
    const auto& [u, v] = cuts.strips(static_cast<Index>(p));
    sum += intervals[u] * intervals[v];
  }
  return sum;
}

/// Returns the smallest threshold, found by doubling, that keeps to the bound on quads.
double affordable_threshold(const Demand& demand, const StripCuts& cuts, std::size_t num_patches,
                            double max_chord_error, std::size_t max_quads) {
  double most = 0;
  for (const auto& errors : demand)
    for (const double error : errors) most = std::max(most, error);
  double threshold = max_chord_error;
  while (threshold < most && num_quads_above(threshold, demand, cuts, num_patches) > max_quads) threshold *= 2;
  return threshold;
}

/// Meets the demands above a threshold; returns for each strip whether it has changed.
std::vector<char> halve_above(double threshold, const Demand& demand, StripCuts& cuts) {
  std::vector<char> changed(demand.size(), 0);
  for (std::size_t s = 0; s < demand.size(); ++s) {
    std::vector<char> chosen;
    for (const double error : demand[s]) chosen.push_back(error > threshold);
    changed[s] = std::any_of(chosen.begin(), chosen.end(), [](char c) { return c != 0; });
    if (changed[s]) cuts.halve(static_cast<Index>(s), chosen);
  }
  return changed;
}

}  // namespace

StripCuts::StripCuts(const PatchSurface& patches) : strips_(patches.num_patches()) {
  const SurfaceTopology& quads = patches.quads();
  DisjointSets edges(quads.num_edges());
  const auto side = [&](std::size_t patch, int k) { return quads.corner_edges[4 * patch + k]; };
  for (std::size_t p = 0; p < strips_.size(); ++p)
    for (int k : {0, 1}) edges.join(side(p, k), side(p, k + 2));
  std::vector<Index> number(quads.num_edges(), kNoIndex);
  for (std::size_t p = 0; p < strips_.size(); ++p)
    for (int k : {0, 1}) {
      Index& strip = number[edges.of(side(p, k))];
      if (strip == kNoIndex) {
        strip = static_cast<Index>(cuts_.size());
        cuts_.push_back({0, PatchSurface::kPatchSideUnits});
      }
      strips_[p][k] = strip;
    }
}

void StripCuts::halve(Index strip, std::span<const char> chosen) {
  const std::vector<int> before = std::move(cuts_[strip]);
  std::vector<int>& after = cuts_[strip] = {before[0]};
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i]) after.push_back((before[i] + before[i + 1]) / 2);
    after.push_back(before[i + 1]);
  }
}

CutResult cut_strips(PatchSurface& patches, double max_chord_error, std::size_t max_quads,
                     const WorkProgress& progress) {
  CutResult result{StripCuts(patches), 0};
  StripCuts& cuts = result.cuts;
  std::vector<PatchState> states(patches.num_patches());
  std::vector<char> changed(cuts.num_strips(), 1);
  double share = 0;  // each round is assumed to take half of the remaining time
  while (std::any_of(changed.begin(), changed.end(), [](char c) { return c != 0; })) {
    patches.prepare(depth_of(cuts) + std::countr_zero(static_cast<unsigned>(kCellSteps)));
    ParallelErrors errors;
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t p = 0; p < states.size(); ++p) {
      const auto& [u, v] = cuts.strips(static_cast<Index>(p));
      if (changed[u] || changed[v])
        errors.guard([&] { states[p] = PatchJudge(patches, cuts, static_cast<Index>(p)).judge(max_chord_error); });
    }
    errors.rethrow();
    share = (1 + share) / 2;
    if (!goes_on(progress, "tessellation", share)) break;
    const Demand demand = total_demand(cuts, states);
    changed = halve_above(affordable_threshold(demand, cuts, states.size(), max_chord_error, max_quads), demand, cuts);
  }
  for (const PatchState& state : states) result.chord_error = std::max(result.chord_error, state.error);
  return result;
}

}  // namespace subvol::internal
