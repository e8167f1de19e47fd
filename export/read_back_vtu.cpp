// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/text_scanner.h"
#include "subvol/export/vtu_reader.h"
#include "subvol/export/written_file.h"

#include <algorithm>

namespace subvol::internal {

void compare_vtu(const WrittenFile& file, const CellView& wanted) {
  const std::string bytes = read_file(file.path());
  const VtuArrays arrays(file.path().string(), bytes, wanted.orders.empty() ? "1.0" : "2.2");
  const auto points = arrays.get<double>("Points");
  const auto nodes = arrays.get<std::int64_t>("connectivity"), ends = arrays.get<std::int64_t>("offsets");
  const auto types = arrays.get<std::uint8_t>("types");
  file.same_count("coordinates", points.size(), 3 * wanted.positions.size());
  file.same_count("cells", types.size(), wanted.num_cells());
  file.same_count("ends of cells", ends.size(), wanted.num_cells());
  file.same_count("nodes of cells", nodes.size(), wanted.nodes.size());
  for (std::size_t v = 0; v < wanted.positions.size(); ++v)
    file.same(std::equal(wanted.positions[v].begin(), wanted.positions[v].end(), &points[3 * v]), "point", v);
  for (std::size_t c = 0; c < wanted.num_cells(); ++c) {
    const bool is_linear = wanted.orders.empty();
    const CellKind kind = wanted.kinds[c];
    file.same(types[c] == (is_linear ? vtk_linear_type(kind) : vtk_type(kind, wanted.has_control_points)),
              "the kind of cell", c);
    file.same(ends[c] == static_cast<std::int64_t>(wanted.offsets[c + 1]), "the end of cell", c);
    std::vector<std::int64_t> cell(wanted.cell(c).begin(), wanted.cell(c).end());
    if (is_linear && wanted.kinds[c] == CellKind::prism) turn_wedge(cell.data());
    file.same(std::equal(cell.begin(), cell.end(), nodes.begin() + static_cast<std::ptrdiff_t>(wanted.offsets[c])),
              "the nodes of cell", c);
  }
  if (wanted.references.empty()) return;
  const auto references = arrays.get<std::int32_t>("reference");
  file.same(std::ranges::equal(references, wanted.references), "references of cells, all", references.size());
}

void compare_map(const WrittenFile& file, const HighOrderMesh& wanted, const HighOrderFileOptions& options) {
  const HighOrderFile found = read_high_order(file.path());
  const std::span<const int> references = options.references;
  if (options.face_groups)
    file.same(found.face_groups.faces == options.face_groups->faces, "the groups of faces, all",
              options.face_groups->faces.size());
  file.same_count("nodes", found.mesh.space.num_nodes(), wanted.space.num_nodes());
  file.same(found.mesh.space.basis() == wanted.space.basis(), "the basis of all cells,", wanted.space.num_cells());
  const EntityOrders &orders = found.mesh.space.orders(), &orders_wanted = wanted.space.orders();
  file.same(
      orders.edges == orders_wanted.edges && orders.faces == orders_wanted.faces && orders.cells == orders_wanted.cells,
      "the orders of all cells,", wanted.space.num_cells());
  for (std::size_t i = 0; i < wanted.coefficients.size(); ++i)
    file.same(found.mesh.coefficients[i] == wanted.coefficients[i], "the coefficient of node", i);
  for (std::size_t c = 0; c < wanted.space.num_cells(); ++c)
    file.same(reference_of(found.references, c) == reference_of(references, c), "the reference of cell", c);
}

}  // namespace subvol::internal
