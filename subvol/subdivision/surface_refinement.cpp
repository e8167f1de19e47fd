// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/surface_refinement.h"

namespace subvol::internal {

namespace {

void add_centroid(const SurfaceTopology& surface, Index f, double weight, const RowTarget& target) {
  const double share = target.scale * weight / surface.face_size(f);
  for (Index v : surface.face(f)) target.row.add(target.columns[v], share);
}

Vec3 edge_child(const SurfaceTopology& surface, Index e, std::span<const Vec3> points,
                std::span<const Vec3> centroids) {
  const Index h = surface.edge_corners[e], twin = surface.twins[h];
  if (twin == kNoIndex) return Vec3::Zero();
  const std::array<Index, 2> faces = {surface.corner_faces[h], surface.corner_faces[twin]};
  const EdgeWeights weights = edge_weights(BoundaryRule::catmull_clark, surface.edge_sharpness[e],
                                           {surface.face_size(faces[0]), surface.face_size(faces[1])});
  return weights.end * (points[surface.corner_vertices[h]] + points[surface.corner_vertices[twin]]) +
         weights.face[0] * centroids[faces[0]] + weights.face[1] * centroids[faces[1]];
}

bool on_border(const SurfaceTopology& surface, Index v) {
  const Index start = surface.vertex_corners[v];
  Index h = start;
  do h = surface.rotate(h);
  while (h != start && h != kNoIndex);
  return h == kNoIndex;
}

Vec3 vertex_child(const SurfaceTopology& surface, Index v, std::span<const Vec3> points,
                  std::span<const Vec3> centroids) {
  if (on_border(surface, v)) return Vec3::Zero();
  const VertexWeights weights = vertex_weights_at(surface, v, BoundaryRule::catmull_clark);
  Vec3 child = weights.self * points[v];
  if (weights.fixed()) return child;
  Index h = surface.vertex_corners[v];
  for (int i = 0; i == 0 || h != surface.vertex_corners[v]; ++i, h = surface.rotate(h)) {
    const bool crease = weights.crease != 0 && (i == weights.crease_ends[0] || i == weights.crease_ends[1]);
    const double weight = weights.edge + (crease ? weights.crease : 0);
    child += weight * points[surface.corner_vertices[surface.next(h)]];
    child += weights.face * centroids[surface.corner_faces[h]];
  }
  return child;
}

}  // namespace

void add_face_child(const SurfaceTopology& surface, Index f, const RowTarget& target) {
  add_centroid(surface, f, 1, target);
}

void add_edge_child(const SurfaceTopology& surface, Index e, const RowTarget& target) {
  const Index h = surface.edge_corners[e], twin = surface.twins[h];
  if (twin == kNoIndex) {
    target.row.add(target.columns[surface.corner_vertices[h]], target.scale * 0.5);
    target.row.add(target.columns[surface.corner_vertices[surface.next(h)]], target.scale * 0.5);
    return;
  }
  const std::array<Index, 2> faces = {surface.corner_faces[h], surface.corner_faces[twin]};
  const EdgeWeights weights =
      edge_weights(target.rule, surface.edge_sharpness[e], {surface.face_size(faces[0]), surface.face_size(faces[1])});
  target.row.add(target.columns[surface.corner_vertices[h]], target.scale * weights.end);
  target.row.add(target.columns[surface.corner_vertices[twin]], target.scale * weights.end);
  for (int i = 0; i < 2; ++i)
    if (weights.face[i] != 0) add_centroid(surface, faces[i], weights.face[i], target);
}

VertexWeights vertex_weights_at(const SurfaceTopology& surface, Index v, BoundaryRule rule) {
  std::vector<float> sharpness;
  visit_ring(surface, v, [&](int, Index edge, Index, Index) { sharpness.push_back(surface.edge_sharpness[edge]); });
  return vertex_weights(rule, surface.vertex_sharpness[v], sharpness);
}

void add_vertex_child(const SurfaceTopology& surface, Index v, const RowTarget& target) {
  const VertexWeights weights = vertex_weights_at(surface, v, target.rule);
  target.row.add(target.columns[v], target.scale * weights.self);
  if (weights.fixed()) return;
  visit_ring(surface, v, [&](int i, Index, Index neighbor, Index face) {
    const bool crease = weights.crease != 0 && (i == weights.crease_ends[0] || i == weights.crease_ends[1]);
    const double weight = weights.edge + (crease ? weights.crease : 0);
    if (weight != 0) target.row.add(target.columns[neighbor], target.scale * weight);
    if (weights.face != 0 && face != kNoIndex) add_centroid(surface, face, weights.face, target);
  });
}

SparseMap refinement_rows(const SurfaceTopology& surface, BoundaryRule rule, std::span<const Index> columns,
                          std::size_t num_cols) {
  const std::size_t nv = surface.num_vertices(), ne = surface.num_edges(), nf = surface.num_faces();
  return assemble_rows(nv + ne + nf, num_cols, [&](std::size_t i, RowBuilder& row) {
    const RowTarget target{rule, columns, row};
    if (i < nv)
      add_vertex_child(surface, static_cast<Index>(i), target);
    else if (i < nv + ne)
      add_edge_child(surface, static_cast<Index>(i - nv), target);
    else
      add_face_child(surface, static_cast<Index>(i - nv - ne), target);
  });
}

// The half of edge e at its own corner becomes edge 2e, the other half 2e + 1. The edge from the middle of the edge out
// of corner h into the face becomes 2 ne + h.
SurfaceTopology refined_topology(const SurfaceTopology& coarse) {
  const Index nv = static_cast<Index>(coarse.num_vertices()), ne = static_cast<Index>(coarse.num_edges());
  const Index nf = static_cast<Index>(coarse.num_faces());
  const std::size_t num_corners = coarse.corner_vertices.size();
  SurfaceTopology fine;
  fine.face_offsets.resize(num_corners + 1);
  fine.corner_vertices.resize(4 * num_corners);
  fine.corner_faces.resize(4 * num_corners);
  fine.twins.resize(4 * num_corners);
  fine.corner_edges.resize(4 * num_corners);
  fine.edge_corners.assign(2 * ne + num_corners, kNoIndex);
  fine.edge_sharpness.assign(2 * ne + num_corners, 0.0f);
  fine.vertex_corners.assign(nv + ne + nf, kNoIndex);
  fine.vertex_sharpness.assign(nv + ne + nf, 0.0f);
  for (std::size_t i = 0; i < num_corners; ++i) {
    // Child quad of corner h: (vertex, edge out, face, edge in).
    const Index h = static_cast<Index>(i), p = coarse.prev(h), n = coarse.next(h);
    const Index out = coarse.corner_edges[h], in = coarse.corner_edges[p];
    const Index q = 4 * h;
    fine.face_offsets[i] = q;
    const std::array<Index, 4> vertices = {coarse.corner_vertices[h], nv + out, nv + ne + coarse.corner_faces[h],
                                           nv + in};
    const Index beyond_out = coarse.twins[h], beyond_in = coarse.twins[p];
    const std::array<Index, 4> twins = {beyond_out == kNoIndex ? kNoIndex : 4 * coarse.next(beyond_out) + 3, 4 * n + 2,
                                        4 * p + 1, beyond_in == kNoIndex ? kNoIndex : 4 * beyond_in};
    const bool owns_out = coarse.edge_corners[out] == h, owns_in = coarse.edge_corners[in] == p;
    const std::array<Index, 4> edges = {2 * out + (owns_out ? 0 : 1), 2 * ne + h, 2 * ne + p,
                                        2 * in + (owns_in ? 1 : 0)};
    for (int k = 0; k < 4; ++k) {
      fine.corner_vertices[q + k] = vertices[k];
      fine.corner_faces[q + k] = h;
      fine.twins[q + k] = twins[k];
      fine.corner_edges[q + k] = edges[k];
      if (fine.edge_corners[edges[k]] == kNoIndex) fine.edge_corners[edges[k]] = q + k;
      if (fine.vertex_corners[vertices[k]] == kNoIndex) fine.vertex_corners[vertices[k]] = q + k;
    }
  }
  for (std::size_t h = 0; h < fine.twins.size(); ++h)
    if (fine.twins[h] == kNoIndex) fine.vertex_corners[fine.corner_vertices[h]] = static_cast<Index>(h);
  fine.face_offsets[num_corners] = static_cast<Index>(4 * num_corners);
  for (Index e = 0; e < ne; ++e)
    fine.edge_sharpness[2 * e] = fine.edge_sharpness[2 * e + 1] = child_sharpness(coarse.edge_sharpness[e]);
  for (Index v = 0; v < nv; ++v) fine.vertex_sharpness[v] = child_sharpness(coarse.vertex_sharpness[v]);
  return fine;
}

std::vector<Vec3> refined_points(const SurfaceTopology& surface, std::span<const Vec3> points) {
  const std::size_t nv = surface.num_vertices(), ne = surface.num_edges(), nf = surface.num_faces();
  std::vector<Vec3> children(nv + ne + nf);
  const std::span<Vec3> centroids = std::span(children).subspan(nv + ne);
#pragma omp parallel
  {
#pragma omp for schedule(static)
    for (std::size_t f = 0; f < nf; ++f) {
      Vec3 sum = Vec3::Zero();
      for (const Index v : surface.face(static_cast<Index>(f))) sum += points[v];
      centroids[f] = sum / surface.face_size(static_cast<Index>(f));
    }
#pragma omp for schedule(static)
    for (std::size_t e = 0; e < ne; ++e)
      children[nv + e] = edge_child(surface, static_cast<Index>(e), points, centroids);
#pragma omp for schedule(static)
    for (std::size_t v = 0; v < nv; ++v) children[v] = vertex_child(surface, static_cast<Index>(v), points, centroids);
  }
  return children;
}

SurfacePiece surface_piece(const SurfaceTopology& surface, std::span<const Index> chosen) {
  std::vector<Index> faces(chosen.begin(), chosen.end());
  std::vector<Index> face_number(surface.num_faces(), kNoIndex);
  for (std::size_t i = 0; i < faces.size(); ++i) face_number[faces[i]] = static_cast<Index>(i);
  for (const Index f : chosen)
    for (Index start = surface.face_offsets[f]; start < surface.face_offsets[f + 1]; ++start)
      for (Index h = surface.rotate(start); h != start; h = surface.rotate(h)) {
        const Index around = surface.corner_faces[h];
        if (face_number[around] != kNoIndex) continue;
        face_number[around] = static_cast<Index>(faces.size());
        faces.push_back(around);
      }

  SurfacePiece piece;
  SurfaceTopology& open = piece.topology;
  for (const Index f : faces) open.face_offsets.push_back(open.face_offsets.back() + surface.face_size(f));
  std::vector<Index> vertex_number(surface.num_vertices(), kNoIndex), edge_number(surface.num_edges(), kNoIndex);
  for (std::size_t i = 0; i < faces.size(); ++i)
    for (Index h = surface.face_offsets[faces[i]]; h < surface.face_offsets[faces[i] + 1]; ++h) {
      const Index corner = static_cast<Index>(open.corner_vertices.size());
      const Index v = surface.corner_vertices[h], e = surface.corner_edges[h], twin = surface.twins[h];
      if (vertex_number[v] == kNoIndex) {
        vertex_number[v] = static_cast<Index>(piece.vertices.size());
        piece.vertices.push_back(v);
        open.vertex_corners.push_back(corner);
        open.vertex_sharpness.push_back(surface.vertex_sharpness[v]);
      }
      if (edge_number[e] == kNoIndex) {
        edge_number[e] = static_cast<Index>(open.edge_corners.size());
        open.edge_corners.push_back(corner);
        open.edge_sharpness.push_back(surface.edge_sharpness[e]);
      }
      const Index beyond = twin == kNoIndex ? kNoIndex : face_number[surface.corner_faces[twin]];
      open.corner_vertices.push_back(vertex_number[v]);
      open.corner_edges.push_back(edge_number[e]);
      open.corner_faces.push_back(static_cast<Index>(i));
      open.twins.push_back(beyond == kNoIndex
                               ? kNoIndex
                               : open.face_offsets[beyond] + twin - surface.face_offsets[surface.corner_faces[twin]]);
    }
  return piece;
}

}  // namespace subvol::internal
