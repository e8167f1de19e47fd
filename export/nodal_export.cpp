// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/nodal_export.h"

#include "subvol/base/error.h"
#include "subvol/export/lagrange_mesh.h"
#include "subvol/fit/elements/basis.h"
#include "subvol/fit/elements/pattern_table.h"
#include "subvol/io/mfem_numbering.h"
#include "subvol/io/nodal_writers.h"
#include "subvol/io/node_points.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace subvol {

using namespace internal;
namespace {

NodalMesh equal_nodes(const HighOrderMesh& mesh, int order) {
  const LagrangeMesh grid = lagrange_mesh(mesh, std::vector<int>(mesh.space.num_cells(), order), NodeOrdering::vtk);
  NodalMesh result;
  result.positions = grid.positions;
  result.kinds = grid.kinds;
  result.orders = grid.orders;
  result.offsets = grid.cell_offsets;
  result.nodes = grid.cell_nodes;
  return result;
}

NodalMesh lobatto_nodes(const HighOrderMesh& mesh, int order) {
  const VolumeMesh corners = mesh.straight_sided();
  MfemNodes nodes =
      number_mfem_nodes(corners.num_vertices(), corners.kinds, corners.cell_offsets, corners.cell_vertices, order);
  NodalMesh result;
  result.spacing = NodeSpacing::lobatto;
  result.kinds = corners.kinds;
  result.orders.assign(corners.num_cells(), order);
  result.positions.assign(nodes.count, Vec3::Zero());
  std::copy(corners.positions.begin(), corners.positions.end(), result.positions.begin());
  const auto by_pattern = cells_by_pattern(mesh.space);
  std::vector<Vec3> x;
  for (std::size_t pattern = 0; pattern < by_pattern.size(); ++pattern) {
    if (by_pattern[pattern].empty()) continue;
    const PatternTable table(
        mesh.space, pattern,
        node_points(mesh.space.pattern_kind(pattern), order, NodeOrdering::vtk, NodeSpacing::lobatto));
    x.resize(table.num_points());
    for (const Index c : by_pattern[pattern]) {
      table.positions(mesh, static_cast<std::size_t>(c), x);
      for (std::size_t q = 0; q < x.size(); ++q) {
        const auto node = static_cast<std::size_t>(nodes.nodes[nodes.offsets[static_cast<std::size_t>(c)] + q]);
        if (node >= corners.num_vertices()) result.positions[node] = x[q];
      }
    }
  }
  result.offsets = std::move(nodes.offsets);
  result.nodes = std::move(nodes.nodes);
  return result;
}

/// The largest value of the mode of order 2 of an edge: that in its middle.
double largest_edge_mode() {
  std::array<double, kMaxOrder + 1> values, derivatives;
  line_functions(Basis::legendre, 2, 0.5, values.data(), derivatives.data());
  return std::abs(values[2]);
}

bool is_exodus(const std::string& extension) { return extension == ".e" || extension == ".exo"; }

}  // namespace

bool is_nodal_output(const std::string& extension) {
  return extension == ".inp" || extension == ".bdf" || extension == ".mfem" || is_exodus(extension) ||
         extension == ".xdmf";
}

std::string nodal_text(const std::string& extension, const NodalMesh& mesh) {
  if (extension == ".inp") return inp_text(mesh);
  if (extension == ".bdf") return nastran_text(mesh);
  if (extension == ".mfem") return mfem_text(mesh);
  if (extension == ".xdmf") return xdmf_text(mesh);
  if (is_exodus(extension)) return exodus_bytes(mesh);
  throw InputError("nodal_text: expected the extension .inp, .bdf, .mfem, .e, .exo or .xdmf, found " + extension);
}

PolynomialMap edge_cells(PolynomialMap map) {
  const ElementSpace& space = map.mesh.space;
  const double m = largest_edge_mode();
  double largest = 0;
  const auto sum_of = [&](std::size_t first, std::size_t end, double factor) {
    double sum = 0;
    for (std::size_t n = first; n < end; ++n) sum += factor * map.mesh.coefficients[n].norm();
    return sum;
  };
  for (std::size_t c = 0; c < space.num_cells(); ++c) {
    double sum = sum_of(space.cell_nodes(c), space.cell_nodes(c + 1), m * m * m);
    for (const Index f : space.topology().cell_faces(c))
      sum += sum_of(space.face_nodes(static_cast<std::size_t>(f)), space.face_nodes(static_cast<std::size_t>(f) + 1),
                    m * m);
    largest = std::max(largest, sum);
  }
  EntityOrders orders = space.orders();
  std::fill(orders.faces.begin(), orders.faces.end(), 1);
  std::fill(orders.cells.begin(), orders.cells.end(), 1);
  return {map.mesh.with_orders(orders), map.distance_bound + largest};
}

NodalMesh nodal_cells(const HighOrderMesh& mesh, const std::string& extension) {
  const int order = mesh.space.max_order();
  return extension == ".mfem" ? lobatto_nodes(mesh, order) : equal_nodes(mesh, std::min(order, 2));
}

}  // namespace subvol
