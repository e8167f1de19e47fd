// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/nodal_mesh.h"

#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/file_formats.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_formats.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace subvol {

using namespace internal;

namespace fs = std::filesystem;

namespace {

struct NodalFormat {
  const char* extension;
  NodalMesh (*parse)(const std::string& name, std::string_view bytes, const std::string& references);
};

constexpr NodalFormat kNodalFormats[] = {
    {".msh", parse_msh},     {".vtu", parse_vtu},     {".vtk", parse_nodal_vtk}, {".inp", parse_inp},
    {".bdf", parse_nastran}, {".nas", parse_nastran}, {".fem", parse_nastran},   {".mfem", parse_mfem},
    {".mesh", parse_mfem},   {".e", parse_exodus},    {".exo", parse_exodus},    {".ex2", parse_exodus},
    {".gen", parse_exodus},  {".cgns", parse_cgns},
};

const NodalFormat* nodal_format(const fs::path& path) {
  const std::string extension = lower_case(path.extension().string());
  const auto found = std::find_if(std::begin(kNodalFormats), std::end(kNodalFormats),
                                  [&](const NodalFormat& format) { return extension == format.extension; });
  return found == std::end(kNodalFormats) ? nullptr : found;
}

/// True if the straight-sided cell is left-handed at every corner.
bool is_left_handed(const NodalMesh& mesh, std::size_t c) {
  const CellTopology& topology = cell_topology(mesh.kinds[c]);
  const auto cell = mesh.cell(c);
  for (int i = 0; i < topology.num_trivalent; ++i) {
    const auto& n = topology.corner_neighbors[i];
    const auto edge = [&](int k) -> Vec3 { return mesh.positions[cell[n[k]]] - mesh.positions[cell[i]]; };
    if (!(edge(0).cross(edge(1)).dot(edge(2)) < 0)) return false;
  }
  return true;
}

/// Numbers of nodes of cells of order 2 that lack some (`NodalCells`).
constexpr std::size_t kStraightPrism = 12, kHexWithSides = 24;

}  // namespace

std::vector<int> internal::mirrored_places(CellKind kind, int order) {
  const auto lattice = cell_lattice(kind, order, NodeOrdering::vtk);
  std::map<std::array<int, 3>, int> place;
  for (std::size_t i = 0; i < lattice.size(); ++i) place[key_of(lattice[i])] = static_cast<int>(i);
  std::vector<int> mirrored;
  for (const LatticePoint& at : lattice) mirrored.push_back(place.at({at[1], at[0], at[2]}));
  return mirrored;
}

int NodalMesh::max_order() const { return orders.empty() ? 1 : *std::max_element(orders.begin(), orders.end()); }

bool NodalCells::is_size(CellKind kind, int order, std::size_t num_nodes) {
  if (num_nodes == num_lattice_points(kind, order)) return true;
  return order == 2 && ((kind == CellKind::hex && num_nodes == 20) || (kind == CellKind::prism && num_nodes == 15));
}

const std::vector<int>& NodalCells::places(CellKind kind, int order, NodeOrdering ordering) {
  std::vector<int>& result = places_[{kind, order, ordering}];
  if (!result.empty()) return result;
  std::map<std::array<int, 3>, int> place;
  int n = 0;
  for (const LatticePoint& at : cell_lattice(kind, order, ordering)) place[key_of(at)] = n++;
  for (const LatticePoint& at : cell_lattice(kind, order, NodeOrdering::vtk)) result.push_back(place.at(key_of(at)));
  return result;
}

void NodalCells::add(CellKind kind, int order, NodeOrdering ordering, std::span<const Index> nodes) {
  assert(is_size(kind, order, nodes.size()) || (order == 2 && ordering == NodeOrdering::vtk &&
                                                ((kind == CellKind::hex && nodes.size() == kHexWithSides) ||
                                                 (kind == CellKind::prism && nodes.size() == kStraightPrism))));
  std::vector<Index> cell;
  for (const int place : places(kind, order, ordering))
    if (static_cast<std::size_t>(place) < nodes.size()) cell.push_back(nodes[static_cast<std::size_t>(place)]);
  if (cell.size() < num_lattice_points(kind, order)) complete(kind, cell);
  mesh_.kinds.push_back(kind);
  mesh_.orders.push_back(order);
  mesh_.nodes.insert(mesh_.nodes.end(), cell.begin(), cell.end());
  mesh_.offsets.push_back(mesh_.nodes.size());
}

/// Adds a node at a sum of others, taken in ascending order so that all cells around it would get the same bits.
Index NodalCells::center(std::span<const Index> corners, std::span<const Index> middles, double corner_weight,
                         double middle_weight) {
  const auto sum = [&](std::span<const Index> nodes) {
    std::vector<Index> sorted(nodes.begin(), nodes.end());
    std::sort(sorted.begin(), sorted.end());
    Vec3 total = Vec3::Zero();
    for (const Index node : sorted) total += mesh_.positions[node];
    return total;
  };
  mesh_.positions.push_back(corner_weight * sum(corners) + middle_weight * sum(middles));
  return static_cast<Index>(mesh_.positions.size() - 1);
}

/// The same, once for all cells with these corners of an edge or a face.
Index NodalCells::shared_center(std::span<const Index> corners, std::span<const Index> middles, double corner_weight,
                                double middle_weight) {
  const auto [known, is_new] = centers_.try_emplace(face_key(corners), kNoIndex);
  if (is_new) known->second = center(corners, middles, corner_weight, middle_weight);
  return known->second;
}

// VTK lists the nodes of a cell of order 2 by corners, edges, faces with an inside, and the inside of a hex.
void NodalCells::complete(CellKind kind, std::vector<Index>& nodes) {
  const std::vector<LatticePoint> lattice = cell_lattice(kind, 2, NodeOrdering::vtk);
  const auto corners = static_cast<std::size_t>(cell_topology(kind).num_vertices);
  if (kind == CellKind::prism && nodes.size() == kStraightPrism)
    for (const Index v : {0, 1, 2})
      nodes.push_back(shared_center(std::array{nodes[v], nodes[v + 3]}, std::span<const Index>(), 0.5, 0));
  const std::size_t given = nodes.size();
  for (std::size_t q = given; q < lattice.size(); ++q) {
    const LatticePoint& at = lattice[q];
    std::vector<Index> face_corners, middles;
    const auto same_face = [&](const LatticePoint& other) {  // around the middle of a quad, or of a hex
      if (kind == CellKind::hex)
        return (at[0] == 1 || other[0] == at[0]) && (at[1] == 1 || other[1] == at[1]) &&
               (at[2] == 1 || other[2] == at[2]);
      return at[0] == 0 ? other[0] == 0 : at[1] == 0 ? other[1] == 0 : other[0] + other[1] == 2;
    };
    for (std::size_t i = 0; i < given; ++i)
      if (same_face(lattice[i])) (i < corners ? face_corners : middles).push_back(nodes[i]);
    if (face_corners.size() == 4) {
      nodes.push_back(shared_center(face_corners, middles, -0.25, 0.5));
    } else if (given == kHexWithSides) {  // the middle of the quad through the middles of the upright edges and sides
      const std::span<const Index> upright = std::span(nodes).subspan(16, 4), sides = std::span(nodes).subspan(20, 4);
      nodes.push_back(center(upright, sides, -0.25, 0.5));
    } else {
      nodes.push_back(center(face_corners, middles, -0.25, 0.25));  // 8 corners and 12 edges of a hex
    }
  }
}

bool is_nodal_extension(const fs::path& path) {
  const FileFormat* format = format_of_path(path);
  return format && format->holds_cells && !format->read.empty();
}

NodalMesh internal::parse_nodal(const fs::path& path, std::string_view bytes, const std::string& references) {
  const NodalFormat* format = nodal_format(path);
  if (!format)
    throw InputError(path.string() + ": " + unknown_extension(path) + "; expected cells: " + readable_formats(true));
  const bool is_gmsh_mesh = format->parse == parse_mfem && is_gmsh(bytes);
  NodalMesh mesh = (is_gmsh_mesh ? parse_msh : format->parse)(path.string(), bytes, references);
  if (std::all_of(mesh.references.begin(), mesh.references.end(), [](int r) { return r == 0; }))
    mesh.references.clear();
  normalize(mesh.face_groups);
  for (auto* groups : {&mesh.face_groups.groups, &mesh.regions, &mesh.shells.face_groups.groups})
    make_names_utf8(*groups);
  if (mesh.max_order() > 1 && std::ranges::find(mesh.kinds, CellKind::pyramid) != mesh.kinds.end())
    throw InputError(path.string() + ": curved cells beside pyramids: " + kNoCurvedPyramids);
  return mesh;
}

void internal::fail_without_cells(const std::string& name, const std::vector<std::string>& warnings) {
  constexpr std::string_view kKnown = "in the file, but ";  // is said already
  std::string found;
  for (const std::string& warning : warnings)
    found += "; " + (warning.starts_with(kKnown) ? warning.substr(kKnown.size()) : warning);
  throw InputError(name + ": no hexes, prisms, tets or pyramids in the file" + found);
}

NodalMesh read_nodal_mesh(const fs::path& path, const std::string& references) {
  NodalMesh mesh = parse_nodal(path, read_file(path), references);
  if (mesh.num_cells() == 0) fail_without_cells(path.string(), mesh.warnings);
  return mesh;
}

VolumeMesh linear_mesh(const std::string& name, NodalMesh mesh) {
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (mesh.orders[c] > 1)
      throw InputError(name + ": cell " + std::to_string(c) + " has order " + std::to_string(mesh.orders[c]) +
                       ": curved cells, which `check` and `convert` read, but linear cells are wanted");
  VolumeMesh linear;
  linear.positions = std::move(mesh.positions);
  linear.kinds = std::move(mesh.kinds);
  linear.cell_offsets = std::move(mesh.offsets);
  linear.cell_vertices = std::move(mesh.nodes);
  linear.references = std::move(mesh.references);
  linear.face_groups = std::move(mesh.face_groups);
  linear.regions = std::move(mesh.regions);
  return linear;
}

VolumeMesh corner_mesh(const NodalMesh& mesh, bool keeps_unused, std::vector<Index>& number) {
  number.assign(mesh.positions.size(), keeps_unused ? 0 : kNoIndex);
  const auto corners = [&](std::size_t c) {
    return mesh.cell(c).first(static_cast<std::size_t>(cell_topology(mesh.kinds[c]).num_vertices));
  };
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (const Index node : corners(c)) number[static_cast<std::size_t>(node)] = 0;
  VolumeMesh result;
  for (std::size_t n = 0; n < number.size(); ++n) {
    if (number[n] == kNoIndex) continue;
    number[n] = static_cast<Index>(result.positions.size());
    result.positions.push_back(mesh.positions[n]);
  }
  std::vector<Index> cell;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    cell.clear();
    for (const Index node : corners(c)) cell.push_back(number[static_cast<std::size_t>(node)]);
    result.add_cell(mesh.kinds[c], cell);
  }
  return result;
}

void turn_over_mirrored(NodalMesh& mesh) {
  std::size_t num_mirrored = 0, num_prisms = 0, num_mirrored_prisms = 0;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const bool is_prism = mesh.kinds[c] == CellKind::prism, is_mirrored = is_left_handed(mesh, c);
    num_mirrored += is_mirrored;
    num_prisms += is_prism;
    num_mirrored_prisms += is_prism && is_mirrored;
  }
  const bool all = num_mirrored == mesh.num_cells();
  if (!all && (num_prisms == 0 || num_mirrored_prisms < num_prisms)) return;
  std::map<std::pair<CellKind, int>, std::vector<int>> places;
  std::vector<Index> old;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (!all && mesh.kinds[c] != CellKind::prism) continue;
    std::vector<int>& turned = places[{mesh.kinds[c], mesh.orders[c]}];
    if (turned.empty()) turned = mirrored_places(mesh.kinds[c], mesh.orders[c]);
    old.assign(mesh.cell(c).begin(), mesh.cell(c).end());
    for (std::size_t i = 0; i < old.size(); ++i)
      mesh.nodes[mesh.offsets[c] + i] = old[static_cast<std::size_t>(turned[i])];
  }
  mesh.warnings.push_back((all ? "all " : "all prisms, ") + std::to_string(all ? num_mirrored : num_prisms) +
                          " cells are left-handed at every corner, as of a mirrored mesh or of other numbering: their "
                          "nodes are numbered anew");
}

}  // namespace subvol
