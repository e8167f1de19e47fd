// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/face_checks.h"

#include "subvol/base/disjoint_sets.h"

#include <algorithm>
#include <array>
#include <span>

namespace subvol::internal {

namespace {

/// A vertex counts as lying on an edge within this fraction of the edge's length: files often carry six digits.
constexpr double kVertexOnEdgeTolerance = 1e-6;

/// The triangular faces of a mesh, which are found by their corners.
class TriangleFaces {
 public:
  explicit TriangleFaces(const MeshTopology& topology) {
    for (std::size_t f = 0; f < topology.num_faces(); ++f)
      if (topology.face(static_cast<Index>(f)).size() == 3)
        triangles_.push_back({face_key(topology.face(static_cast<Index>(f))), static_cast<Index>(f)});
    std::sort(triangles_.begin(), triangles_.end());
  }
  /// Returns the number of the face with these corners, or kNoIndex.
  Index find(const std::array<Index, 3>& corners) const {
    const std::pair<FaceKey, Index> wanted{face_key(corners), kNoIndex};
    const auto it = std::lower_bound(triangles_.begin(), triangles_.end(), wanted);
    return it != triangles_.end() && it->first == wanted.first ? it->second : kNoIndex;
  }

 private:
  std::vector<std::pair<FaceKey, Index>> triangles_;
};

/// Finds boundary quads, half of which is a boundary triangle of another cell.
void check_quads(const MeshTopology& topology, const TriangleFaces& triangles, DefectList& defects) {
  for (const Index f : topology.boundary_faces()) {
    const auto quad = topology.face(f);
    for (std::size_t i = 0; quad.size() == 4 && i < 4; ++i) {
      const std::array<Index, 3> half = {quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4]};
      const Index triangle = triangles.find(half);
      if (triangle == kNoIndex || !topology.is_boundary_face(triangle)) continue;
      const Index c = topology.face_cells(f)[0], other = topology.face_cells(triangle)[0];
      defects.add(MeshDefect::Kind::nonconforming_face, c,
                  "quad " + number_list(quad) + " of cell " + std::to_string(c) + " stands against the triangle " +
                      number_list(half) + " of cell " + std::to_string(other));
      break;
    }
  }
}

/// Returns the first inner vertex of a path of two or more edges along the segment from a to b, or kNoIndex if there is
/// none.
Index first_on_chain(const VolumeMesh& mesh, const std::vector<std::vector<Index>>& neighbors, Index a, Index b) {
  const Vec3 along = mesh.positions[b] - mesh.positions[a];
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
      const Vec3 offset = mesh.positions[v] - mesh.positions[a];
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

/// Finds boundary edges a-b with a chain of shorter boundary edges from a to b along them: the neighbor is cut finer.
void check_hanging_vertices(const VolumeMesh& mesh, const MeshTopology& topology, const TriangleFaces& triangles,
                            DefectList& defects) {
  std::vector<std::vector<Index>> neighbors(mesh.num_vertices());
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
    const Index v = first_on_chain(mesh, neighbors, edge[turned], edge[!turned]);
    // A flat triangle of one cell is a degenerate cell, not a hanging vertex.
    if (v != kNoIndex && triangles.find({edge[0], v, edge[1]}) == kNoIndex)
      defects.add(MeshDefect::Kind::nonconforming_face, v,
                  vertex_name(v) + " hangs in the edge " + number_list(edge) + " of a cell without it");
  });
}

/// Returns the number of fans of the faces around v: two faces are in one fan if they share an edge at v.
int num_fans(const MeshTopology& topology, Index v, std::span<const Index> faces) {
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

}  // namespace

bool check_shared_faces(const VolumeMesh& mesh, DefectList& defects) {
  const std::size_t before = defects.size();
  std::vector<std::pair<FaceKey, Index>> items;  // each face of each cell, with the cell
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellTopology& local = cell_topology(mesh.kinds[c]);
    for (int f = 0; f < local.num_faces; ++f) {
      std::array<Index, 4> corners;
      for (int i = 0; i < local.face_sizes[f]; ++i) corners[i] = mesh.cell(c)[local.faces[f][i]];
      items.push_back({face_key({corners.data(), std::size_t(local.face_sizes[f])}), static_cast<Index>(c)});
    }
  }
  std::sort(items.begin(), items.end());
  for (std::size_t first = 0, last; first < items.size(); first = last) {
    for (last = first + 1; last < items.size() && items[last].first == items[first].first;) ++last;
    if (last - first < 3) continue;
    std::vector<Index> corners, cells;
    for (const Index v : items[first].first)
      if (v != kNoIndex) corners.push_back(v);
    for (std::size_t i = first; i < last; ++i) cells.push_back(items[i].second);
    defects.add(MeshDefect::Kind::face_of_many_cells, cells[0],
                "face " + number_list(corners) + " belongs to the cells " + number_list(cells));
  }
  return defects.size() == before;
}

void check_conformity(const VolumeMesh& mesh, const MeshTopology& topology, DefectList& defects) {
  const TriangleFaces triangles(topology);
  check_quads(topology, triangles, defects);
  check_hanging_vertices(mesh, topology, triangles, defects);
}

void check_boundary_is_manifold(const MeshTopology& topology, DefectList& defects) {
  std::vector<int> edge_faces(topology.num_edges(), 0);
  std::vector<std::vector<Index>> vertex_faces(topology.num_vertices());
  for (const Index f : topology.boundary_faces()) {
    const auto face = topology.face(f);
    for (std::size_t i = 0; i < face.size(); ++i) {
      ++edge_faces[topology.find_edge(face[i], face[(i + 1) % face.size()])];
      vertex_faces[face[i]].push_back(f);
    }
  }
  for (std::size_t e = 0; e < edge_faces.size(); ++e)
    if (edge_faces[e] != 0 && edge_faces[e] != 2)
      defects.add(MeshDefect::Kind::nonmanifold_edge, topology.edge(static_cast<Index>(e))[0],
                  "boundary edge " + number_list(topology.edge(static_cast<Index>(e))) + " has " +
                      std::to_string(edge_faces[e]) + " boundary faces instead of 2");
  for (std::size_t v = 0; v < vertex_faces.size(); ++v) {
    const int fans = num_fans(topology, static_cast<Index>(v), vertex_faces[v]);
    if (fans > 1)
      defects.add(MeshDefect::Kind::nonmanifold_vertex, v,
                  "the boundary touches itself at " + vertex_name(static_cast<Index>(v)) + ": its faces form " +
                      std::to_string(fans) + " fans");
  }
}

// The first cell sees the corners of a face in the stored order; the second must see the same loop backwards.
void check_orientation(const VolumeMesh& mesh, const MeshTopology& topology, DefectList& defects) {
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellTopology& local = cell_topology(mesh.kinds[c]);
    for (int i = 0; i < local.num_faces; ++i) {
      const Index f = topology.cell_faces(c)[i];
      if (topology.face_cells(f)[1] != static_cast<Index>(c)) continue;
      const auto face = topology.face(f);
      const std::size_t n = face.size();
      const auto corner = [&](std::size_t j) { return mesh.cell(c)[local.faces[i][j % n]]; };
      const std::size_t at = std::find(face.begin(), face.end(), corner(0)) - face.begin();
      const Index after = face[(at + 1) % n], before = face[(at + n - 1) % n];
      const std::string both = "cells " + number_list(topology.face_cells(f)) + " ";
      if (corner(1) == after && corner(n - 1) == before)
        defects.add(MeshDefect::Kind::inconsistent_orientation, c,
                    both + "see their face " + number_list(face) + " from the same side");
      else if (corner(1) != before || corner(n - 1) != after)
        defects.add(MeshDefect::Kind::nonconforming_face, c,
                    both + "join the corners of their face " + number_list(face) + " in different orders");
    }
  }
}

}  // namespace subvol::internal
