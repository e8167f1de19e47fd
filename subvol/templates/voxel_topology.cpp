// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/voxel_topology.h"

#include <algorithm>
#include <bit>

namespace subvol::internal {

namespace {

constexpr int kElements = 27;  // cells of a neighborhood of 3 x 3 x 3

/// True if the octants of a set are connected through faces; also true for the empty set.
constexpr bool face_connected(unsigned octants) {
  if (octants == 0) return true;
  unsigned reached = octants & (~octants + 1);
  for (int round = 0; round < 8; ++round)
    for (unsigned o = 0; o < 8; ++o)
      if (reached >> o & 1)
        for (unsigned axis : {1u, 2u, 4u}) reached |= 1u << (o ^ axis) & octants;
  return reached == octants;
}

/// True if boundary faces at the point look both ways along one axis.
constexpr bool looks_both_ways(unsigned octants) {
  for (unsigned axis : {1u, 2u, 4u}) {
    bool up = false, down = false;
    for (unsigned o = 0; o < 8; ++o) {
      if (o & axis) continue;
      const bool low = octants >> o & 1, high = octants >> (o | axis) & 1;
      up |= low && !high;
      down |= high && !low;
    }
    if (up && down) return true;
  }
  return false;
}

constexpr std::array<bool, 256> make_table(VertexRule rule) {
  std::array<bool, 256> table{};
  for (unsigned m = 0; m < 256; ++m)
    table[m] = face_connected(m) && face_connected(255 - m) && (rule == VertexRule::manifold || !looks_both_ways(m));
  return table;
}

constexpr std::array<bool, 256> kManifold = make_table(VertexRule::manifold);
constexpr std::array<bool, 256> kPillowable = make_table(VertexRule::pillowable);

/// Eight times a point's contribution to the Euler number: the point itself, half its edges, a quarter of its faces, an
/// eighth of its cells.
constexpr int eight_shares(unsigned octants) {
  if (octants == 0) return 0;
  int edges = 0, faces = 0;
  for (unsigned axis = 0; axis < 3; ++axis)
    for (unsigned side = 0; side < 2; ++side) {
      bool edge = false;
      for (unsigned o = 0; o < 8; ++o) edge |= (o >> axis & 1) == side && (octants >> o & 1);
      edges += edge;
    }
  for (unsigned o = 0; o < 8; ++o)
    for (unsigned axis : {1u, 2u, 4u})
      if (!(o & axis)) faces += (octants >> o & 1) || (octants >> (o | axis) & 1);
  return 8 - 4 * edges + 2 * faces - std::popcount(octants);
}

constexpr std::array<int, 256> kEightShares = [] {
  std::array<int, 256> table{};
  for (unsigned m = 0; m < 256; ++m) table[m] = eight_shares(m);
  return table;
}();

/// Faces, edges and vertices of a cell, numbered by the direction from its center: element x+1 + 3(y+1) + 9(z+1).
struct Elements {
  std::array<std::uint32_t, kElements> closure{};   ///< elements in the closure of this one
  std::array<std::uint32_t, kElements> touching{};  ///< elements in its closure, or whose closure contains it
  std::uint32_t all = 0, vertices = 0, edges = 0, faces = 0;
};

constexpr std::array<int, 3> direction(int element) { return {element % 3 - 1, element / 3 % 3 - 1, element / 9 - 1}; }

constexpr Elements make_elements() {
  Elements e;
  for (int a = 0; a < kElements; ++a) {
    const auto da = direction(a);
    const int rank = da[0] * da[0] + da[1] * da[1] + da[2] * da[2];
    if (rank == 0) continue;
    e.all |= 1u << a;
    (rank == 1 ? e.faces : rank == 2 ? e.edges : e.vertices) |= 1u << a;
    for (int b = 0; b < kElements; ++b) {
      const auto db = direction(b);
      bool within = true;
      for (int axis = 0; axis < 3; ++axis) within = within && (da[axis] == 0 || da[axis] == db[axis]);
      if (!within) continue;
      e.closure[a] |= 1u << b;
      e.touching[a] |= 1u << b;
      e.touching[b] |= 1u << a;
    }
  }
  return e;
}

constexpr Elements kCubeElements = make_elements();

/// Returns the part of a set that is connected with its lowest element.
std::uint32_t first_part(std::uint32_t elements) {
  std::uint32_t part = elements & (~elements + 1), front = part;
  while (front) {
    std::uint32_t next = 0;
    for (; front; front &= front - 1) next |= kCubeElements.touching[std::countr_zero(front)];
    front = next & elements & ~part;
    part |= front;
  }
  return part;
}

constexpr std::array<std::array<int, 3>, 6> kFaceDirections{
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

}  // namespace

const std::array<bool, 256>& vertex_table(VertexRule rule) {
  return rule == VertexRule::manifold ? kManifold : kPillowable;
}

VoxelSolid::VoxelSolid(const std::array<int, 3>& cells, VertexRule rule) : cells_(cells), table_(&vertex_table(rule)) {
  const auto [nx, ny, nz] = cells;
  const Index row = nx + 1, layer = row * (ny + 1);
  for (unsigned o = 0; o < 8; ++o)
    point_offsets_[o] = static_cast<Index>(1 - (o & 1)) + row * static_cast<Index>(1 - (o >> 1 & 1)) +
                        layer * static_cast<Index>(1 - (o >> 2 & 1));
  for (std::size_t f = 0; f < 6; ++f)
    face_offsets_[f] = kFaceDirections[f][0] + nx * (kFaceDirections[f][1] + ny * kFaceDirections[f][2]);
  for (int e = 0, n = 0; e < kElements; ++e) {
    const auto d = direction(e);
    if (e != 13) all_offsets_[n++] = d[0] + nx * (d[1] + ny * d[2]);
  }
  const std::size_t count = std::size_t(nx) * std::size_t(ny) * std::size_t(nz);
  filled_.assign(count, 0);
  frozen_.assign(count, 0);
  first_point_.resize(count);
  masks_.assign(std::size_t(layer) * std::size_t(nz + 1), 0);
  std::size_t c = 0;
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i, ++c) {
        first_point_[c] = i + row * j + layer * k;
        frozen_[c] = i == 0 || j == 0 || k == 0 || i == nx - 1 || j == ny - 1 || k == nz - 1;
      }
}

// A cell is octant o of the point at its opposite corner, hence the reversed bits in point_offsets_.
std::array<Index, 8> VoxelSolid::points(Index cell) const {
  std::array<Index, 8> result;
  for (std::size_t o = 0; o < 8; ++o) result[o] = first_point_[cell] + point_offsets_[o];
  return result;
}

std::array<Index, 8> VoxelSolid::cells_around(Index point) const {
  const Index row = cells_[0] + 1, layer = row * (cells_[1] + 1);
  const std::array<Index, 3> at{point % row, point % layer / row, point / layer};
  std::array<Index, 8> result;
  for (unsigned o = 0; o < 8; ++o) {
    std::array<Index, 3> cell;
    bool inside = true;
    for (unsigned a = 0; a < 3; ++a) {
      cell[a] = at[a] - 1 + static_cast<Index>(o >> a & 1);
      inside = inside && cell[a] >= 0 && cell[a] < cells_[a];
    }
    result[o] = inside ? cell[0] + cells_[0] * (cell[1] + cells_[1] * cell[2]) : kNoIndex;
  }
  return result;
}

void VoxelSolid::flip(Index cell) {
  for (unsigned o = 0; o < 8; ++o) masks_[first_point_[cell] + point_offsets_[o]] ^= static_cast<std::uint8_t>(1u << o);
  filled_[cell] = !filled_[cell];
  filled_[cell] ? ++num_filled_ : --num_filled_;
}

int VoxelSolid::good_gain(Index cell) const {
  int gain = 0;
  for (unsigned o = 0; o < 8; ++o) {
    const unsigned mask = masks_[first_point_[cell] + point_offsets_[o]];
    gain += static_cast<int>((*table_)[mask ^ 1u << o]) - static_cast<int>((*table_)[mask]);
  }
  return gain;
}

bool VoxelSolid::good_after_flip(Index cell) const {
  for (unsigned o = 0; o < 8; ++o)
    if (!(*table_)[masks_[first_point_[cell] + point_offsets_[o]] ^ 1u << o]) return false;
  return true;
}

bool VoxelSolid::is_at_boundary(Index cell) const {
  const std::uint8_t uniform = filled_[cell] ? 255 : 0;
  return std::ranges::any_of(point_offsets_,
                             [&](Index offset) { return masks_[first_point_[cell] + offset] != uniform; });
}

VoxelSolid::Contact VoxelSolid::contact(Index cell) const {
  std::uint32_t neighbors = 0;
  for (std::size_t n = 0; n < all_offsets_.size(); ++n)
    if (filled_[cell + all_offsets_[n]]) neighbors |= 1u << n;
  return contact_of(neighbors);
}

VoxelSolid::Contact VoxelSolid::contact_of(std::uint32_t neighbors) {
  Contact k;
  for (int e = 0, n = 0; e < kElements; ++e) {
    if (e == 13) continue;
    if (neighbors >> n++ & 1) k.shared |= kCubeElements.closure[e];
  }
  k.open = kCubeElements.all & ~k.shared;
  k.euler_number = std::popcount(k.shared & kCubeElements.vertices) - std::popcount(k.shared & kCubeElements.edges) +
                   std::popcount(k.shared & kCubeElements.faces);
  for (std::uint32_t rest = k.shared; rest; rest &= ~first_part(rest)) ++k.components;
  return k;
}

bool VoxelSolid::is_simple(Index cell) const {
  if (!good_after_flip(cell)) return false;
  const Contact k = contact(cell);
  return k.components == 1 && k.euler_number == 1;
}

std::vector<std::uint32_t> VoxelSolid::face_groups(std::uint32_t elements) {
  std::vector<std::uint32_t> groups;
  for (std::uint32_t rest = elements; rest;) {
    const std::uint32_t part = first_part(rest);
    std::uint32_t faces = 0;
    for (unsigned f = 0; f < 6; ++f) {
      const auto& d = kFaceDirections[f];
      if (part >> (d[0] + 1 + 3 * (d[1] + 1) + 9 * (d[2] + 1)) & 1) faces |= 1u << f;
    }
    groups.push_back(faces);
    rest &= ~part;
  }
  return groups;
}

int VoxelSolid::euler_number() const {
  int sum = 0;
  for (std::uint8_t mask : masks_) sum += kEightShares[mask];
  return sum / 8;
}

int VoxelSolid::components(bool value, std::vector<int>& component) const {
  component.assign(filled_.size(), -1);
  std::vector<Index> stack;
  int count = 0;
  const auto nx = cells_[0], ny = cells_[1], nz = cells_[2];
  for (std::size_t seed = 0; seed < filled_.size(); ++seed) {
    if (component[seed] >= 0 || (filled_[seed] != 0) != value) continue;
    stack.assign(1, static_cast<Index>(seed));
    component[seed] = count;
    while (!stack.empty()) {
      const Index c = stack.back();
      stack.pop_back();
      std::array<bool, 6> there{true, true, true, true, true, true};
      if (frozen_[c]) {
        const int i = c % nx, j = c / nx % ny, k = c / nx / ny;
        there = {i > 0, i + 1 < nx, j > 0, j + 1 < ny, k > 0, k + 1 < nz};
      }
      for (std::size_t f = 0; f < 6; ++f) {
        if (!there[f]) continue;
        const Index other = c + face_offsets_[f];
        if (component[other] >= 0 || (filled_[other] != 0) != value) continue;
        component[other] = count;
        stack.push_back(other);
      }
    }
    ++count;
  }
  return count;
}

BettiNumbers VoxelSolid::topology() const {
  std::vector<int> component;
  BettiNumbers result;
  result.components = components(true, component);
  result.cavities = components(false, component) - 1;
  result.handles = result.components + result.cavities - euler_number();
  return result;
}

}  // namespace subvol::internal
