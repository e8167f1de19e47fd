// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/refine.h"

#include "subvol/base/error.h"
#include "subvol/mesh/inherited_groups.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/templates/template_edit.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>

namespace subvol {

using namespace internal;

namespace {

/// A point of the canonical hex, in sixths of its edges.
using Place = std::array<int, 3>;
using HexPlaces = std::array<Place, 8>;
/// Marked corners of a hex, one bit each.
using Marks = std::uint8_t;

constexpr int kWhole = 6;  // of an edge, whose halves and thirds are whole numbers then

constexpr std::array<Place, 8> kHexCornerPlaces = {
    {{0, 0, 0}, {6, 0, 0}, {6, 6, 0}, {0, 6, 0}, {0, 0, 6}, {6, 0, 6}, {6, 6, 6}, {0, 6, 6}}};

int corner_at(const Place& place) {
  return static_cast<int>(std::find(kHexCornerPlaces.begin(), kHexCornerPlaces.end(), place) -
                          kHexCornerPlaces.begin());
}

/// Four quads between a line that is cut into three and one that is not:
///
///      far 0 --------- far 1
///        |  \         /  |
///        |   mid 0-mid 1 |
///        |   |       |   |
///      near 0-- 1 -- 2 --3
struct Strip {
  std::array<Place, 4> near;
  std::array<Place, 2> middle, far;
};

/// Collects the hexes of one pattern.
class Pattern {
 public:
  void add_box(const Place& low, const Place& high) {
    HexPlaces hex;
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t d = 0; d < 3; ++d) hex[i][d] = kHexCornerPlaces[i][d] == 0 ? low[d] : high[d];
    hexes.push_back(hex);
  }

  /// Adds the hex between two quads. Both quads start at the ends of one edge between them and run around in the same
  /// sense.
  void add_between(const std::array<Place, 4>& a, const std::array<Place, 4>& b) {
    HexPlaces hex{a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]};
    const auto edge = [&](int to) {
      return Vec3(hex[to][0] - hex[0][0], hex[to][1] - hex[0][1], hex[to][2] - hex[0][2]);
    };
    if (edge(1).cross(edge(3)).dot(edge(4)) < 0) {
      std::swap(hex[1], hex[3]);
      std::swap(hex[5], hex[7]);
    }
    hexes.push_back(hex);
  }

  void sweep(const Strip& a, const Strip& b) {
    const auto quads = [](const Strip& s) {
      return std::array<std::array<Place, 4>, 4>{{{s.near[0], s.near[1], s.middle[0], s.far[0]},
                                                  {s.near[1], s.near[2], s.middle[1], s.middle[0]},
                                                  {s.near[2], s.near[3], s.far[1], s.middle[1]},
                                                  {s.middle[0], s.middle[1], s.far[1], s.far[0]}}};
    };
    for (std::size_t q = 0; q < 4; ++q) add_between(quads(a)[q], quads(b)[q]);
  }

  std::vector<HexPlaces> hexes;
};

/// Corner 0 is marked: a small cube lies there, and a hex joins each of its three inner faces to the opposite face of
/// the cell.
Pattern vertex_pattern() {
  Pattern pattern;
  pattern.add_box({0, 0, 0}, {2, 2, 2});
  pattern.add_between({{{2, 0, 0}, {2, 2, 0}, {2, 2, 2}, {2, 0, 2}}}, {{{6, 0, 0}, {6, 6, 0}, {6, 6, 6}, {6, 0, 6}}});
  pattern.add_between({{{0, 2, 0}, {2, 2, 0}, {2, 2, 2}, {0, 2, 2}}}, {{{0, 6, 0}, {6, 6, 0}, {6, 6, 6}, {0, 6, 6}}});
  pattern.add_between({{{0, 0, 2}, {2, 0, 2}, {2, 2, 2}, {0, 2, 2}}}, {{{0, 0, 6}, {6, 0, 6}, {6, 6, 6}, {0, 6, 6}}});
  return pattern;
}

/// Corners 0 and 4 are marked: three cubes lie along their edge; strips are swept from the two sides beside it to the
/// diagonal.
Pattern edge_pattern() {
  Pattern pattern;
  for (int z = 0; z < kWhole; z += 2) pattern.add_box({0, 0, z}, {2, 2, z + 2});
  const auto strip = [](int x, int y) {  // from the cubes outward, along (x, y)
    return Strip{{{{2 * x, 2 * y, 0}, {2 * x, 2 * y, 2}, {2 * x, 2 * y, 4}, {2 * x, 2 * y, 6}}},
                 {{{4 * x, 4 * y, 2}, {4 * x, 4 * y, 4}}},
                 {{{6 * x, 6 * y, 0}, {6 * x, 6 * y, 6}}}};
  };
  pattern.sweep(strip(1, 0), strip(1, 1));
  pattern.sweep(strip(1, 1), strip(0, 1));
  return pattern;
}

/// Corners 0 to 3 are marked: nine boxes lie at their face, with three sweeps over them and one hex above.
Pattern face_pattern() {
  Pattern pattern;
  for (int x = 0; x < kWhole; x += 2)
    for (int y = 0; y < kWhole; y += 2) pattern.add_box({x, y, 0}, {x + 2, y + 2, 2});
  const auto strip = [](int x, int middle, int top) {
    return Strip{{{{x, 0, 2}, {x, 2, 2}, {x, 4, 2}, {x, 6, 2}}},
                 {{{x, 2, middle}, {x, 4, middle}}},
                 {{{x, 0, top}, {x, 6, top}}}};
  };
  const std::array<Strip, 4> strips = {strip(0, 4, 6), strip(2, 3, 4), strip(4, 3, 4), strip(6, 4, 6)};
  for (std::size_t i = 0; i < 3; ++i) pattern.sweep(strips[i], strips[i + 1]);
  const auto ridge = [&](std::size_t end) {
    return std::array<Place, 4>{strips[0].far[end], strips[1].far[end], strips[2].far[end], strips[3].far[end]};
  };
  pattern.add_between(ridge(0), ridge(1));
  return pattern;
}

Pattern full_pattern() {
  Pattern pattern;
  for (int x = 0; x < kWhole; x += 2)
    for (int y = 0; y < kWhole; y += 2)
      for (int z = 0; z < kWhole; z += 2) pattern.add_box({x, y, z}, {x + 2, y + 2, z + 2});
  return pattern;
}

/// A rotation of the canonical hex onto itself: place[d] becomes coordinate axes[d], counted from the other end if
/// flips[d].
struct Turn {
  std::array<std::size_t, 3> axes;
  std::array<bool, 3> flips;

  Place operator()(const Place& place) const {
    Place turned;
    for (std::size_t d = 0; d < 3; ++d) turned[axes[d]] = flips[d] ? kWhole - place[d] : place[d];
    return turned;
  }
};

std::vector<Turn> make_turns() {
  std::vector<Turn> turns;
  std::array<std::size_t, 3> axes = {0, 1, 2};
  do {
    const bool odd = (axes[0] > axes[1]) ^ (axes[0] > axes[2]) ^ (axes[1] > axes[2]);
    for (int flips = 0; flips < 8; ++flips) {
      const Turn turn{axes, {(flips & 1) != 0, (flips & 2) != 0, (flips & 4) != 0}};
      if (odd == ((std::popcount(static_cast<unsigned>(flips)) & 1) != 0)) turns.push_back(turn);
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  return turns;
}

Marks turned_marks(Marks marks, const Turn& turn) {
  unsigned result = 0;
  for (int i = 0; i < 8; ++i)
    if (marks >> i & 1) result |= 1u << corner_at(turn(kHexCornerPlaces[i]));
  return static_cast<Marks>(result);
}

/// The parts of a hex for each pattern of marks, and for any set of marks the pattern that it grows to.
struct Patterns {
  std::array<std::vector<HexPlaces>, 256> parts;  ///< empty: nothing is marked, or the marks are not one of the
                                                  ///< patterns
  std::array<Marks, 256> grown;

  Patterns() {
    constexpr Marks kVertex = 1, kEdge = 1 | 1 << 4, kFace = 15, kAll = 255;
    for (const auto& [marks, pattern] : {std::pair(kVertex, vertex_pattern()), std::pair(kEdge, edge_pattern()),
                                         std::pair(kFace, face_pattern()), std::pair(kAll, full_pattern())})
      for (const Turn& turn : make_turns()) {
        std::vector<HexPlaces>& turned = parts[turned_marks(marks, turn)];
        if (!turned.empty()) continue;
        turned = pattern.hexes;
        for (HexPlaces& hex : turned)
          for (Place& place : hex) place = turn(place);
      }
    for (unsigned marks = 0; marks < 256; ++marks) {
      grown[marks] = kAll;
      if (marks == 0) grown[marks] = 0;
      for (unsigned pattern = 1; pattern < 256; ++pattern)
        if (!parts[pattern].empty() && (marks & pattern) == marks && marks != 0 &&
            std::popcount(pattern) < std::popcount(static_cast<unsigned>(grown[marks])))
          grown[marks] = static_cast<Marks>(pattern);
    }
  }
};

const Patterns& patterns() {
  static const Patterns result;
  return result;
}

Marks marks_of(std::span<const Index> hex, std::span<const char> marked) {
  unsigned marks = 0;
  for (std::size_t i = 0; i < 8; ++i)
    if (marked[hex[i]]) marks |= 1u << i;
  return static_cast<Marks>(marks);
}

/// Marks more vertices until every cell has one of the patterns.
void grow_marks(const VolumeMesh& mesh, std::vector<char>& marked) {
  std::vector<std::vector<Index>> cells_of(mesh.num_vertices());
  std::vector<std::size_t> queue;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    for (Index v : mesh.cell(c)) cells_of[v].push_back(static_cast<Index>(c));
    queue.push_back(c);
  }
  while (!queue.empty()) {
    const std::size_t c = queue.back();
    queue.pop_back();
    const std::span<const Index> cell = mesh.cell(c);
    if (mesh.kinds[c] != CellKind::hex) {
      if (std::any_of(cell.begin(), cell.end(), [&](Index v) { return marked[v] != 0; }))
        throw InputError("refine: cell " + std::to_string(c) + " is no hex");
      continue;
    }
    const Marks grown = patterns().grown[marks_of(cell, marked)];
    for (std::size_t i = 0; i < 8; ++i) {
      if (!(grown >> i & 1) || marked[cell[i]]) continue;
      marked[cell[i]] = 1;
      for (Index other : cells_of[cell[i]]) queue.push_back(static_cast<std::size_t>(other));
    }
  }
}

/// Numbers the new vertices: all cells around an edge share those on it, and the two cells of a face share those in it.
class PlaceNumbers {
 public:
  PlaceNumbers(const VolumeMesh& mesh, VolumeMesh& result)
      : mesh_(mesh),
        result_(result),
        topology_(mesh),
        on_edges_(topology_.num_edges(), {kNoIndex, kNoIndex}),
        on_faces_(topology_.num_faces(), {kNoIndex, kNoIndex, kNoIndex, kNoIndex}) {}

  void start_cell(std::size_t c) {
    cell_ = c;
    inside_.clear();
  }

  Index operator()(const Place& place) {
    const std::span<const Index> cell = mesh_.cell(cell_);
    Place nearest;
    int inner = 0;
    for (std::size_t d = 0; d < 3; ++d) {
      nearest[d] = 2 * place[d] < kWhole ? 0 : kWhole;
      inner += place[d] != 0 && place[d] != kWhole ? 1 : 0;
    }
    const Index corner = cell[corner_at(nearest)];
    if (inner == 0) return corner;
    Index& number = inner == 3 ? inside(place) : inner == 1 ? on_edge(place, corner) : on_face(place, corner);
    if (number == kNoIndex) {
      number = static_cast<Index>(result_.positions.size());
      result_.positions.push_back(position(place));
    }
    return number;
  }

  /// Where each vertex of the result lies in the mesh.
  std::vector<VertexSupport> supports() const {
    std::vector<VertexSupport> support(result_.num_vertices(), support_of({}));
    for (std::size_t v = 0; v < mesh_.num_vertices(); ++v) support[v] = kept_vertex(static_cast<Index>(v));
    for (std::size_t e = 0; e < on_edges_.size(); ++e)
      for (const Index v : on_edges_[e])
        if (v != kNoIndex) support[v] = support_of(topology_.edge(static_cast<Index>(e)));
    for (std::size_t f = 0; f < on_faces_.size(); ++f)
      for (const Index v : on_faces_[f])
        if (v != kNoIndex) support[v] = support_of(topology_.face(static_cast<Index>(f)));
    return support;
  }

  const MeshTopology& topology() const { return topology_; }
  /// The vertex on edge e next to one of its ends, or kNoIndex if the edge has none there.
  Index near_end(Index e, Index end) const { return on_edges_[e][topology_.edge(e)[0] == end ? 0 : 1]; }

 private:
  Index& inside(const Place& place) {
    for (auto& [known, number] : inside_)
      if (known == place) return number;
    return inside_.emplace_back(place, kNoIndex).second;
  }

  Index& on_edge(const Place& place, Index corner) {
    const std::size_t axis = place[0] % kWhole != 0 ? 0 : place[1] % kWhole != 0 ? 1 : 2;
    Place other = place;
    for (const int end : {0, kWhole}) {
      other[axis] = end;
      const Index v = mesh_.cell(cell_)[corner_at(other)];
      if (v == corner) continue;
      const Index e = topology_.find_edge(corner, v);
      return on_edges_[e][topology_.edge(e)[0] == corner ? 0 : 1];
    }
    return inside(place);  // not reached: an edge has two ends
  }

  Index& on_face(const Place& place, Index corner) {
    const std::size_t axis = place[0] % kWhole == 0 ? 0 : place[1] % kWhole == 0 ? 1 : 2;
    const CellTopology& hex = cell_topology(CellKind::hex);
    int f = 0;
    const auto lies_in = [&](int face) {
      return std::all_of(hex.faces[face].begin(), hex.faces[face].end(),
                         [&](int i) { return kHexCornerPlaces[i][axis] == place[axis]; });
    };
    while (!lies_in(f)) ++f;
    const Index face = topology_.cell_faces(cell_)[f];
    const auto corners = topology_.face(face);
    return on_faces_[face][std::find(corners.begin(), corners.end(), corner) - corners.begin()];
  }

  Vec3 position(const Place& place) const {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = 0; i < 8; ++i) {
      double weight = 1;
      for (std::size_t d = 0; d < 3; ++d) {
        const double t = place[d] / static_cast<double>(kWhole);
        weight *= kHexCornerPlaces[i][d] == 0 ? 1 - t : t;
      }
      sum += weight * mesh_.positions[mesh_.cell(cell_)[i]];
    }
    return sum;
  }

  const VolumeMesh& mesh_;
  VolumeMesh& result_;
  MeshTopology topology_;
  std::size_t cell_ = 0;
  std::vector<std::array<Index, 2>> on_edges_;  ///< by the end that they are next to
  std::vector<std::array<Index, 4>> on_faces_;  ///< by the corner that they are next to
  std::vector<std::pair<Place, Index>> inside_;
};

void cut_creases(const FeatureTags& tags, const PlaceNumbers& numbers, FeatureTags& result) {
  result.corners = tags.corners;
  for (const CreaseEdge& crease : tags.creases) {
    const Index e = numbers.topology().find_edge(crease.v0, crease.v1);
    Index from = crease.v0;
    if (e != kNoIndex)
      for (const Index end : {crease.v0, crease.v1})
        if (const Index v = numbers.near_end(e, end); v != kNoIndex) {
          result.creases.push_back({from, v, crease.sharpness});
          from = v;
        }
    result.creases.push_back({from, crease.v1, crease.sharpness});
  }
  normalize_tags(result);
}

}  // namespace

LocalRefinement refine_locally(const VolumeMesh& mesh, std::span<const char> marked, WarpedParts warped) {
  if (marked.size() != mesh.num_vertices())
    throw InputError("refine: marked must have one entry per vertex, " + std::to_string(mesh.num_vertices()));
  std::vector<char> marks(marked.begin(), marked.end());
  grow_marks(mesh, marks);

  LocalRefinement refinement;
  VolumeMesh& result = refinement.mesh;
  result.positions = mesh.positions;
  PlaceNumbers number(mesh, result);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const std::span<const Index> cell = mesh.cell(c);
    const bool hex = mesh.kinds[c] == CellKind::hex;
    const auto& parts = patterns().parts[hex ? marks_of(cell, marks) : 0];
    const std::size_t first = result.num_cells();
    if (parts.empty()) result.add_cell(mesh.kinds[c], cell);
    number.start_cell(c);
    for (const HexPlaces& part : parts) {
      std::array<Index, 8> corners;
      for (std::size_t i = 0; i < 8; ++i) corners[i] = number(part[i]);
      result.add_cell(CellKind::hex, corners);
    }
    for (std::size_t p = first; p < result.num_cells(); ++p) {
      refinement.parents.push_back(static_cast<Index>(c));
      if (!mesh.references.empty()) result.references.push_back(mesh.references[c]);
      if (warped == WarpedParts::refused && !parts.empty() && !corners_positive(result, p))
        throw InputError("refine: cell " + std::to_string(c) + " is too warped: a part of it would be inverted");
    }
  }
  cut_creases(mesh.tags, number, result.tags);
  result.regions = mesh.regions;
  if (!mesh.face_groups.empty())
    result.face_groups = inherited_groups(mesh.face_groups, MeshTopology(result), number.supports());
  return refinement;
}

VolumeMesh refine_at(const VolumeMesh& mesh, std::span<const char> marked) {
  require_valid(mesh, "refine");
  return refine_locally(mesh, marked, WarpedParts::refused).mesh;
}

std::vector<char> vertices_of(const VolumeMesh& mesh, std::span<const char> chosen) {
  std::vector<char> marked(mesh.num_vertices(), 0);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (chosen[c])
      for (Index v : mesh.cell(c)) marked[v] = 1;
  return marked;
}

std::vector<char> thin_cells(const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  const CellTopology& hex = cell_topology(CellKind::hex);
  const auto opposite = [&](int f, int g) {
    return std::none_of(hex.faces[f].begin(), hex.faces[f].end(), [&](int i) {
      return std::find(hex.faces[g].begin(), hex.faces[g].end(), i) != hex.faces[g].end();
    });
  };
  std::vector<char> thin(mesh.num_cells(), 0);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (mesh.kinds[c] != CellKind::hex) continue;
    const auto faces = topology.cell_faces(c);
    for (int f = 0; f < hex.num_faces; ++f)
      for (int g = f + 1; g < hex.num_faces; ++g)
        if (opposite(f, g) && topology.is_boundary_face(faces[f]) && topology.is_boundary_face(faces[g])) thin[c] = 1;
  }
  return thin;
}

}  // namespace subvol
