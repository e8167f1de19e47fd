// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/mfem_numbering.h"

#include "subvol/mesh/face_groups.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <map>
#include <utility>

namespace subvol::internal {

namespace {

using Edge = std::array<int, 2>;
using Face = std::array<int, 4>;  ///< the last is -1 for a triangle

struct MfemTopology {
  std::vector<Edge> edges;
  std::vector<Face> faces;
};

const MfemTopology& topology_of(CellKind kind) {
  static const MfemTopology kTet{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}},
                                 {{1, 2, 3, -1}, {0, 3, 2, -1}, {0, 1, 3, -1}, {0, 2, 1, -1}}};
  static const MfemTopology kPrism{{{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}},
                                   {{0, 2, 1, -1}, {3, 4, 5, -1}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}}};
  static const MfemTopology kHex{
      {{0, 1}, {1, 2}, {3, 2}, {0, 3}, {4, 5}, {5, 6}, {7, 6}, {4, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}},
      {{3, 2, 1, 0}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}, {4, 5, 6, 7}}};
  static const MfemTopology kPyramid{{{0, 1}, {1, 2}, {3, 2}, {0, 3}, {0, 4}, {1, 4}, {2, 4}, {3, 4}},
                                     {{3, 2, 1, 0}, {0, 1, 4, -1}, {1, 2, 4, -1}, {2, 3, 4, -1}, {3, 0, 4, -1}}};
  switch (kind) {
    case CellKind::tet: return kTet;
    case CellKind::prism: return kPrism;
    case CellKind::pyramid: return kPyramid;
    case CellKind::hex: break;
  }
  return kHex;
}

/// Where a grid point of a cell lies: on which vertex, edge or face, and how far along it.
struct Place {
  enum class On { vertex, edge, face, cell };
  On on = On::cell;
  int part = 0;      ///< local number of the vertex, edge or face; of a cell: the number among its inner nodes
  int i = 0, j = 0;  ///< steps along the edge, or from the face's first corner to its second and its last
};

/// The places of the grid points in the order of VTK, which begins with the corners.
std::vector<Place> places_of(CellKind kind, int order) {
  const auto lattice = cell_lattice(kind, order, NodeOrdering::vtk);
  const MfemTopology& topology = topology_of(kind);
  std::map<std::array<int, 3>, Place> places;
  const int num_corners = cell_topology(kind).num_vertices;
  for (int v = 0; v < num_corners; ++v) places[key_of(lattice[static_cast<std::size_t>(v)])] = {Place::On::vertex, v};
  const auto step = [&](int from, int to) -> LatticePoint {
    return (lattice[static_cast<std::size_t>(to)] - lattice[static_cast<std::size_t>(from)]) / order;
  };
  for (std::size_t e = 0; e < topology.edges.size(); ++e)
    for (int t = 1; t < order; ++t) {
      const auto [a, b] = topology.edges[e];
      places[key_of(lattice[static_cast<std::size_t>(a)] + t * step(a, b))] = {Place::On::edge, static_cast<int>(e), t};
    }
  for (std::size_t f = 0; f < topology.faces.size(); ++f) {
    const Face& face = topology.faces[f];
    const bool is_triangle = face[3] < 0;
    const int last = is_triangle ? face[2] : face[3];
    for (int j = 1; j < order; ++j)
      for (int i = 1; i < (is_triangle ? order - j : order); ++i)
        places[key_of(lattice[static_cast<std::size_t>(face[0])] + i * step(face[0], face[1]) +
                      j * step(face[0], last))] = {Place::On::face, static_cast<int>(f), i, j};
  }
  int inner = 0;
  for (const LatticePoint& at : cell_lattice(kind, order, NodeOrdering::rows))
    if (places.try_emplace(key_of(at), Place{Place::On::cell, inner}).second) ++inner;
  std::vector<Place> result;
  for (const LatticePoint& at : lattice) result.push_back(places.at(key_of(at)));
  return result;
}

/// A face with its corners as the first cell lists them; the last of a triangle is kNoIndex.
struct NumberedFace {
  std::array<Index, 4> corners;
  std::size_t first_node = 0;
};

/// Coordinates of the corners of a face along its first and last edge.
constexpr std::array<std::array<int, 2>, 4> kMfemQuadCorners{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};

/// Number among a face's inner nodes of the point i, j of a face with these corners.
std::size_t place_in(const NumberedFace& face, std::span<const Index> corners, int i, int j, int order) {
  const auto local = [&](Index v) {
    return static_cast<std::size_t>(std::find(corners.begin(), corners.end(), v) - corners.begin());
  };
  if (corners.size() == 3) {
    const std::array<int, 3> weights{order - i - j, i, j};
    const int a = weights[local(face.corners[1])], b = weights[local(face.corners[2])];
    int before = 0;
    for (int row = 1; row < b; ++row) before += order - 1 - row;
    return static_cast<std::size_t>(before + a - 1);
  }
  const auto origin = kMfemQuadCorners[local(face.corners[0])], first = kMfemQuadCorners[local(face.corners[1])],
             last = kMfemQuadCorners[local(face.corners[3])];
  const int di = i - order * origin[0], dj = j - order * origin[1];
  const int a = di * (first[0] - origin[0]) + dj * (first[1] - origin[1]);
  const int b = di * (last[0] - origin[0]) + dj * (last[1] - origin[1]);
  return static_cast<std::size_t>((b - 1) * (order - 1) + a - 1);
}

/// Edges and faces by their vertices.
class Entities {
 public:
  std::size_t edge(Index a, Index b) { return edges_.try_emplace(std::minmax(a, b), edges_.size()).first->second; }
  NumberedFace& face(std::span<const Index> corners) {
    const auto [known, is_new] = faces_.try_emplace(face_key(corners), list_.size());
    if (is_new) {
      NumberedFace& face = list_.emplace_back();
      face.corners.fill(kNoIndex);
      std::copy(corners.begin(), corners.end(), face.corners.begin());
    }
    return list_[known->second];
  }
  std::size_t num_edges() const { return edges_.size(); }
  std::vector<NumberedFace>& faces() { return list_; }

 private:
  std::map<std::pair<Index, Index>, std::size_t> edges_;
  std::map<FaceKey, std::size_t> faces_;
  std::vector<NumberedFace> list_;
};

std::vector<Index> corners_of(const Face& face, std::span<const Index> cell) {
  std::vector<Index> corners;
  for (const int i : face)
    if (i >= 0) corners.push_back(cell[static_cast<std::size_t>(i)]);
  return corners;
}

}  // namespace

MfemNodes number_mfem_nodes(std::size_t num_vertices, std::span<const CellKind> kinds,
                            std::span<const std::size_t> cell_offsets, std::span<const Index> cell_vertices,
                            int order) {
  assert(order >= 1 && order <= 16);
  const auto cell_of = [&](std::size_t c) {
    return cell_vertices.subspan(cell_offsets[c], cell_offsets[c + 1] - cell_offsets[c]);
  };
  Entities entities;
  for (std::size_t c = 0; c < kinds.size(); ++c) {
    const auto cell = cell_of(c);
    for (const auto& [a, b] : topology_of(kinds[c]).edges)
      entities.edge(cell[static_cast<std::size_t>(a)], cell[static_cast<std::size_t>(b)]);
    for (const Face& face : topology_of(kinds[c]).faces) entities.face(corners_of(face, cell));
  }
  const auto inside = static_cast<std::size_t>(order) - 1;
  std::size_t next = num_vertices + entities.num_edges() * inside;
  for (NumberedFace& face : entities.faces()) {
    face.first_node = next;
    next += face.corners[3] == kNoIndex ? (inside * (inside - (inside > 0))) / 2 : inside * inside;
  }
  MfemNodes result;
  std::map<CellKind, std::vector<Place>> places;
  for (std::size_t c = 0; c < kinds.size(); ++c) {
    std::vector<Place>& of_kind = places[kinds[c]];
    if (of_kind.empty()) of_kind = places_of(kinds[c], order);
    const auto cell = cell_of(c);
    std::size_t num_inner = 0;
    for (const Place& place : of_kind) {
      const auto part = static_cast<std::size_t>(place.part);
      std::size_t node = 0;
      if (place.on == Place::On::vertex) {
        node = static_cast<std::size_t>(cell[part]);
      } else if (place.on == Place::On::edge) {
        const auto [a, b] = topology_of(kinds[c]).edges[part];
        const Index va = cell[static_cast<std::size_t>(a)], vb = cell[static_cast<std::size_t>(b)];
        node = num_vertices + entities.edge(va, vb) * inside +
               static_cast<std::size_t>((va < vb ? place.i : order - place.i) - 1);
      } else if (place.on == Place::On::face) {
        const std::vector<Index> corners = corners_of(topology_of(kinds[c]).faces[part], cell);
        const NumberedFace& face = entities.face(corners);
        node = face.first_node + place_in(face, corners, place.i, place.j, order);
      } else {
        node = next + part;
        ++num_inner;
      }
      assert(node <= static_cast<std::size_t>(std::numeric_limits<Index>::max()));
      result.nodes.push_back(static_cast<Index>(node));
    }
    next += num_inner;
    result.offsets.push_back(result.nodes.size());
  }
  result.count = next;
  return result;
}

}  // namespace subvol::internal
