// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/order_indicator.h"

#include "subvol/fit/solver/vector_math.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace subvol::internal {

namespace {

std::vector<int> next_orders(std::vector<int> orders, int max_order) {
  for (int& p : orders) p = std::max(p, std::min(p + std::max(1, p / 2), max_order));
  return orders;
}

/// Calls f(kind, entity, shape): kind 0 for edges, 1 for faces, 2 for cells.
template <class Function>
void for_each_entity(const ElementSpace& space, const Function& f) {
  const MeshTopology& mesh = space.topology();
  for (std::size_t e = 0; e < mesh.num_edges(); ++e) f(0, e, EntityShape::edge);
  for (std::size_t i = 0; i < mesh.num_faces(); ++i) f(1, i, space.face_shape(i));
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) f(2, c, entity_shape(space.kind(c)));
}

template <class Orders>
auto& entities(Orders& orders, int kind) {
  return kind == 0 ? orders.edges : kind == 1 ? orders.faces : orders.cells;
}

/// Returns the lowest order that contains a mode (`for_each_mode`).
int first_order(EntityShape shape, ModeIndex m) {
  switch (shape) {
    case EntityShape::triangle:
    case EntityShape::tet: return m.i + m.j + m.k + 1;
    case EntityShape::prism: return std::max(m.i + m.j, m.k) + 1;
    default: return std::max({m.i, m.j, m.k}) + 1;
  }
}

std::size_t first_node(const ElementSpace& space, int kind, std::size_t entity) {
  return kind == 0 ? space.edge_nodes(entity) : kind == 1 ? space.face_nodes(entity) : space.cell_nodes(entity);
}

}  // namespace

double EntityValues::sum() const {
  double total = 0;
  for (const auto* part : {&edges, &faces, &cells}) total = std::accumulate(part->begin(), part->end(), total);
  return total;
}

EntityOrders next_orders(const EntityOrders& orders, int max_order) {
  return {next_orders(orders.edges, max_order), next_orders(orders.faces, max_order),
          next_orders(orders.cells, max_order)};
}

EntityValues order_gains(FitProblem& problem, const ElementSpace& raised, const EntityOrders& now,
                         std::span<const Vec3> coefficients) {
  const MeshTopology& mesh = raised.topology();
  EntityValues gains{std::vector<double>(mesh.num_edges()), std::vector<double>(mesh.num_faces()),
                     std::vector<double>(mesh.num_cells())};
  const std::size_t n = coefficients.size();
  std::vector<Vec3> samples(problem.samples.num_rows()), sample_gradient(samples.size(), Vec3::Zero()),
      gradient(n, Vec3::Zero()), from_samples(n);
  std::vector<Mat3> diagonal(n, Mat3::Zero());
  problem.apply_samples(coefficients, samples);
  problem.surface->assign(samples);
  if (!std::isfinite(problem.volume->linearize(coefficients, problem.lambda, gradient))) return gains;
  problem.surface->add_gradient(samples, sample_gradient);
  problem.pull_back_samples(sample_gradient, from_samples);
  add_scaled(1, from_samples, gradient);
  problem.volume->add_diagonal_blocks(problem.nodes, problem.nodes_transposed, diagonal);
  add_diagonal_blocks(problem.samples, problem.samples_transposed, problem.surface->hessian(), diagonal);

  for_each_entity(raised, [&](int kind, std::size_t entity, EntityShape shape) {
    std::size_t node = first_node(raised, kind, entity);
    for_each_mode(shape, entities(raised.orders(), kind)[entity], [&](ModeIndex m) {
      const std::size_t at = node++;
      if (first_order(shape, m) <= entities(now, kind)[entity] || !(diagonal[at].trace() > 0)) return;
      entities(gains, kind)[entity] += 0.5 * gradient[at].dot(diagonal[at].inverse() * gradient[at]);
    });
  });
  return gains;
}

EntityOrders raised_where_it_pays(const ElementSpace& space, const EntityOrders& next, const EntityValues& gains,
                                  double share) {
  struct Candidate {
    double per_node, gain;
    int kind;
    std::size_t entity;
  };
  std::vector<Candidate> candidates;
  for_each_entity(space, [&](int kind, std::size_t entity, EntityShape shape) {
    const int more =
        num_modes(shape, entities(next, kind)[entity]) - num_modes(shape, entities(space.orders(), kind)[entity]);
    const double gain = entities(gains, kind)[entity];
    if (more == 0 || !(gain > 0)) return;
    candidates.push_back({gain / more, gain, kind, entity});
  });
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.per_node > b.per_node; });
  EntityOrders orders = space.orders();
  double held = 0;
  const double total_gain = gains.sum();
  for (const Candidate& c : candidates) {
    if (held >= share * total_gain) break;
    entities(orders, c.kind)[c.entity] = entities(next, c.kind)[c.entity];
    held += c.gain;
  }
  orders.raise_borders(space.topology());
  return orders;
}

}  // namespace subvol::internal
