// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/curved_file.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/export/lagrange_cells.h"
#include "subvol/export/lagrange_mesh.h"
#include "subvol/export/text_format.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"

#include <algorithm>
#include <utility>

namespace subvol {

using namespace internal;
namespace {

CellView view_of(const NodalMesh& mesh) {
  return {mesh.positions, mesh.kinds, mesh.orders, mesh.offsets, mesh.nodes, {}};
}

void require_sound(const std::string& name, const VolumeMesh& corners) {
  for (const MeshDefect& defect : validate(corners))
    if (defect.kind != MeshDefect::Kind::inverted_cell && defect.kind != MeshDefect::Kind::unused_vertex)
      throw InputError(name + ": " + defect.message + " (" + to_string(defect.kind) + ")");
}

/// Gives all cells the largest order: the same polynomials with more nodes, which each cell has for itself, except for
/// its corners.
NodalMesh with_one_order(NodalMesh mesh, int order) {
  if (std::all_of(mesh.orders.begin(), mesh.orders.end(), [&](int p) { return p == order; })) return mesh;
  const HighOrderMesh cells = polynomials_of(view_of(mesh), NodeOrdering::vtk, mesh.spacing);
  const LagrangeMesh grid = lagrange_mesh(cells, std::vector<int>(mesh.num_cells(), order), NodeOrdering::vtk);
  const auto first = static_cast<Index>(mesh.positions.size());
  std::vector<Index> nodes;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto corners = static_cast<std::size_t>(cell_topology(mesh.kinds[c]).num_vertices);
    for (std::size_t i = 0; i < grid.cell(c).size(); ++i)
      nodes.push_back(i < corners ? mesh.cell(c)[i] : first + grid.cell(c)[i]);
  }
  mesh.positions.insert(mesh.positions.end(), grid.positions.begin(), grid.positions.end());
  mesh.nodes = std::move(nodes);
  mesh.offsets = grid.cell_offsets;
  mesh.orders.assign(mesh.num_cells(), order);
  mesh.spacing = NodeSpacing::equal;
  return mesh;
}

}  // namespace

bool holds_exact_map(const std::filesystem::path& path) {
  if (lower_case_extension(path) != ".vtu") return false;
  const std::string bytes = read_file(path);
  const std::size_t begin = bytes.find("<VTKFile"), end = bytes.find('>', begin);
  if (end == std::string::npos || bytes.find("Name=\"subvol_format\"") == std::string::npos) return false;
  const std::string_view tag = std::string_view(bytes).substr(begin, end - begin);
  const auto has = [&](std::string_view text) { return tag.find(text) != std::string_view::npos; };
  return has("version=\"2.2\"") && has("\"LittleEndian\"") && has("\"UInt64\"") && !has("compressor");
}

HighOrderFile curved_mesh(const std::string& name, NodalMesh mesh, std::vector<std::string>* warnings) {
  turn_over_mirrored(mesh);
  if (warnings)
    for (const std::string& warning : mesh.warnings) warnings->push_back(name + ": " + warning);
  const int order = mesh.max_order();
  if (order > kMaxOrder)
    throw InputError(name + ": cells of order " + std::to_string(order) + ", expected at most " +
                     std::to_string(kMaxOrder));
  std::vector<Index> number;
  const VolumeMesh corners = corner_mesh(mesh, false, number);
  require_sound(name, corners);
  std::vector<int> references = std::move(mesh.references);
  VolumeFaceGroups face_groups = renumbered(mesh.face_groups, number);
  if (const std::size_t given = mesh.face_groups.faces.size(); given > 0) {
    face_groups = groups_of_faces(face_groups, MeshTopology(corners));
    if (const std::size_t lone = given - face_groups.faces.size(); lone > 0 && warnings)
      warnings->push_back(name + ": " + std::to_string(lone) + " faces with a group are faces of no cell: dropped");
    if (face_groups.faces.empty()) face_groups = {};
  }
  std::vector<Group> regions = std::move(mesh.regions);
  try {
    const NodalMesh cells = with_one_order(std::move(mesh), order);
    return {joined_polynomials(view_of(cells), corners, order, NodeOrdering::vtk, cells.spacing), std::move(references),
            std::move(face_groups), std::move(regions)};
  } catch (const InputError& error) {
    throw InputError(name + ": " + error.what());
  }
}

HighOrderFile read_curved(const std::filesystem::path& path, std::vector<std::string>* warnings,
                          const std::string& references) {
  if (holds_exact_map(path)) return read_high_order(path);
  return curved_mesh(path.string(), read_nodal_mesh(path, references), warnings);
}

}  // namespace subvol
