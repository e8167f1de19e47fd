// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/path_negotiation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace subvol::internal {

namespace {

/// In units of h^3, an edge on its curve costs about 0.02, and one that is h off costs 1. The first price of another
/// path makes no detour; that of the last round, 44, makes every detour within reach. Not tuned.
constexpr int kMostNegotiationRounds = 20;
/// The price grows by this factor from round to round. A place where several paths met costs this much more per round.
constexpr double kFirstPrice = 0.02, kPriceGrowth = 1.5, kPriceOfHistory = 0.1;

/// Number of paths at each vertex or edge, and the number of rounds that ended with several there.
struct Use {
  int now = 0, contested = 0;
  double price(double present) const { return present * now + kPriceOfHistory * contested; }
};

class Negotiation {
 public:
  Negotiation(const RoutingGraph& graph, const FeatureCurves& features, const Occupied& base)
      : graph_(graph),
        features_(features),
        priced_(base),
        unit_(std::pow(graph.edge_length(), 3)),
        paths_(features.curves.size()) {
    vertices_.resize(base.vertices.size());
    edges_.resize(base.edges.size());
    priced_.vertex_prices.resize(vertices_.size());
    priced_.edge_prices.resize(edges_.size());
  }

  std::vector<std::vector<Index>> run(std::span<const Index> curves, CurveSearch& search) {
    std::vector<std::uint8_t> is_hopeless(paths_.size(), 0);  // no path is near, whatever the prices
    for (int round = 0; round < kMostNegotiationRounds; ++round) {
      begin_round(kFirstPrice * std::pow(kPriceGrowth, round));
      for (const Index c : curves) {
        if (is_hopeless[c] || (!paths_[c].empty() && !shares(paths_[c]))) continue;
        count(paths_[c], -1);
        auto found = search.find(c, priced_);
        if (round == 0) is_hopeless[c] = !found;
        paths_[c] = found ? std::move(found->path) : std::vector<Index>();
        count(paths_[c], 1);
      }
      keep_if_longest(curves);
      if (!note_contested()) break;
    }
    return std::move(best_);
  }

 private:
  bool is_free(Index v) const { return !priced_.vertices[v]; }

  void begin_round(double present) {
    present_ = present;
    for (std::size_t v = 0; v < vertices_.size(); ++v) set_price(static_cast<Index>(v));
    for (std::size_t e = 0; e < edges_.size(); ++e) set_edge_price(static_cast<Index>(e));
  }
  void set_price(Index v) { priced_.vertex_prices[v] = unit_ * vertices_[v].price(present_); }
  void set_edge_price(Index e) { priced_.edge_prices[e] = unit_ * edges_[e].price(present_); }

  /// Calls visit_vertex(v) for the vertices of a path that no other may use, once each, and visit_edge(e).
  template <class VisitVertex, class VisitEdge>
  void visit(std::span<const Index> path, const VisitVertex& visit_vertex, const VisitEdge& visit_edge) const {
    for (std::size_t i = 0; i < path.size(); ++i) {
      const bool is_repeated = i > 0 && i + 1 == path.size() && path[i] == path.front();
      if (is_free(path[i]) && !is_repeated) visit_vertex(path[i]);
      if (i > 0) visit_edge(graph_.edge_between(path[i - 1], path[i]));
    }
  }

  void count(std::span<const Index> path, int more) {
    visit(
        path, [&](Index v) { vertices_[v].now += more, set_price(v); },
        [&](Index e) { edges_[e].now += more, set_edge_price(e); });
  }

  bool shares(std::span<const Index> path) const {
    bool result = false;
    visit(
        path, [&](Index v) { result |= vertices_[v].now > 1; }, [&](Index e) { result |= edges_[e].now > 1; });
    return result;
  }

  /// Counts the contested vertices and edges once more. Returns false if there are none.
  bool note_contested() {
    bool any = false;
    for (auto* uses : {&vertices_, &edges_})
      for (Use& use : *uses)
        if (use.now > 1) ++use.contested, any = true;
    return any;
  }

  /// Keeps the paths that share nothing with more important ones if they are longer than those of the rounds before.
  void keep_if_longest(std::span<const Index> curves) {
    std::vector<std::uint8_t> vertices(vertices_.size()), edges(edges_.size());
    std::vector<std::vector<Index>> kept(paths_.size());
    double length = 0;
    for (const Index c : curves) {
      bool is_clear = !paths_[c].empty();
      visit(
          paths_[c], [&](Index v) { is_clear &= !vertices[v]; }, [&](Index e) { is_clear &= !edges[e]; });
      if (!is_clear) continue;
      visit(
          paths_[c], [&](Index v) { vertices[v] = 1; }, [&](Index e) { edges[e] = 1; });
      kept[c] = paths_[c];
      length += features_.curves[c].length();
    }
    if (!best_.empty() && length <= best_length_) return;
    best_length_ = length;
    best_ = std::move(kept);
  }

  const RoutingGraph& graph_;
  const FeatureCurves& features_;
  Occupied priced_;
  double unit_;  ///< of prices: the cube of h
  std::vector<Use> vertices_, edges_;
  double present_ = 0;  ///< price of another path, this round
  std::vector<std::vector<Index>> paths_, best_;
  double best_length_ = 0;
};

}  // namespace

std::vector<std::vector<Index>> negotiated_paths(const RoutingGraph& graph, const FeatureCurves& features,
                                                 std::span<const Index> curves, const Occupied& base,
                                                 CurveSearch& search) {
  return Negotiation(graph, features, base).run(curves, search);
}

}  // namespace subvol::internal
