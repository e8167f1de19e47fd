// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/crease_sheets.h"

#include <algorithm>
#include <array>
#include <utility>

namespace subvol::internal {

CreaseSheets::CreaseSheets(const VolumeMesh& mesh, const MeshTopology& topology, const SheetSurface& sheets)
    : topology_(topology) {
  const SurfaceTopology& surface = sheets.topology;
  std::vector<double> crease_shares(topology.num_edges(), 0.0);
  bool any = false;
  for (std::size_t i = 0; i < surface.num_edges(); ++i) {
    const Index e = sheets.edges[i];
    if (!(surface.edge_sharpness[i] > 0) || topology.num_edge_cells(e) < kMinCells) continue;
    crease_shares[e] = std::min(1.0f, surface.edge_sharpness[i]);
    any = true;
  }
  if (!any) return;
  face_shares_.assign(topology.num_faces(), 0.0);
  edge_shares_.assign(topology.num_edges(), 0.0);
  fixed_.assign(mesh.num_vertices(), 0);
  for (std::size_t v = 0; v < surface.num_vertices(); ++v)
    fixed_[sheets.vertices[v]] = vertex_weights_at(surface, static_cast<Index>(v), BoundaryRule::catmull_clark).fixed();

  on_sheet_.assign(topology.num_edges(), 0);
  for (const Index e : sheets.edges) on_sheet_[e] = 1;
  std::vector<char> face_on_sheet(topology.num_faces(), 0);
  for (const Index f : sheets.faces) face_on_sheet[f] = 1;
  for (std::size_t f = 0; f < topology.num_faces(); ++f)
    if (!face_on_sheet[f]) visit_face(static_cast<Index>(f), crease_shares);
  const auto key = [](const EdgeFace& a) { return std::pair(a.edge, a.face); };
  std::sort(edge_faces_.begin(), edge_faces_.end(),
            [&](const EdgeFace& a, const EdgeFace& b) { return key(a) < key(b); });
  edge_faces_.erase(std::unique(edge_faces_.begin(), edge_faces_.end(),
                                [&](const EdgeFace& a, const EdgeFace& b) { return key(a) == key(b); }),
                    edge_faces_.end());
}

void CreaseSheets::visit_face(Index f, const std::vector<double>& crease_shares) {
  const auto face = topology_.face(f);
  const std::size_t n = face.size();
  std::array<Index, 4> edges;
  for (std::size_t j = 0; j < n; ++j) edges[j] = topology_.find_edge(face[j], face[(j + 1) % n]);
  for (std::size_t j = 0; j < n; ++j) {
    const double share = crease_shares[edges[j]];
    if (share == 0) continue;
    face_shares_[f] = std::max(face_shares_[f], share);
    for (const Index e : {edges[(j + 1) % n], edges[(j + n - 1) % n]}) {
      if (on_sheet_[e]) continue;
      edge_shares_[e] = std::max(edge_shares_[e], share);
      edge_faces_.push_back({e, f});
    }
  }
}

void CreaseSheets::add_edge(Index e, double weight, RowBuilder& row) const {
  const auto first = std::lower_bound(edge_faces_.begin(), edge_faces_.end(), e,
                                      [](const EdgeFace& a, Index edge) { return a.edge < edge; });
  auto last = first;
  while (last != edge_faces_.end() && last->edge == e) ++last;
  const auto [a, b] = topology_.edge(e);
  const double count = static_cast<double>(last - first);
  // At a fixed vertex and at the end of the crease there is no curve along which the sheet could be smooth.
  const bool straight = fixed_[a] || fixed_[b] || count == 1;
  const double end = straight ? 0.5 : 0.25;
  row.add(a, weight * end);
  row.add(b, weight * end);
  if (straight) return;
  for (auto it = first; it != last; ++it) {
    const auto face = topology_.face(it->face);
    for (Index v : face) row.add(v, weight * 0.5 / count / static_cast<double>(face.size()));
  }
}

}  // namespace subvol::internal
