// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/routing_graph.h"

#include "subvol/base/error.h"
#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/features/polyline.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <cassert>
#include <string>

namespace subvol::internal {

RoutingGraph::RoutingGraph(const VolumeMesh& mesh, bool on_sheets)
    : mesh_(&mesh), offsets_(mesh.num_vertices() + 1, 0) {
  const MeshTopology topology(mesh);
  InterfaceMarks marks;
  if (on_sheets) marks = mark_interfaces(topology, find_interfaces(mesh, topology));
  for (std::size_t e = 0; e < topology.num_edges(); ++e)
    if (const auto edge = static_cast<Index>(e); topology.is_boundary_edge(edge) || marks.has_edge(edge))
      edges_.push_back(
          {topology.edge(edge), on_sheets ? (marks.is_curve(edge) ? 1 : 2) : topology.num_edge_cells(edge)});
  for (const Edge& edge : edges_)
    for (Index v : edge.ends) ++offsets_[v + 1];
  for (std::size_t v = 0; v + 1 < offsets_.size(); ++v) {
    if (offsets_[v + 1] > 0) vertices_.push_back(static_cast<Index>(v));
    offsets_[v + 1] += offsets_[v];
  }
  around_.resize(2 * edges_.size());
  std::vector<std::size_t> next(offsets_.begin(), offsets_.end() - 1);
  for (std::size_t e = 0; e < edges_.size(); ++e)
    for (Index v : edges_[e].ends) around_[next[v]++] = static_cast<Index>(e);
  std::vector<Vec3> sites;
  for (Index v : vertices_) {
    if (!position(v).allFinite())
      throw InputError("route_features: the position of vertex " + std::to_string(v) + " is not finite");
    sites.push_back(position(v));
  }
  for (const Edge& edge : edges_) edge_length_ += (position(edge.ends[1]) - position(edge.ends[0])).norm();
  if (!edges_.empty()) edge_length_ /= static_cast<double>(edges_.size());
  if (!sites.empty()) tree_ = SiteTree(sites);
}

Index RoutingGraph::edge_between(Index v, Index w) const {
  for (Index e : edges_at(v))
    if (other_end(e, v) == w) return e;
  assert(false);
  return kNoIndex;
}

std::vector<Index> RoutingGraph::vertices_near(const Vec3& point, double distance) const {
  constexpr double kBallRoundingRoom = 1.01;  // the tree rounds differently
  std::vector<Index> places, found;
  const SiteTree::Ball ball{point, kBallRoundingRoom * distance * distance};
  if (!vertices_.empty()) tree_.gather({&ball, 1}, vertices_.size(), places);
  for (Index place : places)
    if (const Index v = vertices_[tree_.site(place)]; (position(v) - point).norm() <= distance) found.push_back(v);
  std::sort(found.begin(), found.end());
  return found;
}

void Occupied::add(const RoutingGraph& graph, std::span<const Index> path) {
  for (std::size_t i = 0; i < path.size(); ++i) {
    vertices[path[i]] = 1;
    if (i > 0) edges[graph.edge_between(path[i - 1], path[i])] = 1;
  }
}

bool has_edge_on(const RoutingGraph& graph, const FeatureCurve& curve) {
  constexpr double kEdgeOnCurveTolerance = 0.05;  // share of the length
  if (graph.edges().empty()) return false;
  const double length = curve.length(), most = kEdgeOnCurveTolerance * length;
  const Vec3 &front = curve.points.front(), &back = curve.points.back();
  const Index v = graph.nearest_vertex(front), w = graph.nearest_vertex(back);
  if ((graph.position(v) - front).norm() > most || (graph.position(w) - back).norm() > most) return false;
  if ((front - back).norm() < length - most) return false;  // it is bent
  return std::ranges::any_of(graph.edges_at(v), [&](Index edge) { return graph.other_end(edge, v) == w; });
}

}  // namespace subvol::internal
