// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/element_space.h"
#include "subvol/fit/solver/fit_problem.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// A number for every edge, face and cell.
struct EntityValues {
  std::vector<double> edges, faces, cells;

  double sum() const;
};

/// Returns the orders of all entities after one raise: half as high again (1, 2, 3, 4, 6, 9, ...), at most max_order.
/// The result still satisfies the rule of `EntityOrders`.
EntityOrders next_orders(const EntityOrders& orders, int max_order);

/// Estimates for each entity by how much the energy would fall if this entity alone got the modes that `raised` has and
/// `now` lacks:
///
///   gain = 1/2 sum_m g_m . D_m^-1 g_m
///
/// The sum runs over the entity's new modes m, g is the gradient of E with the new modes at zero, and D_m are the 3x3
/// diagonal blocks of the clamped second derivative. This is one Newton step with the new modes uncoupled, which those
/// of the Fourier basis nearly are.
///
/// problem       E over the nodes of `raised`; its node map is the identity.
/// coefficients  of a mesh with the orders `now`; the new modes are zero.
/// returns       per entity, >= 0; 0 without new modes. All zero if the state is infeasible at the raised quadrature.
EntityValues order_gains(FitProblem& problem, const ElementSpace& raised, const EntityOrders& now,
                         std::span<const Vec3> coefficients);

/// Raises the entities with the largest gain per new node to their next order, until those raised hold `share` of the
/// sum of all gains; then raises their borders as the rule of `EntityOrders` requires.
///
/// share  in (0, 1].
EntityOrders raised_where_it_pays(const ElementSpace& space, const EntityOrders& next, const EntityValues& gains,
                                  double share);

}  // namespace subvol::internal
