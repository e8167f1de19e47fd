// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/format.h"
#include "subvol/base/text_scanner.h"
#include "subvol/export/nodal_export.h"
#include "subvol/export/text_format.h"
#include "subvol/export/written_file.h"
#include "subvol/io/nodal_sides.h"
#include "subvol/io/nodal_writers.h"

#include <Eigen/Geometry>

#include <unordered_map>

namespace subvol::internal {
namespace {

/// Checks that numbers of a file stand for those of a mesh, one for one.
class OneForOne {
 public:
  /// Returns false if one of them stands for another one already.
  bool matches(std::int64_t found, std::int64_t wanted) {
    return wanted_.try_emplace(found, wanted).first->second == wanted &&
           found_.try_emplace(wanted, found).first->second == found;
  }

 private:
  std::unordered_map<std::int64_t, std::int64_t> wanted_, found_;
};

/// Compares the nodes of a cell: corners of any format, and middles of edges of those that list them alike. A format of
/// few digits may move a node by a millionth of the cell.
void compare_nodes(const WrittenFile& file, bool is_rounded, std::span<const Vec3> found, std::span<const Vec3> wanted,
                   std::size_t c) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : wanted) box.extend(p);
  const double extent = box.sizes().maxCoeff();
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const double error = (found[i] - wanted[i]).cwiseAbs().maxCoeff();
    if (error <= (is_rounded ? kMostReadBackErrorShare * extent : 0)) continue;
    const std::string cell = "the corners of cell " + std::to_string(c);
    if (!is_rounded) file.differs(cell);
    file.differs(
        cell + formatted(" are moved by %.3g, and the cell is %.3g wide: ", error, extent) +
        "its coordinates need more digits than this format has; move the mesh to the origin, or take .msh, .vtu "
        "or .mesh");
  }
}

}  // namespace

void compare_nodal(const WrittenFile& file, const NodalMesh& wanted) {
  const std::string extension = lower_case_extension(file.path());
  const std::string text = read_file(file.path());
  if (text != nodal_text(extension, wanted)) file.differs("its text is not what was written");
  if (!is_nodal_extension(file.path())) return;
  const NodalMesh found = read_nodal_mesh(file.path());
  file.same_count("cells", found.num_cells(), wanted.num_cells());
  const bool is_by_block = extension == ".e" || extension == ".exo";
  const bool is_rounded = extension == ".bdf" || extension == ".inp";
  const std::vector<std::size_t> order =
      is_by_block ? exodus_order(wanted) : sorted_cells(wanted.num_cells(), [](std::size_t) { return 0; });
  OneForOne nodes, references;
  std::vector<Vec3> places, wanted_places;
  for (std::size_t n = 0; n < wanted.num_cells(); ++n) {
    const std::size_t c = order[n];
    const CellKind kind = wanted.kinds[c];
    file.same(found.kinds[n] == kind && found.orders[n] == wanted.orders[c], "the kind of cell", c);
    file.same(references.matches(reference_of(found, n), reference_of(wanted, c)), "the reference of cell", c);
    const auto cell = found.cell(n), wanted_cell = wanted.cell(c);
    places.clear();
    wanted_places.clear();
    const auto num_compared = extension == ".mfem" ? num_corners(kind) : num_edge_nodes(kind, wanted.orders[c]);
    for (std::size_t i = 0; i < num_compared; ++i) {
      file.same(nodes.matches(cell[i], wanted_cell[i]), "the nodes of cell", c);
      places.push_back(found.positions[static_cast<std::size_t>(cell[i])]);
      wanted_places.push_back(wanted.positions[static_cast<std::size_t>(wanted_cell[i])]);
    }
    compare_nodes(file, is_rounded, places, wanted_places, c);
  }
}

}  // namespace subvol::internal
