// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/sheets.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/mesh/features.h"

#include <algorithm>
#include <string>

namespace subvol::internal {

namespace {

constexpr auto kFeatureSharpness = static_cast<float>(kInfiniteSharpness);

/// Finds feature curves, fans and corners.
class FeatureFinder {
 public:
  FeatureFinder(const VolumeMesh& mesh, const MeshTopology& topology) : mesh_(mesh), topology_(topology) {}

  SheetFeatures run() {
    result_.interfaces = find_interfaces(mesh_, topology_);
    if (result_.interfaces.empty()) return std::move(result_);
    result_.marks = mark_interfaces(topology_, result_.interfaces);
    list_corners();
    pair_corners();
    number_fans();
    find_corners();
    return std::move(result_);
  }

 private:
  Index next(Index h) const {
    const Index f = face_of_corner_[h];
    return h + 1 == result_.face_offsets[f + 1] ? result_.face_offsets[f] : h + 1;
  }
  Index prev(Index h) const {
    const Index f = face_of_corner_[h];
    return h == result_.face_offsets[f] ? result_.face_offsets[f + 1] - 1 : h - 1;
  }

  void list_corners() {
    for (std::size_t i = 0; i < result_.interfaces.faces.size(); ++i) {
      const Index face = result_.interfaces.faces[i];
      const auto corners = oriented_face(mesh_, topology_, face);
      const std::size_t size = topology_.face(face).size();
      for (std::size_t k = 0; k < size; ++k) {
        result_.corner_vertices.push_back(corners[k]);
        result_.corner_edges.push_back(topology_.find_edge(corners[k], corners[(k + 1) % size]));
        face_of_corner_.push_back(static_cast<Index>(i));
      }
      result_.face_offsets.push_back(static_cast<Index>(result_.corner_vertices.size()));
    }
  }

  void pair_corners() {
    const std::size_t n = result_.corner_vertices.size();
    result_.twins.assign(n, kNoIndex);
    std::vector<Index> first(topology_.num_edges(), kNoIndex);
    for (std::size_t i = 0; i < n; ++i) {
      const Index h = static_cast<Index>(i), e = result_.corner_edges[i];
      if (result_.marks.curves[e]) continue;
      if (first[e] == kNoIndex) {
        first[e] = h;
        continue;
      }
      if (result_.corner_vertices[h] == result_.corner_vertices[first[e]])
        throw InputError("edge " + std::to_string(topology_.edge(e)[0]) + '-' + std::to_string(topology_.edge(e)[1]) +
                         " between two regions: its two faces run the same way along it");
      result_.twins[h] = first[e];
      result_.twins[first[e]] = h;
    }
  }

  void number_fans() {
    const std::size_t n = result_.corner_vertices.size();
    DisjointSets fans(n);
    for (std::size_t h = 0; h < n; ++h)
      if (const Index twin = result_.twins[h]; twin != kNoIndex) fans.join(static_cast<Index>(h), next(twin));
    std::vector<Index> first_corners;
    for (std::size_t h = 0; h < n; ++h)
      if (fans.of(static_cast<Index>(h)) == static_cast<Index>(h)) first_corners.push_back(static_cast<Index>(h));
    std::ranges::stable_sort(first_corners, {}, [&](Index h) { return result_.corner_vertices[h]; });
    std::vector<Index> number(n, kNoIndex);
    for (const Index h : first_corners) {
      number[h] = static_cast<Index>(result_.fan_vertices.size());
      result_.fan_vertices.push_back(result_.corner_vertices[h]);
    }
    for (std::size_t h = 0; h < n; ++h) result_.fan_of_corner.push_back(number[fans.of(static_cast<Index>(h))]);
  }

  void find_corners() {
    const std::size_t nv = topology_.num_vertices(), num_fans = result_.fan_vertices.size();
    std::vector<int> ends(nv, 0), rims(nv, 0), fans(nv, 0);  // edges of feature curves, and those on the boundary
    for (std::size_t e = 0; e < result_.marks.curves.size(); ++e)
      for (const Index v : topology_.edge(static_cast<Index>(e))) {
        ends[v] += result_.marks.curves[e];
        rims[v] += result_.marks.curves[e] && topology_.is_boundary_edge(static_cast<Index>(e));
      }
    // The first and the last edge of each fan that feature curves cut open.
    std::vector<std::array<Index, 2>> borders(num_fans, {kNoIndex, kNoIndex});
    for (std::size_t i = 0; i < result_.corner_vertices.size(); ++i) {
      const Index out = result_.corner_edges[i], in = result_.corner_edges[prev(static_cast<Index>(i))];
      if (result_.marks.curves[out]) borders[result_.fan_of_corner[i]][0] = out;
      if (result_.marks.curves[in]) borders[result_.fan_of_corner[i]][1] = in;
    }
    result_.corners.assign(nv, 0);
    for (std::size_t k = 0; k < num_fans; ++k) {
      const Index v = result_.fan_vertices[k];
      const bool closed = borders[k][0] == kNoIndex, on_boundary = topology_.is_boundary_vertex(v);
      ++fans[v];
      const bool smooth = closed && ends[v] == 0 && !on_boundary && fans[v] == 1;
      const bool along_curve =
          !closed && borders[k][0] != borders[k][1] && ends[v] == 2 && (!on_boundary || rims[v] == 2);
      if (!smooth && !along_curve) result_.corners[v] = 1;
    }
    for (const CreaseEdge& crease : mesh_.tags.creases) {
      const auto in_range = [&](Index v) { return v >= 0 && static_cast<std::size_t>(v) < nv; };
      if (!in_range(crease.v0) || !in_range(crease.v1)) continue;
      const Index e = topology_.find_edge(crease.v0, crease.v1);
      if (e == kNoIndex || result_.marks.curves[e]) continue;
      for (const Index v : {crease.v0, crease.v1})
        if (ends[v] > 0) result_.corners[v] = 1;
    }
  }

  const VolumeMesh& mesh_;
  const MeshTopology& topology_;
  SheetFeatures result_;
  std::vector<Index> face_of_corner_;
};

}  // namespace

SheetFeatures sheet_features(const VolumeMesh& mesh, const MeshTopology& topology) {
  return FeatureFinder(mesh, topology).run();
}

SheetSurface tagged_sheets(const VolumeMesh& mesh, const MeshTopology& topology) {
  const SheetFeatures features = sheet_features(mesh, topology);
  SheetSurface sheets{tagged_boundary(mesh, topology, features)};
  sheets.num_boundary_faces = sheets.faces.size();
  if (features.interfaces.empty()) return sheets;

  SurfaceTopology& surface = sheets.topology;
  const auto first_vertex = static_cast<Index>(surface.num_vertices());
  const auto first_face = static_cast<Index>(surface.num_faces());
  const auto first_corner = static_cast<Index>(surface.corner_vertices.size());
  sheets.vertices.insert(sheets.vertices.end(), features.fan_vertices.begin(), features.fan_vertices.end());
  sheets.faces.insert(sheets.faces.end(), features.interfaces.faces.begin(), features.interfaces.faces.end());
  for (std::size_t i = 1; i < features.face_offsets.size(); ++i) {
    surface.face_offsets.push_back(first_corner + features.face_offsets[i]);
    surface.corner_faces.resize(static_cast<std::size_t>(first_corner + features.face_offsets[i]),
                                first_face + static_cast<Index>(i) - 1);
  }
  surface.vertex_corners.resize(sheets.vertices.size(), kNoIndex);
  std::vector<float> sharpness(topology.num_edges(), 0.0f);
  for (const CreaseEdge& crease : mesh.tags.creases)
    sharpness[topology.find_edge(crease.v0, crease.v1)] = static_cast<float>(crease.sharpness);
  for (std::size_t i = 0; i < features.corner_vertices.size(); ++i) {
    const Index h = first_corner + static_cast<Index>(i), v = first_vertex + features.fan_of_corner[i];
    const Index e = features.corner_edges[i], twin = features.twins[i];
    surface.corner_vertices.push_back(v);
    surface.twins.push_back(twin == kNoIndex ? kNoIndex : first_corner + twin);
    if (twin == kNoIndex || surface.vertex_corners[v] == kNoIndex) surface.vertex_corners[v] = h;
    if (twin != kNoIndex && twin < static_cast<Index>(i)) {
      surface.corner_edges.push_back(surface.corner_edges[first_corner + twin]);
      continue;
    }
    surface.corner_edges.push_back(static_cast<Index>(sheets.edges.size()));
    surface.edge_corners.push_back(h);
    surface.edge_sharpness.push_back(features.is_curve(e) ? kFeatureSharpness : sharpness[e]);
    sheets.edges.push_back(e);
  }
  std::vector<float> corners(mesh.num_vertices(), 0.0f);
  for (const CornerVertex& corner : mesh.tags.corners) corners[corner.vertex] = static_cast<float>(corner.sharpness);
  for (const Index v : features.fan_vertices)
    surface.vertex_sharpness.push_back(features.is_corner(v) ? kFeatureSharpness : corners[v]);
  return sheets;
}

FeatureTags boundary_tags(const VolumeMesh& mesh, const MeshTopology& topology) {
  const BoundarySurface boundary = tagged_boundary(mesh, topology);
  const SurfaceTopology& surface = boundary.topology;
  FeatureTags tags;
  for (std::size_t e = 0; e < surface.num_edges(); ++e) {
    const auto [v0, v1] = topology.edge(boundary.edges[e]);
    if (surface.edge_sharpness[e] > 0) tags.creases.push_back({v0, v1, surface.edge_sharpness[e]});
  }
  for (std::size_t v = 0; v < surface.num_vertices(); ++v)
    if (surface.vertex_sharpness[v] > 0) tags.corners.push_back({boundary.vertices[v], surface.vertex_sharpness[v]});
  return merge_tags(tags, {});
}

PolygonMesh interface_surface(const VolumeMesh& mesh, const MeshTopology& topology, const Interfaces& interfaces) {
  PolygonMesh surface;
  surface.positions = mesh.positions;
  for (const Index f : interfaces.faces) {
    const auto corners = oriented_face(mesh, topology, f);
    surface.face_vertices.insert(surface.face_vertices.end(), corners.begin(),
                                 corners.begin() + static_cast<std::ptrdiff_t>(topology.face(f).size()));
    surface.face_offsets.push_back(surface.face_vertices.size());
  }
  return surface;
}

}  // namespace subvol::internal
