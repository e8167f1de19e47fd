// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/corner_clusters.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

struct Cluster {
  std::vector<Index> corners;
  std::vector<Vec3> positions;
  std::vector<Index> curves;  ///< followed ones, once for each end here; ascending
};

/// Returns each corner of an open curve as a cluster, and writes the number of the cluster of each corner.
std::vector<Cluster> single_corners(std::span<const FeatureCurve> curves, std::span<const std::uint8_t> followed,
                                    std::map<Index, std::size_t>& cluster_of) {
  std::vector<Cluster> clusters;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    if (curves[c].closed()) continue;
    for (int end = 0; end < 2; ++end) {
      const Index corner = end == 0 ? curves[c].vertices.front() : curves[c].vertices.back();
      const auto [at, is_new] = cluster_of.try_emplace(corner, clusters.size());
      if (is_new) clusters.push_back({{corner}, {end == 0 ? curves[c].points.front() : curves[c].points.back()}, {}});
      if (followed[c]) clusters[at->second].curves.push_back(static_cast<Index>(c));
    }
  }
  return clusters;
}

double extent(const Cluster& a, const Cluster& b) {
  double farthest = 0;
  for (const Vec3& p : a.positions)
    for (const Vec3& q : b.positions) farthest = std::max(farthest, (p - q).norm());
  return farthest;
}

/// Moves all of `from` to `to`, unless a followed curve would begin and end there. Returns false then.
bool join(Cluster& to, Cluster& from) {
  std::vector<Index> curves;
  std::ranges::merge(to.curves, from.curves, std::back_inserter(curves));
  if (std::ranges::adjacent_find(curves) != curves.end()) return false;
  to.curves = std::move(curves);
  to.corners.insert(to.corners.end(), from.corners.begin(), from.corners.end());
  to.positions.insert(to.positions.end(), from.positions.begin(), from.positions.end());
  from.corners.clear();
  return true;
}

}  // namespace

std::map<Index, Index> corner_clusters(const RoutingGraph& graph, const SignedFeatures& features,
                                       std::span<const std::uint8_t> followed,
                                       std::span<const std::uint8_t> vanishing) {
  const std::vector<FeatureCurve>& curves = features.curves.curves;
  std::map<Index, std::size_t> cluster_of;
  std::vector<Cluster> clusters = single_corners(curves, followed, cluster_of);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t c = 0; c < curves.size(); ++c)
    if (vanishing[c] && !curves[c].closed()) order.push_back({curves[c].length(), c});
  std::sort(order.begin(), order.end());
  for (const auto& [length, c] : order) {
    const std::size_t a = cluster_of[curves[c].vertices.front()], b = cluster_of[curves[c].vertices.back()];
    Cluster &to = clusters[std::min(a, b)], &from = clusters[std::max(a, b)];
    if (a == b || extent(to, from) > kLeastRoutedLength * graph.edge_length()) continue;
    const std::vector<Index> moved = from.corners;
    if (!join(to, from)) continue;
    for (const Index corner : moved) cluster_of[corner] = std::min(a, b);
  }
  std::map<Index, Index> result;
  for (const Cluster& cluster : clusters)
    if (cluster.corners.size() > 1)
      for (const Index corner : cluster.corners) result[corner] = *std::ranges::min_element(cluster.corners);
  return result;
}

}  // namespace subvol::internal
