// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/rim_loops.h"

#include "subvol/base/error.h"
#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <tuple>

namespace subvol::internal {

std::vector<std::vector<RimEdge>> rim_loops(const TriangleMesh& mesh) {
  std::vector<RimEdge> edges;
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(mesh.triangles, mesh.positions.size());
  for_each_edge(std::span(sides), [&](std::span<const SurfaceHalfEdge> run) {
    if (run.size() == 1)
      edges.push_back(
          {run[0].forward ? run[0].low : run[0].high, run[0].forward ? run[0].high : run[0].low, run[0].triangle});
  });
  std::ranges::sort(edges, {}, [](const RimEdge& e) { return std::tuple(e.from, e.to, e.triangle); });
  std::vector<std::size_t> left(mesh.positions.size(), edges.size());  // each vertex's first unused edge
  for (std::size_t i = edges.size(); i-- > 0;) left[edges[i].from] = i;
  std::vector<std::vector<RimEdge>> loops;
  for (std::size_t start = 0; start < edges.size(); ++start) {
    if (start < left[edges[start].from]) continue;
    std::vector<RimEdge>& loop = loops.emplace_back();
    // As many edges leave a vertex as enter it, so a walk returns to its start.
    for (std::size_t at = start;;) {
      left[edges[at].from] = at + 1;
      loop.push_back(edges[at]);
      const Index next = edges[at].to;
      if (next == edges[start].from) break;
      at = left[next];
      if (at == edges.size() || edges[at].from != next)
        throw InputError("surface: the rim of a hole does not close at vertex " + std::to_string(next));
    }
  }
  return loops;
}

}  // namespace subvol::internal
