// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/element_space.h"
#include "fit/solver/fit_problem.h"

#include <span>
#include <vector>

namespace subvol {

/// A number for every edge, face and cell.
struct EntityValues {
  std::vector<double> edges, faces, cells;

  double sum() const;
};

/// The orders that entities would have after one raise: half as high again (1, 2, 3, 4, 6, 9, ...), at most max_order.
/// The rule of `EntityOrders` goes on holding.
EntityOrders next_orders(const EntityOrders& orders, int max_order);

/// By how much the energy would fall if an entity alone were given the modes that `raised` has and `now` has not:
///
///   gain = 1/2 sum_m g_m . D_m^-1 g_m
///
/// over its new modes m, with g the gradient of E where they are zero and D the 3x3 diagonal blocks of its clamped
/// second derivative: one step of Newton's method with the new modes uncoupled, which those of the Fourier basis nearly
/// are.
///
/// problem       E over the nodes of `raised`, an identity map of nodes.
/// coefficients  a mesh of orders `now`, its new modes being zero.
/// returns       per entity, >= 0; 0 without new modes. All zero where the state is infeasible at the raised
/// quadrature.
EntityValues order_gains(FitProblem& problem, const ElementSpace& raised, const EntityOrders& now,
                         std::span<const Vec3> coefficients);

/// Raises those entities to their next order that gain most for each new node, until they hold `share` of the sum of
/// all gains; then their borders, as the rule of `EntityOrders` asks.
///
/// share  in (0, 1].
EntityOrders raised_where_it_pays(const ElementSpace& space, const EntityOrders& next, const EntityValues& gains,
                                  double share);

}  // namespace subvol
