// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/surface_topology.h"

#include "subvol/base/error.h"
#include "subvol/surface/crowded_edges.h"
#include "subvol/surface/sheets.h"

#include <string>

namespace subvol {

using namespace internal;

namespace {

/// Prefix for messages: a closed surface is the boundary of a volume mesh.
std::string prefix(SurfaceKind kind) { return kind == SurfaceKind::closed ? "boundary " : ""; }

/// The corners at each edge.
///
/// Each corner is kept in a list at the end of its edge that has fewer corners: lookups are short even next to a vertex
/// that all faces share.
class CornerLists {
 public:
  CornerLists(const SurfaceTopology& surface, std::size_t num_vertices)
      : surface_(surface),
        valence_(num_vertices, 0),
        head_(num_vertices, kNoIndex),
        next_(surface.corner_vertices.size()) {
    for (const Index v : surface.corner_vertices) ++valence_[v];
    for (std::size_t h = next_.size(); h-- > 0;) {
      const Index corner = static_cast<Index>(h);
      Index& first = head_[hook(begin(corner), end(corner))];
      next_[h] = first;
      first = corner;
    }
  }

  Index begin(Index corner) const { return surface_.corner_vertices[corner]; }
  Index end(Index corner) const { return surface_.corner_vertices[surface_.next(corner)]; }

  /// The corners of the edge of a corner h.
  struct Edge {
    Index first = kNoIndex;      ///< the least of them
    Index twin = kNoIndex;       ///< the last one that runs back
    Index other = kNoIndex;      ///< the last one but h that runs the same way
    int same = 0, opposite = 0;  ///< how many run which way; h is counted
  };
  Edge edge_of(Index h) const {
    const Index from = begin(h), to = end(h);
    Edge edge;
    for (Index g = head_[hook(from, to)]; g != kNoIndex; g = next_[g]) {  // ascending
      const bool runs_back = begin(g) == to && end(g) == from, runs_along = begin(g) == from && end(g) == to;
      if (edge.first == kNoIndex && (runs_back || runs_along)) edge.first = g;
      if (runs_back) edge.twin = g, ++edge.opposite;
      if (!runs_along) continue;
      ++edge.same;
      if (g != h) edge.other = g;
    }
    return edge;
  }

 private:
  Index hook(Index a, Index b) const {
    return valence_[a] < valence_[b] || (valence_[a] == valence_[b] && a < b) ? a : b;
  }

  const SurfaceTopology& surface_;
  std::vector<Index> valence_, head_, next_;
};

/// The edges that a surface must not have.
struct WrongEdges {
  CrowdedEdges crowded;
  PlaceList turned, unpaired;
};

void refuse(const WrongEdges& edges, SurfaceKind kind) {
  if (!edges.crowded.empty())
    throw InputError((kind == SurfaceKind::closed ? "boundary: " : "surface: ") + edges.crowded.text());
  if (!edges.turned.empty())
    throw InputError(
        edges.turned.text(prefix(kind) + "edge has two faces that run the same way along it: their normals disagree",
                          prefix(kind) + "edges have two faces that run the same way along them: their normals "
                                         "disagree"));
  if (!edges.unpaired.empty())
    throw InputError(edges.unpaired.text(prefix(kind) + "edge lies at one face instead of between two",
                                         prefix(kind) + "edges lie at one face instead of between two"));
}

void pair_corners(SurfaceTopology& surface, std::size_t num_vertices, std::span<const Index> names, SurfaceKind kind,
                  std::span<const Vec3> positions) {
  const std::size_t num_corners = surface.corner_vertices.size();
  surface.vertex_corners.assign(num_vertices, kNoIndex);
  for (std::size_t h = num_corners; h-- > 0;)
    surface.vertex_corners[surface.corner_vertices[h]] = static_cast<Index>(h);
  surface.twins.assign(num_corners, kNoIndex);
  surface.corner_edges.assign(num_corners, kNoIndex);
  surface.edge_corners.reserve(num_corners / 2);
  const auto vertex = [&](Index v) {
    return vertex_text(names.empty() ? v : names[static_cast<std::size_t>(v)],
                       positions.empty() ? nullptr : &positions[static_cast<std::size_t>(v)]);
  };
  const CornerLists corners(surface, num_vertices);
  WrongEdges wrong;
  for (std::size_t i = 0; i < num_corners; ++i) {
    const Index h = static_cast<Index>(i);
    const auto [first, twin, other, same, opposite] = corners.edge_of(h);
    const bool border = kind == SurfaceKind::maybe_open && opposite == 0;
    if (same + opposite > 2) {
      if (h == first)
        wrong.crowded.add(vertex(corners.begin(h)), vertex(corners.end(h)), static_cast<std::size_t>(same + opposite));
      continue;
    }
    if (same != 1 || (opposite != 1 && !border)) {
      const std::string edge = "from vertex " + vertex(corners.begin(h)) + " to " + vertex(corners.end(h));
      if (same == 1)
        wrong.unpaired.add(edge);
      else if (h < other)
        wrong.turned.add(edge);
      continue;
    }
    surface.twins[h] = twin;
    if (border || h < twin) {
      surface.corner_edges[h] = static_cast<Index>(surface.edge_corners.size());
      surface.edge_corners.push_back(h);
    } else {
      surface.corner_edges[h] = surface.corner_edges[twin];
    }
  }
  refuse(wrong, kind);
}

void check_fans(const SurfaceTopology& surface, std::span<const Index> names, SurfaceKind kind,
                std::span<const Vec3> positions) {
  PlaceList crowded;
  std::vector<int> counts(surface.num_vertices(), 0);
  for (Index v : surface.corner_vertices) ++counts[v];
  for (std::size_t v = 0; v < surface.num_vertices(); ++v) {
    const Index start = surface.vertex_corners[v];
    int fan = 0;
    Index h = start;
    for (; h != kNoIndex && (fan == 0 || h != start); h = surface.rotate(h)) ++fan;
    if (h == kNoIndex)  // an open fan: also count the corners clockwise of the start
      for (h = start; (h = surface.twins[h]) != kNoIndex; h = surface.next(h)) ++fan;
    if (fan != counts[v])
      crowded.add("vertex " + vertex_text(names.empty() ? static_cast<Index>(v) : names[v],
                                          positions.empty() ? nullptr : &positions[v]));
  }
  if (!crowded.empty())
    throw InputError(crowded.text(prefix(kind) + "vertex has more than one fan of faces: surfaces touch there",
                                  prefix(kind) + "vertices have more than one fan of faces: surfaces touch there"));
}

float checked_sharpness(double sharpness, const std::string& what) {
  if (!(sharpness > 0)) throw InputError(what + ": sharpness must be positive");
  return static_cast<float>(sharpness);
}

}  // namespace

SurfaceTopology build_surface(std::size_t num_vertices, std::vector<Index> face_offsets,
                              std::vector<Index> face_vertices, std::span<const Index> names, SurfaceKind kind,
                              std::span<const Vec3> positions) {
  SurfaceTopology surface;
  surface.face_offsets = std::move(face_offsets);
  surface.corner_vertices = std::move(face_vertices);
  surface.corner_faces.resize(surface.corner_vertices.size());
  for (std::size_t f = 0; f < surface.num_faces(); ++f)
    for (Index h = surface.face_offsets[f]; h < surface.face_offsets[f + 1]; ++h)
      surface.corner_faces[h] = static_cast<Index>(f);
  pair_corners(surface, num_vertices, names, kind, positions);
  check_fans(surface, names, kind, positions);
  surface.edge_sharpness.assign(surface.num_edges(), 0.0f);
  surface.vertex_sharpness.assign(num_vertices, 0.0f);
  return surface;
}

BoundarySurface tagged_boundary(const VolumeMesh& mesh, const MeshTopology& topology) {
  return tagged_boundary(mesh, topology, sheet_features(mesh, topology));
}

BoundarySurface tagged_boundary(const VolumeMesh& mesh, const MeshTopology& topology, const SheetFeatures& features) {
  BoundarySurface boundary;
  std::vector<Index> number(mesh.num_vertices(), kNoIndex);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v) {
    if (!topology.is_boundary_vertex(static_cast<Index>(v))) continue;
    number[v] = static_cast<Index>(boundary.vertices.size());
    boundary.vertices.push_back(static_cast<Index>(v));
  }
  std::vector<Index> offsets{0}, corners;
  for (Index f : topology.boundary_faces()) {
    boundary.faces.push_back(f);
    for (Index v : topology.face(f)) corners.push_back(number[v]);
    offsets.push_back(static_cast<Index>(corners.size()));
  }
  boundary.topology =
      build_surface(boundary.vertices.size(), std::move(offsets), std::move(corners), boundary.vertices);

  SurfaceTopology& surface = boundary.topology;
  std::vector<Index> surface_edge(topology.num_edges(), kNoIndex);
  for (std::size_t e = 0; e < surface.num_edges(); ++e) {
    const Index h = surface.edge_corners[e];
    const Index a = boundary.vertices[surface.corner_vertices[h]];
    const Index b = boundary.vertices[surface.corner_vertices[surface.next(h)]];
    boundary.edges.push_back(topology.find_edge(a, b));
    surface_edge[boundary.edges.back()] = static_cast<Index>(e);
  }
  const InterfaceMarks& marks = features.marks;
  const auto in_range = [&](Index v) { return v >= 0 && static_cast<std::size_t>(v) < mesh.num_vertices(); };
  for (const CreaseEdge& crease : mesh.tags.creases) {
    const std::string what = "crease " + std::to_string(crease.v0) + "-" + std::to_string(crease.v1);
    const Index e = in_range(crease.v0) && in_range(crease.v1) ? topology.find_edge(crease.v0, crease.v1) : kNoIndex;
    const bool on_interface = e != kNoIndex && marks.has_edge(e);
    if (e == kNoIndex || (surface_edge[e] == kNoIndex && !on_interface))
      throw InputError(what + " is not an edge of the boundary or of an interface");
    const float sharpness = checked_sharpness(crease.sharpness, what);
    if (surface_edge[e] != kNoIndex) surface.edge_sharpness[surface_edge[e]] = sharpness;
  }
  for (const CornerVertex& corner : mesh.tags.corners) {
    const std::string what = "corner " + std::to_string(corner.vertex);
    const bool known = in_range(corner.vertex);
    if (!known || (number[corner.vertex] == kNoIndex && !marks.has_vertex(corner.vertex)))
      throw InputError(what + " is not a vertex of the boundary or of an interface");
    const float sharpness = checked_sharpness(corner.sharpness, what);
    if (number[corner.vertex] != kNoIndex) surface.vertex_sharpness[number[corner.vertex]] = sharpness;
  }
  constexpr auto kFeatureSharpness = static_cast<float>(kInfiniteSharpness);
  for (std::size_t e = 0; e < surface.num_edges(); ++e)
    if (features.is_curve(boundary.edges[e])) surface.edge_sharpness[e] = kFeatureSharpness;
  for (std::size_t v = 0; v < surface.num_vertices(); ++v)
    if (features.is_corner(boundary.vertices[v])) surface.vertex_sharpness[v] = kFeatureSharpness;
  return boundary;
}

}  // namespace subvol
