// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/voxel_labels.h"
#include "subvol/base/disjoint_sets.h"

#include <algorithm>
#include <numeric>
#include <queue>
#include <tuple>
#include <utility>

namespace subvol::internal {

namespace {

constexpr std::array<unsigned, 3> kAxes{1, 2, 4};

bool is_stopped(SearchStop* stop) { return stop && stop->is_stopped(); }

/// Returns the labels that occur, without 0 unless it occurs.
template <std::size_t N>
std::size_t distinct(const std::array<int, N>& labels, std::array<int, N>& found) {
  std::size_t count = 0;
  for (const int label : labels)
    if (std::find(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), label) ==
        found.begin() + static_cast<std::ptrdiff_t>(count))
      found[count++] = label;
  return count;
}

double share(const LabelFractions& fractions, int label, Index cell) { return fractions[label][cell]; }

/// Gives the cells of all but the largest `wanted` components of a label to their neighbors. Returns false if there are
/// too few.
bool drop_surplus(VoxelLabels& labels, int label, int wanted, bool& changed) {
  std::vector<int> component;
  const int count = labels.components(label, component);
  if (count < wanted) return false;
  if (count == wanted) return true;
  changed = true;
  std::vector<std::size_t> size(static_cast<std::size_t>(count), 0);
  for (const int c : component)
    if (c >= 0) ++size[c];
  if (label == kOutsideRegion) size[component[0]] = component.size() + 1;  // the outside itself
  std::vector<int> order(size.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return size[a] > size[b]; });
  std::vector<char> kept(size.size(), 0);
  for (int i = 0; i < wanted; ++i) kept[order[i]] = 1;
  std::vector<std::map<int, int>> votes(size.size());
  for (std::size_t c = 0; c < component.size(); ++c) {
    if (component[c] < 0 || kept[component[c]] || !labels.may_set(static_cast<Index>(c))) continue;
    for (const Index offset : labels.face_offsets())
      if (const int other = labels.label(static_cast<Index>(c) + offset); other != label) ++votes[component[c]][other];
  }
  for (std::size_t c = 0; c < component.size(); ++c) {
    if (component[c] < 0 || kept[component[c]] || votes[component[c]].empty()) continue;
    const auto most = std::max_element(votes[component[c]].begin(), votes[component[c]].end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    labels.set(static_cast<Index>(c), most->first);
  }
  return true;
}

}  // namespace

std::map<std::array<int, 2>, SheetTopology> topology_of_sheets(std::span<const std::array<Index, 4>> faces,
                                                               std::span<const std::array<int, 2>> sheet_of_face) {
  std::map<std::array<int, 2>, std::vector<std::size_t>> members;
  for (std::size_t f = 0; f < faces.size(); ++f) members[sheet_of_face[f]].push_back(f);
  std::map<std::array<int, 2>, SheetTopology> result;
  for (const auto& [key, list] : members) {
    std::vector<Index> vertices;
    std::vector<std::tuple<Index, Index, std::size_t>> edges;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const auto& face = faces[list[i]];
      const std::size_t size = face[3] == kNoIndex ? 3 : 4;
      for (std::size_t k = 0; k < size; ++k) {
        vertices.push_back(face[k]);
        const auto [low, high] = std::minmax(face[k], face[(k + 1) % size]);
        edges.emplace_back(low, high, i);
      }
    }
    std::sort(vertices.begin(), vertices.end());
    std::sort(edges.begin(), edges.end());
    const auto num_vertices = std::unique(vertices.begin(), vertices.end()) - vertices.begin();
    DisjointSets parts(list.size());
    int num_edges = 0;
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const bool same = e > 0 && std::get<0>(edges[e]) == std::get<0>(edges[e - 1]) &&
                        std::get<1>(edges[e]) == std::get<1>(edges[e - 1]);
      num_edges += !same;
      if (same) parts.join(static_cast<Index>(std::get<2>(edges[e])), static_cast<Index>(std::get<2>(edges[e - 1])));
    }
    std::vector<Index> part_of_face;
    result[key] = {static_cast<int>(parts.number(part_of_face)),
                   static_cast<int>(num_vertices) - num_edges + static_cast<int>(list.size())};
  }
  return result;
}

RegionTopology topology_of(const RegionSurface& surface, SearchStop* stop) {
  RegionTopology result;
  std::map<int, int> place{{kOutsideRegion, 0}};
  const std::vector<TriangleMesh> boundaries = boundaries_of_regions(surface);
  for (std::size_t r = 0; r < boundaries.size(); ++r) {
    if (is_stopped(stop)) return result;
    result.regions.push_back(solid_boundary(boundaries[r]).topology);
    place[surface.regions[r].number] = static_cast<int>(result.regions.size());
  }
  std::vector<std::array<Index, 4>> faces;
  std::vector<std::array<int, 2>> keys;
  for (std::size_t t = 0; t < surface.sides.size(); ++t) {
    const auto& [a, b, c] = surface.mesh.triangles[t];
    faces.push_back({a, b, c, kNoIndex});
    const auto [low, high] = std::minmax(place[surface.pair(t)[0]], place[surface.pair(t)[1]]);
    keys.push_back({low, high});
  }
  result.sheets = topology_of_sheets(faces, keys);
  return result;
}

VoxelLabels::VoxelLabels(const std::array<int, 3>& cells, int num_regions, VertexRule rule)
    : cells_(cells),
      num_regions_(num_regions),
      region_table_(&vertex_table(rule)),
      outside_table_(&vertex_table(VertexRule::manifold)),
      frame_(cells, rule),
      labels_(frame_.num_cells(), kOutsideRegion) {}

bool VoxelLabels::good(Index point) const {
  std::array<int, 8> labels{}, found{};
  const auto around = frame_.cells_around(point);
  for (std::size_t o = 0; o < 8; ++o) labels[o] = around[o] == kNoIndex ? kOutsideRegion : labels_[around[o]];
  const std::size_t count = distinct(labels, found);
  if (count == 1) return true;
  for (std::size_t i = 0; i < count; ++i) {
    unsigned mask = 0;
    for (unsigned o = 0; o < 8; ++o) mask |= static_cast<unsigned>(labels[o] == found[i]) << o;
    if (!(found[i] == kOutsideRegion ? *outside_table_ : *region_table_)[mask]) return false;
  }
  return true;
}

int VoxelLabels::good_gain(Index cell, int label) {
  const auto points = frame_.points(cell);
  int gain = 0;
  for (const Index p : points) gain -= good(p);
  const int old = std::exchange(labels_[cell], label);
  for (const Index p : points) gain += good(p);
  labels_[cell] = old;
  return gain;
}

bool VoxelLabels::is_simple(Index cell, int label) {
  const int old = labels_[cell];
  labels_[cell] = label;
  bool all_good = true;
  for (const Index p : frame_.points(cell)) all_good = all_good && good(p);
  labels_[cell] = old;
  if (!all_good) return false;
  std::array<int, 26> around{}, found{};
  for (std::size_t n = 0; n < 26; ++n) around[n] = labels_[cell + frame_.all_offsets()[n]];
  const std::size_t count = distinct(around, found);
  std::array<std::uint32_t, 26> masks{};
  std::uint32_t of_old = 0;
  std::size_t others = 0;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t mask = 0;
    for (std::size_t n = 0; n < 26; ++n) mask |= static_cast<std::uint32_t>(around[n] == found[i]) << n;
    if (found[i] == old)
      of_old = mask;
    else if (found[i] != label)
      masks[others++] = mask;
  }
  // Besides the old and the new label; a cell with more keeps its label
  constexpr std::size_t kMostOtherLabelsAround = 6;
  if (others > kMostOtherLabelsAround) return false;
  for (std::uint32_t subset = 0; subset < 1u << others; ++subset) {
    std::uint32_t neighbors = of_old;
    for (std::size_t i = 0; i < others; ++i)
      if (subset >> i & 1) neighbors |= masks[i];
    const VoxelSolid::Contact contact = VoxelSolid::contact_of(neighbors);
    if (contact.components != 1 || contact.euler_number != 1) return false;
  }
  return true;
}

void VoxelLabels::flood(Index seed, int number, std::vector<int>& component, std::vector<Index>& stack) const {
  const int label = labels_[seed];
  stack.assign(1, seed);
  component[seed] = number;
  while (!stack.empty()) {
    const Index c = stack.back();
    stack.pop_back();
    std::array<bool, 6> there{true, true, true, true, true, true};
    if (!frame_.may_flip(c)) {
      const int i = c % cells_[0], j = c / cells_[0] % cells_[1], k = c / cells_[0] / cells_[1];
      there = {i > 0, i + 1 < cells_[0], j > 0, j + 1 < cells_[1], k > 0, k + 1 < cells_[2]};
    }
    for (std::size_t f = 0; f < 6; ++f) {
      if (!there[f]) continue;
      const Index other = c + frame_.face_offsets()[f];
      if (component[other] >= 0 || labels_[other] != label) continue;
      component[other] = number;
      stack.push_back(other);
    }
  }
}

int VoxelLabels::components(int label, std::vector<int>& component) const {
  component.assign(labels_.size(), -1);
  std::vector<Index> stack;
  int count = 0;
  for (std::size_t seed = 0; seed < labels_.size(); ++seed)
    if (component[seed] < 0 && labels_[seed] == label) flood(static_cast<Index>(seed), count++, component, stack);
  return count;
}

int VoxelLabels::components(std::vector<int>& component) const {
  component.assign(labels_.size(), -1);
  std::vector<Index> stack;
  int count = 0;
  for (std::size_t seed = 0; seed < labels_.size(); ++seed)
    if (component[seed] < 0) flood(static_cast<Index>(seed), count++, component, stack);
  return count;
}

RegionTopology VoxelLabels::topology(SearchStop* stop) const {
  RegionTopology result;
  for (int r = 1; r <= num_regions_; ++r) {
    if (is_stopped(stop)) return result;
    VoxelSolid solid(cells_, VertexRule::manifold);
    for (std::size_t c = 0; c < labels_.size(); ++c)
      if (labels_[c] == r) solid.flip(static_cast<Index>(c));
    result.regions.push_back(solid.topology());
  }
  std::vector<std::array<Index, 4>> faces;
  std::vector<std::array<int, 2>> keys;
  const std::array<Index, 3> steps{1, cells_[0], cells_[0] * cells_[1]};
  for (std::size_t c = 0; c < labels_.size(); ++c) {
    const std::array<int, 3> at{static_cast<int>(c) % cells_[0], static_cast<int>(c) / cells_[0] % cells_[1],
                                static_cast<int>(c) / cells_[0] / cells_[1]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (at[axis] + 1 == cells_[axis]) continue;
      const auto [low, high] = std::minmax(labels_[c], labels_[c + static_cast<std::size_t>(steps[axis])]);
      if (low == high) continue;
      const unsigned u = kAxes[(axis + 1) % 3], v = kAxes[(axis + 2) % 3];
      const auto points = frame_.points(static_cast<Index>(c));
      faces.push_back({points[0], points[u], points[u | v], points[v]});
      keys.push_back({low, high});
    }
  }
  result.sheets = topology_of_sheets(faces, keys);
  return result;
}

bool make_points_good(VoxelLabels& labels, const std::function<double(int label, Index cell)>& share,
                      std::vector<char>& changes, SearchStop* stop) {
  constexpr int kMostRepairsPerVoxel = 4;  // repairs may undo each other forever
  std::vector<Index> bad;
  for (std::size_t p = 0; p < labels.num_points(); ++p)
    if (!labels.good(static_cast<Index>(p))) bad.push_back(static_cast<Index>(p));
  while (!bad.empty()) {
    if (is_stopped(stop)) return false;
    const Index p = bad.back();
    if (labels.good(p)) {
      bad.pop_back();
      continue;
    }
    Index best = kNoIndex;
    int best_label = 0;
    double best_score = 0;
    const auto around = labels.cells_around(p);
    for (const Index c : around) {
      if (c == kNoIndex || !labels.may_set(c) || changes[c] >= kMostRepairsPerVoxel) continue;
      for (const Index other : around) {
        const int label = other == kNoIndex ? 0 : labels.label(other);
        if (label == labels.label(c)) continue;
        const double score = labels.good_gain(c, label) + share(label, c) - share(labels.label(c), c);
        if (best == kNoIndex || score > best_score) best = c, best_label = label, best_score = score;
      }
    }
    if (best == kNoIndex) return false;
    ++changes[best];
    labels.set(best, best_label);
    for (const Index q : labels.points(best))
      if (!labels.good(q)) bad.push_back(q);
  }
  return true;
}

bool assign_labels(VoxelLabels& labels, const LabelFractions& fractions, std::span<const double> weights,
                   const RegionTopology& wanted, int voids, SearchStop* stop) {
  // Making points good may leave surplus parts, and dropping these may make points bad.
  constexpr int kMostLabelRepairRounds = 4;
  for (std::size_t i = 0; i < labels.num_cells(); ++i) {
    constexpr std::size_t kCellsPerCancelCheck = 64;  // there may be thousands of regions
    if (i % kCellsPerCancelCheck == 0 && is_stopped(stop)) return false;
    const auto c = static_cast<Index>(i);
    if (!labels.may_set(c)) continue;
    double sum = 0, largest = 0;
    int label = kOutsideRegion;
    for (int r = 1; r <= labels.num_regions(); ++r) {
      const double weighted = weights[r] * share(fractions, r, c);
      sum += weighted;
      if (weighted > largest) largest = weighted, label = r;
    }
    labels.set(c, sum > share(fractions, kOutsideRegion, c) ? label : kOutsideRegion);
  }
  std::vector<char> changes(labels.num_cells(), 0);
  const auto share_of = [&](int label, Index cell) { return share(fractions, label, cell); };
  for (int round = 0; round < kMostLabelRepairRounds; ++round) {
    if (!make_points_good(labels, share_of, changes, stop)) return false;
    bool changed = false;
    for (int r = 1; r <= labels.num_regions(); ++r)
      if (is_stopped(stop) ||
          !drop_surplus(labels, r, wanted.regions[static_cast<std::size_t>(r - 1)].components, changed))
        return false;
    if (!drop_surplus(labels, kOutsideRegion, voids, changed)) return false;
    if (!changed) return true;
  }
  return false;
}

void evolve(VoxelLabels& labels, const LabelFractions& fractions, SearchStop* stop) {
  constexpr int kMostChangesPerVoxel = 2;        // so that the evolution ends
  using Entry = std::tuple<double, Index, int>;  // gain, cell, label
  const auto less = [](const Entry& a, const Entry& b) {
    if (std::get<0>(a) != std::get<0>(b)) return std::get<0>(a) < std::get<0>(b);
    return std::pair(std::get<1>(a), std::get<2>(a)) > std::pair(std::get<1>(b), std::get<2>(b));
  };
  std::priority_queue<Entry, std::vector<Entry>, decltype(less)> queue(less);
  std::vector<char> changes(labels.num_cells(), 0);
  const auto offer = [&](Index c) {
    if (!labels.may_set(c) || changes[c] >= kMostChangesPerVoxel) return;
    const int old = labels.label(c);
    std::array<int, 6> around{}, found{};
    for (std::size_t f = 0; f < 6; ++f) around[f] = labels.label(c + labels.face_offsets()[f]);
    const std::size_t count = distinct(around, found);
    for (std::size_t i = 0; i < count; ++i) {
      const double gain = share(fractions, found[i], c) - share(fractions, old, c);
      if (gain > 0) queue.push({gain, c, found[i]});
    }
  };
  for (std::size_t c = 0; c < labels.num_cells(); ++c) offer(static_cast<Index>(c));
  while (!queue.empty() && !is_stopped(stop)) {
    const auto [gain, c, label] = queue.top();
    queue.pop();
    const double now = share(fractions, label, c) - share(fractions, labels.label(c), c);
    if (now != gain || changes[c] >= kMostChangesPerVoxel || !labels.is_simple(c, label)) continue;
    labels.set(c, label);
    ++changes[c];
    for (const Index offset : labels.all_offsets()) offer(c + offset);
  }
}

}  // namespace subvol::internal
