// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/surface_parts.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/sort_unique.h"

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

/// Sets joined, rims, touching and crowded.
void sort_edges(SurfaceParts& parts) {
  const bool outward = signed_volume_of(parts.surface.mesh) >= 0;
  std::vector<std::array<std::size_t, 2>> pairs;
  for_each_edge(std::span(std::as_const(parts.sides)), [&](std::span<const SurfaceHalfEdge> run) {
    const auto first = static_cast<std::size_t>(run.data() - parts.sides.data());
    if (run.size() == 1) {
      parts.rims.push_back(first);
    } else if (run.size() == 2) {
      parts.joined.push_back({first, first + 1});
    } else if (pair_around_edge(parts.surface.mesh, run, outward, pairs)) {
      parts.touching.push_back(first);
      for (const auto& [i, j] : pairs) parts.joined.push_back({first + i, first + j});
    } else {
      parts.crowded.push_back(first);
    }
  });
}

DisjointSets joined_triangles(const SurfaceParts& parts) {
  DisjointSets sets(parts.surface.mesh.triangles.size());
  for (const auto& [i, j] : parts.joined) sets.join(parts.sides[i].triangle, parts.sides[j].triangle);
  return sets;
}

/// Returns the corner of a side's triangle that is not on the edge.
Index third_corner(const SurfaceParts& parts, std::size_t side) {
  const SurfaceHalfEdge& edge = parts.sides[side];
  for (const Index v : parts.surface.mesh.triangles[edge.triangle])
    if (v != edge.low && v != edge.high) return v;
  return kNoIndex;
}

/// Returns the sides of an edge by twos, if each two of them belong to one part that they close there; else nothing.
/// The two sides of a fold lie on each other, and close nothing.
std::vector<std::array<std::size_t, 2>> pairs_of_parts(const SurfaceParts& parts, std::size_t first,
                                                       DisjointSets& sets) {
  const std::span<const SurfaceHalfEdge> run = parts.edge(first);
  std::map<Index, std::vector<std::size_t>> sides_of;
  for (std::size_t i = 0; i < run.size(); ++i) sides_of[sets.of(run[i].triangle)].push_back(first + i);
  std::vector<std::array<std::size_t, 2>> pairs;
  for (const auto& [part, sides] : sides_of) {
    if (sides.size() != 2 || parts.sides[sides[0]].forward == parts.sides[sides[1]].forward) return {};
    if (third_corner(parts, sides[0]) == third_corner(parts, sides[1])) return {};
    pairs.push_back({sides[0], sides[1]});
  }
  for (const auto& [t, s] : contacts_at_edge(parts.surface.mesh, run))
    if (sets.of(t) == sets.of(s)) return {};
  return pairs;
}

/// Takes the edges at which closed parts lie on each other out of `crowded`. Angles alone do not tell how the sides
/// belong together there; the parts do.
void separate_parts(SurfaceParts& parts) {
  if (parts.crowded.empty()) return;
  DisjointSets sets = joined_triangles(parts);
  std::erase_if(parts.crowded, [&](std::size_t first) {
    const std::vector<std::array<std::size_t, 2>> pairs = pairs_of_parts(parts, first, sets);
    if (pairs.empty()) return false;
    parts.touching.push_back(first);
    parts.joined.insert(parts.joined.end(), pairs.begin(), pairs.end());
    return true;
  });
  std::ranges::sort(parts.touching);
}

/// Sets part and is_closed.
void find_parts(SurfaceParts& parts) {
  DisjointSets sets = joined_triangles(parts);
  std::vector<Index> numbers;
  parts.is_closed.assign(sets.number(numbers), 1);
  parts.part.assign(numbers.begin(), numbers.end());
  for (const std::size_t side : parts.rims) parts.is_closed[parts.part[parts.sides[side].triangle]] = 0;
  for (const std::size_t first : parts.crowded)
    for (const SurfaceHalfEdge& side : parts.edge(first)) parts.is_closed[parts.part[side.triangle]] = 0;
}

}  // namespace

std::span<const SurfaceHalfEdge> SurfaceParts::edge(std::size_t first) const {
  std::size_t last = first;
  while (last < sides.size() && sides[last].low == sides[first].low && sides[last].high == sides[first].high) ++last;
  return std::span(sides).subspan(first, last - first);
}

SurfaceParts surface_parts(const TriangleMesh& surface) {
  SurfaceParts parts;
  parts.surface = welded(surface);
  parts.sides = sorted_half_edges(parts.surface.mesh.triangles, parts.surface.mesh.positions.size());
  sort_edges(parts);
  separate_parts(parts);
  find_parts(parts);
  return parts;
}

std::vector<std::array<Index, 2>> edge_contacts(const SurfaceParts& parts) {
  std::vector<std::array<Index, 2>> contacts;
  for (const auto* edges : {&parts.touching, &parts.crowded})
    for (const std::size_t first : *edges)
      for (const auto& pair : contacts_at_edge(parts.surface.mesh, parts.edge(first))) contacts.push_back(pair);
  sort_unique(contacts);
  return contacts;
}

std::size_t turn_parts_outward(SurfaceParts& parts, const PartNesting& nesting) {
  std::vector<char> turned(parts.num_parts(), 0);
  for (std::size_t p = 0; p < turned.size(); ++p) turned[p] = parts.is_closed[p] && !nesting.faces_out(p);
  for (std::size_t t = 0; t < parts.part.size(); ++t)
    if (turned[parts.part[t]]) std::swap(parts.surface.mesh.triangles[t][1], parts.surface.mesh.triangles[t][2]);
  for (SurfaceHalfEdge& side : parts.sides)
    if (turned[parts.part[side.triangle]]) side.forward = !side.forward;
  return static_cast<std::size_t>(std::count(turned.begin(), turned.end(), 1));
}

}  // namespace subvol::internal
