// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/voxel_evolution.h"

#include "subvol/templates/voxel_steps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <queue>
#include <span>
#include <vector>

namespace subvol::internal {

namespace {

constexpr int kLongLoop = 40;  // cells; longer loops count as this long

/// Computes the length, in cells, of the shortest path between two groups of a cell's face neighbors. The path runs
/// through cells with filled(c) == side and not through the cell itself. Returns 0 if there is none, and kLongLoop if
/// it is longer than that and is known to exist.
class LoopLengths {
 public:
  explicit LoopLengths(std::size_t num_cells) : stamp_(num_cells, 0) {}

  int length(const VoxelSolid& solid, Index cell, bool side, const std::array<std::uint32_t, 2>& groups,
             bool is_known_to_exist) {
    stamps_ += 2;  // stamps_ - 1: an end, stamps_: reached
    queue_.clear();
    stamp_[cell] = stamps_;
    const auto for_each_in = [&](std::uint32_t group, const auto& visit) {
      for (std::size_t f = 0; f < 6; ++f)
        if (group >> f & 1) visit(cell + solid.face_offsets()[f]);
    };
    for_each_in(groups[1], [&](Index c) { stamp_[c] = stamps_ - 1; });
    for_each_in(groups[0], [&](Index c) {
      stamp_[c] = stamps_;
      queue_.push_back(c);
    });
    int steps = 1;
    for (std::size_t q = 0, end = queue_.size(); q < queue_.size(); ++steps, end = queue_.size()) {
      if (is_known_to_exist && steps >= kLongLoop) return kLongLoop;
      for (; q < end; ++q) {
        if (!solid.may_flip(queue_[q])) continue;  // the outer layer has no neighbors beyond; paths around it are long
        for (Index offset : solid.face_offsets()) {
          const Index c = queue_[q] + offset;
          if (solid.filled(c) != side || stamp_[c] == stamps_) continue;
          if (stamp_[c] == stamps_ - 1) return steps + 1;
          stamp_[c] = stamps_;
          queue_.push_back(c);
        }
      }
    }
    return 0;
  }

 private:
  std::vector<int> stamp_;
  std::vector<Index> queue_;
  int stamps_ = 0;
};

/// A flip that adds or removes one handle.
struct HandleFlip {
  Index cell = kNoIndex;
  double gain = 0;
  bool through_filled = false;          ///< the loop runs through filled cells (true) or empty ones
  std::array<std::uint32_t, 2> ends{};  ///< faces at either end of the loop
};

/// True if flipping a cell changes the number of handles in the wanted direction; then sets the fields of `flip` except
/// `gain`.
bool handle_flip(const VoxelSolid& solid, Index cell, bool add_handle, HandleFlip& flip) {
  if (!solid.may_flip(cell) || !solid.is_at_boundary(cell) || !solid.good_after_flip(cell)) return false;
  const VoxelSolid::Contact k = solid.contact(cell);
  const bool two_discs = k.components == 2 && k.euler_number == 2;
  const bool annulus = k.components == 1 && k.euler_number == 0;
  // Two discs: filling the cell closes a loop of the solid, and emptying it opens one. Annulus: filling the cell plugs
  // a loop of the outside, and emptying it opens one.
  const bool closes = !solid.filled(cell);
  if (!(two_discs && add_handle == closes) && !(annulus && add_handle != closes)) return false;
  const std::vector<std::uint32_t> groups = VoxelSolid::face_groups(two_discs ? k.shared : k.open);
  if (groups.size() != 2 || groups[0] == 0 || groups[1] == 0) return false;
  flip.cell = cell;
  flip.through_filled = two_discs;
  flip.ends = {groups[0], groups[1]};
  return true;
}

/// Returns the best flip that changes the number of handles, or none. Long loops are best for adding a handle, short
/// ones for removing one. The gain of a flip must be above -tolerance.
std::optional<Index> best_handle_flip(const VoxelSolid& solid, const VoxelGoal& goal, bool add_handle, double tolerance,
                                      LoopLengths& loops) {
  constexpr std::size_t kLookedAt = 40;  // most promising flips, whose loops are measured
  std::vector<HandleFlip> flips;
  for (std::size_t c = 0; c < solid.num_cells(); ++c) {
    if (goal.is_stopped_at(c)) return std::nullopt;
    HandleFlip flip;
    flip.gain = solid.may_flip(static_cast<Index>(c)) ? goal.gain(solid, static_cast<Index>(c)) : -1;
    if (flip.gain > -tolerance && handle_flip(solid, static_cast<Index>(c), add_handle, flip)) flips.push_back(flip);
  }
  std::stable_sort(flips.begin(), flips.end(),
                   [](const HandleFlip& a, const HandleFlip& b) { return a.gain > b.gain; });
  if (flips.size() > kLookedAt) flips.resize(kLookedAt);
  std::optional<Index> best;
  double best_score = 0;
  for (const HandleFlip& flip : flips) {
    if (goal.is_stopped()) return std::nullopt;
    // A cell that closes or opens a loop of one connected side touches that side at both ends. A loop that shall vanish
    // may be none: the cell may join two sides.
    const bool is_one = flip.through_filled ? goal.topology.components == 1 : goal.topology.cavities == 0;
    const int length = loops.length(solid, flip.cell, flip.through_filled, flip.ends, add_handle && is_one);
    if (length == 0) continue;  // the flip would join or split components, or open or close a cavity
    const double measure = std::min(length, kLongLoop);
    const double score = (flip.gain + tolerance) * (add_handle ? measure : 1 / measure);
    if (!best || score > best_score) best = flip.cell, best_score = score;
  }
  return best;
}

/// Flips cells that are not as wanted, in order of decreasing gain, as long as the topology does not change. Looks at
/// some cells first, and then at those around what it flips.
void evolve_from(VoxelSolid& solid, const VoxelGoal& goal, std::span<const Index> first) {
  using Entry = std::pair<double, Index>;
  const auto less = [](const Entry& a, const Entry& b) {
    return a.first != b.first ? a.first < b.first : a.second > b.second;
  };
  std::priority_queue<Entry, std::vector<Entry>, decltype(less)> queue(less);
  std::vector<char> waiting(solid.num_cells(), 0);
  const auto offer = [&](Index c) {
    if (waiting[c] || !solid.may_flip(c) || solid.filled(c) == goal.wants(c)) return;
    waiting[c] = 1;
    queue.push({goal.gain(solid, c), c});
  };
  for (std::size_t i = 0; i < first.size() && !goal.is_stopped_at(i); ++i) offer(first[i]);
  // A cell is flipped at most once: afterwards it is as wanted.
  while (!queue.empty() && !goal.is_stopped()) {
    const Index c = queue.top().second;
    queue.pop();
    waiting[c] = 0;
    if (!solid.is_simple(c)) continue;
    solid.flip(c);
    for (Index offset : solid.all_offsets()) offer(c + offset);
  }
}

}  // namespace

void evolve(VoxelSolid& solid, const VoxelGoal& goal) {
  std::vector<Index> unwanted;
  for (std::size_t c = 0; c < solid.num_cells() && !goal.is_stopped_at(c); ++c)
    if (solid.filled(static_cast<Index>(c)) != goal.wants(static_cast<Index>(c)))
      unwanted.push_back(static_cast<Index>(c));
  evolve_from(solid, goal, unwanted);
}

bool make_points_good(VoxelSolid& solid, const VoxelGoal& goal) {
  constexpr int kMostFlipsPerVoxel = 3;  // repairs may undo each other forever
  std::vector<char> flips(solid.num_cells(), 0);
  std::vector<Index> bad;
  for (std::size_t p = 0; p < solid.num_points(); ++p)
    if (!solid.good(static_cast<Index>(p))) bad.push_back(static_cast<Index>(p));
  while (!bad.empty()) {
    // The best flip among all cells at the most recently found bad point.
    if (goal.is_stopped()) return false;
    const Index p = bad.back();
    if (solid.good(p)) {
      bad.pop_back();
      continue;
    }
    Index best = kNoIndex;
    double best_score = 0;
    for (Index c : solid.cells_around(p)) {
      if (c == kNoIndex || !solid.may_flip(c) || flips[c] >= kMostFlipsPerVoxel) continue;
      const double score = solid.good_gain(c) + goal.gain(solid, c);
      if (best == kNoIndex || score > best_score) best = c, best_score = score;
    }
    if (best == kNoIndex) return false;
    ++flips[best];
    solid.flip(best);
    for (Index q : solid.points(best))
      if (!solid.good(q)) bad.push_back(q);
  }
  return true;
}

bool drop_surplus(VoxelSolid& solid, const VoxelGoal& goal) {
  std::vector<int> component;
  // Keeps the largest components of one side; of the empty side, the outside (the component of the first cell) is
  // always kept.
  const auto drop = [&](bool side, int wanted) {
    const int count = solid.components(side, component);
    if (count < wanted) return false;
    if (count == wanted) return true;
    std::vector<double> size(static_cast<std::size_t>(count), 0.0);
    for (std::size_t c = 0; c < component.size(); ++c)
      if (component[c] >= 0) size[component[c]] += side ? goal.fractions[c] : 1 - goal.fractions[c];
    if (!side) size[component[0]] = static_cast<double>(component.size()) + 1;
    std::vector<int> order(size.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return size[a] > size[b]; });
    std::vector<char> kept(size.size(), 0);
    for (int i = 0; i < wanted; ++i) kept[order[i]] = 1;
    for (std::size_t c = 0; c < component.size() && !goal.is_stopped_at(c); ++c)
      if (component[c] >= 0 && !kept[component[c]]) solid.flip(static_cast<Index>(c));
    return !goal.is_stopped();
  };
  return drop(true, goal.topology.components) && drop(false, goal.topology.cavities + 1);
}

bool match_handles(VoxelSolid& solid, const VoxelGoal& goal) {
  if (goal.is_stopped()) return false;
  const BettiNumbers now = solid.topology();
  if (now.components != goal.topology.components || now.cavities != goal.topology.cavities) return false;
  // Many wrong handles mean that the grid is too coarse; correcting them one by one would not give a good likeness.
  constexpr int kMostWrongHandles = 24;
  const int missing = goal.topology.handles - now.handles;
  if (missing == 0) return true;
  if (std::abs(missing) > kMostWrongHandles) return false;
  LoopLengths loops(solid.num_cells());
  std::array<Index, 26> around{};
  for (int i = 0; i < std::abs(missing); ++i) {
    std::optional<Index> cell;
    for (double tolerance : {0.25, 1.0})  // first slightly against the shape, then if necessary right through it
      if (!cell) cell = best_handle_flip(solid, goal, missing > 0, tolerance, loops);
    if (!cell) return false;
    solid.flip(*cell);
    if (i == 0) {
      evolve(solid, goal);
    } else {  // what may be flipped since the last evolution is near the cell
      for (std::size_t n = 0; n < around.size(); ++n) around[n] = *cell + solid.all_offsets()[n];
      evolve_from(solid, goal, around);
    }
    if (goal.is_stopped()) return false;
  }
  return solid.topology() == goal.topology;
}

void reach_thin_parts(VoxelSolid& solid, const VoxelGoal& goal) {
  constexpr double kLeastFraction = 0.02;  // of a cell; less does not belong to a part that must be reached
  // Fewer steps from the solid are near enough. Rounds: one part that is reached may lead to the next.
  constexpr int kLeastFarSteps = 2, kMostThinPartRounds = 3;
  std::vector<char> given_up(solid.num_cells(), 0);
  std::vector<Index> previous, path, far;
  for (int round = 0; round < kMostThinPartRounds; ++round) {
    const std::vector<int> steps = voxel_steps(
        solid, [&](Index c) { return solid.filled(c); }, [&](Index c) { return goal.fractions[c] > kLeastFraction; },
        &previous, goal.stop);
    if (goal.is_stopped()) return;
    far.clear();
    for (std::size_t c = 0; c < steps.size(); ++c)
      if (steps[c] >= kLeastFarSteps && !given_up[c]) far.push_back(static_cast<Index>(c));
    if (far.empty()) return;
    std::stable_sort(far.begin(), far.end(), [&](Index a, Index b) { return steps[a] > steps[b]; });
    for (Index end : far) {
      if (goal.is_stopped()) return;
      path.clear();
      for (Index c = end; !solid.filled(c); c = previous[c]) path.push_back(c);
      if (path.size() < static_cast<std::size_t>(kLeastFarSteps)) continue;
      given_up[end] = 1;
      for (; !path.empty() && solid.may_flip(path.back()) && solid.is_simple(path.back()); path.pop_back())
        solid.flip(path.back());
    }
  }
}

std::optional<VoxelSolid> start_solid(VoxelStart start, const std::array<int, 3>& cells, VertexRule rule,
                                      const VoxelGoal& goal) {
  VoxelSolid solid(cells, rule);
  const auto fill = [&](const auto& chosen) {
    for (std::size_t c = 0; c < solid.num_cells() && !goal.is_stopped_at(c); ++c)
      if (solid.may_flip(static_cast<Index>(c)) && chosen(static_cast<Index>(c))) solid.flip(static_cast<Index>(c));
  };
  if (start == VoxelStart::cut) {
    fill([&](Index c) { return goal.wants(c); });
    if (solid.num_filled() == 0 || !make_points_good(solid, goal) || goal.is_stopped() || !drop_surplus(solid, goal))
      return std::nullopt;
  } else {
    if (goal.topology.components != 1 || goal.topology.cavities != 0) return std::nullopt;
    const auto fullest = std::max_element(goal.fractions.begin(), goal.fractions.end()) - goal.fractions.begin();
    fill([&](Index c) { return start == VoxelStart::shrunk || c == fullest; });
    evolve(solid, goal);
  }
  if (goal.is_stopped() || !match_handles(solid, goal)) return std::nullopt;
  return solid;
}

}  // namespace subvol::internal
