// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/validate.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>

namespace subvol {

using namespace internal;

namespace {

using Kind = MeshDefect::Kind;
using Key = std::array<Index, kMaxCellVertices>;

/// A vertex counts as lying on an edge within this fraction of the edge's length: files often carry six digits.
constexpr double kVertexOnEdgeTolerance = 1e-6;

template <class Range>
std::string list(const Range& vertices) {
  std::string text;
  for (const Index v : vertices) {
    if (!text.empty()) text += ' ';
    text += std::to_string(v);
  }
  return text;
}

std::string name_of(Index v) { return "vertex " + std::to_string(v); }

Key sorted_key(std::span<const Index> vertices) {
  Key key;
  key.fill(kNoIndex);
  std::size_t size = 0;
  for (const Index v : vertices) {
    std::size_t i = size++;
    for (; i > 0 && key[i - 1] > v; --i) key[i] = key[i - 1];
    key[i] = v;
  }
  return key;
}

/// Calls visit(run) for every maximal run of at least `length` equal keys; the items of a run ascend.
template <class Visit>
void for_each_run(std::vector<std::pair<Key, Index>>& items, std::size_t length, const Visit& visit) {
  std::sort(items.begin(), items.end());
  for (std::size_t first = 0, last; first < items.size(); first = last) {
    for (last = first + 1; last < items.size() && items[last].first == items[first].first;) ++last;
    if (last - first >= length) visit(std::span(items).subspan(first, last - first));
  }
}

class Validator {
 public:
  explicit Validator(const VolumeMesh& mesh) : mesh_(mesh) {}

  std::vector<MeshDefect> run() {
    if (check_sizes() && check_indices()) {
      check_positions();
      if (check_cells() && check_faces()) {
        const MeshTopology topology(mesh_);
        check_conformity(topology);
        check_hanging_vertices(topology);
        check_boundary(topology);
        check_orientation(topology);
        check_tags_on(topology);
      }
      check_jacobians();
      check_tag_values();
      check_unused();
    }
    std::stable_sort(defects_.begin(), defects_.end(), [](auto& a, auto& b) { return a.kind < b.kind; });
    return std::move(defects_);
  }

 private:
  void add(Kind kind, std::size_t entity, std::string message) {
    defects_.push_back({kind, static_cast<Index>(entity), std::move(message)});
  }

  std::string cell_name(std::size_t c) const {
    return cell_topology(mesh_.kinds[c]).name + std::string(" ") + std::to_string(c);
  }

  bool check_sizes() {
    const auto fail = [&](std::string message) {
      defects_.push_back({Kind::size_mismatch, kNoIndex, std::move(message)});
      return false;
    };
    if (mesh_.kinds.empty()) defects_.push_back({Kind::no_cells, kNoIndex, "the mesh has no cells"});
    const auto& offsets = mesh_.cell_offsets;
    if (offsets.size() != mesh_.kinds.size() + 1 || offsets.front() != 0 ||
        offsets.back() != mesh_.cell_vertices.size())
      return fail("cell_offsets must run from 0 to the size of cell_vertices, one entry more than there are cells");
    for (std::size_t c = 0; c < mesh_.kinds.size(); ++c) {
      if (static_cast<int>(mesh_.kinds[c]) >= kNumCellKinds)
        return fail("cell " + std::to_string(c) + " is of no kind");
      const std::size_t expected = static_cast<std::size_t>(cell_topology(mesh_.kinds[c]).num_vertices);
      if (offsets[c + 1] < offsets[c] || offsets[c + 1] - offsets[c] != expected)
        return fail(cell_name(c) + " must have " + std::to_string(expected) + " corners");
    }
    if (!mesh_.references.empty() && mesh_.references.size() != mesh_.kinds.size())
      return fail("references must be empty or one per cell: " + std::to_string(mesh_.references.size()) + " for " +
                  std::to_string(mesh_.kinds.size()) + " cells");
    return true;
  }

  bool check_indices() {
    const auto num_vertices = static_cast<Index>(mesh_.num_vertices());
    bool good = true;
    for (std::size_t c = 0; c < mesh_.num_cells(); ++c)
      for (const Index v : mesh_.cell(c))
        if (v < 0 || v >= num_vertices) {
          add(Kind::index_out_of_range, c,
              cell_name(c) + " names " + name_of(v) + " of " + std::to_string(num_vertices));
          good = false;
        }
    return good;
  }

  void check_positions() {
    for (std::size_t v = 0; v < mesh_.num_vertices(); ++v)
      if (!mesh_.positions[v].allFinite())
        add(Kind::not_finite, v, name_of(v) + " has a coordinate that is not finite");
  }

  bool check_cells() {
    const std::size_t before = defects_.size();
    std::vector<std::pair<Key, Index>> items(mesh_.num_cells());
    for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
      const auto cell = mesh_.cell(c);
      items[c] = {sorted_key(cell), static_cast<Index>(c)};
      const auto& key = items[c].first;
      const auto twice = std::adjacent_find(key.begin(), key.begin() + cell.size());
      if (twice != key.begin() + cell.size())
        add(Kind::repeated_vertex, c, cell_name(c) + " names " + name_of(*twice) + " more than once");
    }
    const bool good = defects_.size() == before;
    for_each_run(items, 2, [&](auto run) {
      for (const auto& item : run.subspan(1))
        add(Kind::duplicate_cell, item.second,
            cell_name(item.second) + " has the same vertices as cell " + std::to_string(run[0].second));
    });
    return good;
  }

  bool check_faces() {
    const std::size_t before = defects_.size();
    std::vector<std::pair<Key, Index>> items;
    for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
      const CellTopology& topology = cell_topology(mesh_.kinds[c]);
      for (int f = 0; f < topology.num_faces; ++f) {
        std::array<Index, 4> corners;
        for (int i = 0; i < topology.face_sizes[f]; ++i) corners[i] = mesh_.cell(c)[topology.faces[f][i]];
        items.push_back({sorted_key({corners.data(), std::size_t(topology.face_sizes[f])}), static_cast<Index>(c)});
      }
    }
    for_each_run(items, 3, [&](auto run) {
      std::vector<Index> corners, cells;
      for (const Index v : run[0].first)
        if (v != kNoIndex) corners.push_back(v);
      for (const auto& item : run) cells.push_back(item.second);
      add(Kind::face_of_many_cells, cells[0], "face " + list(corners) + " belongs to the cells " + list(cells));
    });
    return defects_.size() == before;
  }

  // A boundary quad must not lie against boundary triangles.
  void check_conformity(const MeshTopology& topology) {
    for (std::size_t f = 0; f < topology.num_faces(); ++f)
      if (topology.face(static_cast<Index>(f)).size() == 3)
        triangles_.push_back({sorted_key(topology.face(static_cast<Index>(f))), static_cast<Index>(f)});
    std::sort(triangles_.begin(), triangles_.end());

    for (const Index f : topology.boundary_faces()) {
      const auto quad = topology.face(f);
      for (std::size_t i = 0; quad.size() == 4 && i < 4; ++i) {
        const std::array<Index, 3> half = {quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4]};
        const Index triangle = find_triangle(half);
        if (triangle == kNoIndex || !topology.is_boundary_face(triangle)) continue;
        const Index c = topology.face_cells(f)[0], other = topology.face_cells(triangle)[0];
        add(Kind::nonconforming_face, c,
            "quad " + list(quad) + " of cell " + std::to_string(c) + " stands against the triangle " + list(half) +
                " of cell " + std::to_string(other));
        break;
      }
    }
  }

  /// Returns the number of the triangular face with these corners, or kNoIndex.
  Index find_triangle(const std::array<Index, 3>& corners) const {
    const std::pair<Key, Index> wanted{sorted_key(corners), kNoIndex};
    const auto it = std::lower_bound(triangles_.begin(), triangles_.end(), wanted);
    return it != triangles_.end() && it->first == wanted.first ? it->second : kNoIndex;
  }

  // Finds boundary edges a-b with a chain of shorter boundary edges from a to b along them: the neighbor is cut finer.
  void check_hanging_vertices(const MeshTopology& topology) {
    std::vector<std::vector<Index>> neighbors(mesh_.num_vertices());
    const auto for_each_edge = [&](const auto& visit) {
      for (std::size_t e = 0; e < topology.num_edges(); ++e)
        if (topology.is_boundary_edge(static_cast<Index>(e))) visit(topology.edge(static_cast<Index>(e)));
    };
    for_each_edge([&](const std::array<Index, 2>& edge) {
      for (int i = 0; i < 2; ++i) neighbors[edge[i]].push_back(edge[1 - i]);
    });
    for_each_edge([&](const std::array<Index, 2>& edge) {
      // The walk starts at the end with fewer neighbors: a vertex may have as many as the mesh has edges.
      const bool turned = neighbors[edge[1]].size() < neighbors[edge[0]].size();
      const Index v = first_on_chain(neighbors, edge[turned], edge[!turned]);
      // A flat triangle of one cell is a degenerate cell, not a hanging vertex.
      if (v != kNoIndex && find_triangle({edge[0], v, edge[1]}) == kNoIndex)
        add(Kind::nonconforming_face, v, name_of(v) + " hangs in the edge " + list(edge) + " of a cell without it");
    });
  }

  /// Returns the first inner vertex of a path of two or more edges along the segment from a to b, or kNoIndex if there
  /// is none.
  Index first_on_chain(const std::vector<std::vector<Index>>& neighbors, Index a, Index b) const {
    const Vec3 along = mesh_.positions[b] - mesh_.positions[a];
    const double length2 = along.squaredNorm();
    Index first = kNoIndex;
    double reached = 0;
    for (Index at = a; at != b;) {
      Index step = kNoIndex;
      double step_at = 1;
      for (const Index v : neighbors[at]) {
        if (v == b) {
          if (at != a && step == kNoIndex) step = b;
          continue;
        }
        const Vec3 offset = mesh_.positions[v] - mesh_.positions[a];
        const double t = offset.dot(along) / length2;
        const bool on_edge =
            (offset - t * along).squaredNorm() <= kVertexOnEdgeTolerance * kVertexOnEdgeTolerance * length2;
        if (on_edge && t > reached + kVertexOnEdgeTolerance && t < step_at - kVertexOnEdgeTolerance)
          step = v, step_at = t;
      }
      if (step == kNoIndex) return kNoIndex;
      if (first == kNoIndex) first = step;
      at = step, reached = step_at;
    }
    return first;
  }

  void check_boundary(const MeshTopology& topology) {
    std::vector<int> edge_faces(topology.num_edges(), 0);
    std::vector<std::vector<Index>> vertex_faces(mesh_.num_vertices());
    for (const Index f : topology.boundary_faces()) {
      const auto face = topology.face(f);
      for (std::size_t i = 0; i < face.size(); ++i) {
        ++edge_faces[topology.find_edge(face[i], face[(i + 1) % face.size()])];
        vertex_faces[face[i]].push_back(f);
      }
    }
    for (std::size_t e = 0; e < edge_faces.size(); ++e)
      if (edge_faces[e] != 0 && edge_faces[e] != 2)
        add(Kind::nonmanifold_edge, topology.edge(static_cast<Index>(e))[0],
            "boundary edge " + list(topology.edge(static_cast<Index>(e))) + " has " + std::to_string(edge_faces[e]) +
                " boundary faces instead of 2");
    for (std::size_t v = 0; v < vertex_faces.size(); ++v) {
      const int fans = num_fans(topology, static_cast<Index>(v), vertex_faces[v]);
      if (fans > 1)
        add(Kind::nonmanifold_vertex, v,
            "the boundary touches itself at " + name_of(static_cast<Index>(v)) + ": its faces form " +
                std::to_string(fans) + " fans");
    }
  }

  /// Returns the number of fans of the faces around v: two faces are in one fan if they share an edge at v.
  static int num_fans(const MeshTopology& topology, Index v, std::span<const Index> faces) {
    std::vector<std::pair<Index, Index>> spokes;  // other end of an edge at v, place of the face
    for (std::size_t i = 0; i < faces.size(); ++i) {
      const auto face = topology.face(faces[i]);
      const std::size_t at = std::find(face.begin(), face.end(), v) - face.begin();
      spokes.push_back({face[(at + 1) % face.size()], static_cast<Index>(i)});
      spokes.push_back({face[(at + face.size() - 1) % face.size()], static_cast<Index>(i)});
    }
    std::sort(spokes.begin(), spokes.end());
    DisjointSets fans(faces.size());
    for (std::size_t i = 0; i + 1 < spokes.size(); ++i)
      if (spokes[i].first == spokes[i + 1].first) fans.join(spokes[i].second, spokes[i + 1].second);
    std::vector<Index> numbers;
    return static_cast<int>(fans.number(numbers));
  }

  // The first cell sees the corners of a face in the stored order; the second must see the same loop backwards.
  void check_orientation(const MeshTopology& topology) {
    for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
      const CellTopology& local = cell_topology(mesh_.kinds[c]);
      for (int i = 0; i < local.num_faces; ++i) {
        const Index f = topology.cell_faces(c)[i];
        if (topology.face_cells(f)[1] != static_cast<Index>(c)) continue;
        const auto face = topology.face(f);
        const std::size_t n = face.size();
        const auto corner = [&](std::size_t j) { return mesh_.cell(c)[local.faces[i][j % n]]; };
        const std::size_t at = std::find(face.begin(), face.end(), corner(0)) - face.begin();
        const Index after = face[(at + 1) % n], before = face[(at + n - 1) % n];
        const std::string both = "cells " + list(topology.face_cells(f)) + " ";
        if (corner(1) == after && corner(n - 1) == before)
          add(Kind::inconsistent_orientation, c, both + "see their face " + list(face) + " from the same side");
        else if (corner(1) != before || corner(n - 1) != after)
          add(Kind::nonconforming_face, c,
              both + "join the corners of their face " + list(face) + " in different orders");
      }
    }
  }

  void check_jacobians() {
    for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
      const CellTopology& topology = cell_topology(mesh_.kinds[c]);
      const auto position = [&](int corner) -> const Vec3& { return mesh_.positions[mesh_.cell(c)[corner]]; };
      int bad = 0, first = -1;
      for (int i = 0; i < topology.num_trivalent; ++i) {
        const auto& n = topology.corner_neighbors[i];
        const Vec3& x = position(i);
        const Vec3 e0 = position(n[0]) - x, e1 = position(n[1]) - x, e2 = position(n[2]) - x;
        if (e0.cross(e1).dot(e2) > 0) continue;
        if (bad++ == 0) first = i;
      }
      if (bad > 0)
        add(Kind::inverted_cell, c,
            cell_name(c) + " is flat or left-handed at " + std::to_string(bad) + " of " +
                std::to_string(topology.num_trivalent) + " corners, first at " + name_of(mesh_.cell(c)[first]));
    }
  }

  void check_tags_on(const MeshTopology& topology) {
    const auto known = [&](Index v) { return v >= 0 && static_cast<std::size_t>(v) < mesh_.num_vertices(); };
    if (mesh_.tags.empty()) return;
    const InterfaceMarks marks = mark_interfaces(topology, find_interfaces(mesh_, topology));
    for (const CreaseEdge& crease : mesh_.tags.creases) {
      if (!known(crease.v0) || !known(crease.v1)) continue;
      const Index e = topology.find_edge(crease.v0, crease.v1);
      if (e == kNoIndex || (!topology.is_boundary_edge(e) && !marks.has_edge(e)))
        add(Kind::bad_tag, crease.v0,
            "crease " + list(std::array{crease.v0, crease.v1}) + " is no edge of the boundary or of an interface");
    }
    for (const CornerVertex& corner : mesh_.tags.corners)
      if (known(corner.vertex) && !topology.is_boundary_vertex(corner.vertex) && !marks.has_vertex(corner.vertex))
        add(Kind::bad_tag, corner.vertex,
            "corner " + std::to_string(corner.vertex) + " is not on the boundary or on an interface");
  }

  void check_tag_values() {
    const auto known = [&](Index v) { return v >= 0 && static_cast<std::size_t>(v) < mesh_.num_vertices(); };
    const auto complain = [&](bool bad, Index v, const std::string& message) {
      if (bad) add(Kind::bad_tag, v, message);
    };
    const CreaseEdge* last = nullptr;
    for (const CreaseEdge& crease : mesh_.tags.creases) {
      const std::string name = "crease " + list(std::array{crease.v0, crease.v1});
      complain(!known(crease.v0) || !known(crease.v1), crease.v0, name + " names a vertex that is not there");
      complain(crease.v0 >= crease.v1, crease.v0, name + " must name the smaller vertex first");
      complain(!(crease.sharpness > 0), crease.v0, name + " must have a sharpness > 0");
      complain(last && std::pair(last->v0, last->v1) >= std::pair(crease.v0, crease.v1), crease.v0,
               name + " is out of order or there twice");
      last = &crease;
    }
    const CornerVertex* previous = nullptr;
    for (const CornerVertex& corner : mesh_.tags.corners) {
      const std::string name = "corner " + std::to_string(corner.vertex);
      complain(!known(corner.vertex), corner.vertex, name + " is a vertex that is not there");
      complain(!(corner.sharpness > 0), corner.vertex, name + " must have a sharpness > 0");
      complain(previous && previous->vertex >= corner.vertex, corner.vertex, name + " is out of order or there twice");
      previous = &corner;
    }
  }

  void check_unused() {
    std::vector<char> used(mesh_.num_vertices(), 0);
    for (const Index v : mesh_.cell_vertices) used[v] = 1;
    for (std::size_t v = 0; v < used.size(); ++v)
      if (!used[v]) add(Kind::unused_vertex, v, name_of(static_cast<Index>(v)) + " belongs to no cell");
  }

  const VolumeMesh& mesh_;
  std::vector<MeshDefect> defects_;
  std::vector<std::pair<Key, Index>> triangles_;  // sorted corners and face number of every triangle
};

}  // namespace

std::vector<MeshDefect> validate(const VolumeMesh& mesh) { return Validator(mesh).run(); }

void require_valid(const VolumeMesh& mesh, const std::string& what, InvertedCells inverted) {
  for (const MeshDefect& defect : validate(mesh)) {
    const bool is_allowed = defect.kind == Kind::unused_vertex ||
                            (defect.kind == Kind::inverted_cell && inverted == InvertedCells::allowed);
    if (!is_allowed) throw InputError(what + ": " + defect.message);
  }
}

void require_groups(const VolumeFaceGroups& groups, const std::string& what) {
  for (const GroupedFace& entry : groups.faces)
    if (entry.group < 0 || static_cast<std::size_t>(entry.group) >= groups.groups.size())
      throw InputError(what + ": a face is in group " + std::to_string(entry.group) + " of " +
                       std::to_string(groups.groups.size()));
}

const char* to_string(MeshDefect::Kind kind) {
  switch (kind) {
    case Kind::no_cells: return "no_cells";
    case Kind::size_mismatch: return "size_mismatch";
    case Kind::index_out_of_range: return "index_out_of_range";
    case Kind::not_finite: return "not_finite";
    case Kind::repeated_vertex: return "repeated_vertex";
    case Kind::duplicate_cell: return "duplicate_cell";
    case Kind::face_of_many_cells: return "face_of_many_cells";
    case Kind::nonconforming_face: return "nonconforming_face";
    case Kind::nonmanifold_edge: return "nonmanifold_edge";
    case Kind::nonmanifold_vertex: return "nonmanifold_vertex";
    case Kind::inconsistent_orientation: return "inconsistent_orientation";
    case Kind::inverted_cell: return "inverted_cell";
    case Kind::bad_tag: return "bad_tag";
    case Kind::unused_vertex: return "unused_vertex";
  }
  return "unknown";
}

}  // namespace subvol
