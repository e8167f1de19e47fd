// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/mesh_io.h"

#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/file_formats.h"
#include "subvol/io/mesh_formats.h"
#include "subvol/io/nodal_formats.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"

#include <Eigen/Geometry>

#include <algorithm>

namespace subvol {

using namespace internal;

namespace fs = std::filesystem;

namespace {

bool is_warning(const MeshDefect& defect) {
  return defect.kind == MeshDefect::Kind::inverted_cell || defect.kind == MeshDefect::Kind::unused_vertex;
}

/// Drops tags off the boundary and off interfaces between regions: other programs also mark edges between subdomains.
/// Returns the number of dropped tags.
std::size_t drop_inner_tags(VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  const InterfaceMarks interfaces = mark_interfaces(topology, find_interfaces(mesh, topology));
  const std::size_t dropped_edges = std::erase_if(mesh.tags.creases, [&](const CreaseEdge& crease) {
    const Index e = topology.find_edge(crease.v0, crease.v1);
    return e == kNoIndex || (!topology.is_boundary_edge(e) && !interfaces.has_edge(e));
  });
  return dropped_edges + std::erase_if(mesh.tags.corners, [&](const CornerVertex& corner) {
           return !topology.is_boundary_vertex(corner.vertex) && !interfaces.has_vertex(corner.vertex);
         });
}

/// Drops grouped faces that are faces of no cell, with a warning, and groups that no face is left of.
void drop_lone_faces(ParsedMesh& parsed) {
  VolumeFaceGroups& groups = parsed.mesh.face_groups;
  if (groups.empty()) return;
  const std::size_t before = groups.faces.size();
  groups = groups_of_faces(groups, MeshTopology(parsed.mesh));
  if (const std::size_t n = before - groups.faces.size())
    parsed.warnings.push_back(std::to_string(n) + " faces with a group are faces of no cell: dropped");
  if (groups.faces.empty()) groups = {};
}

void warn_of(const std::vector<MeshDefect>& defects, MeshDefect::Kind kind, const std::string& what,
             std::vector<std::string>& warnings) {
  const auto is_kind = [&](const MeshDefect& defect) { return defect.kind == kind; };
  const auto n = std::count_if(defects.begin(), defects.end(), is_kind);
  if (n == 0) return;
  const auto first = std::find_if(defects.begin(), defects.end(), is_kind);
  warnings.push_back(std::to_string(n) + what + "; the first: " + first->message);
}

void check_mesh(const std::string& name, ParsedMesh& parsed) {
  std::vector<MeshDefect> defects = validate(parsed.mesh);
  const auto is_fatal = [](const MeshDefect& d) { return !is_warning(d) && d.kind != MeshDefect::Kind::bad_tag; };
  if (std::any_of(defects.begin(), defects.end(), is_fatal)) {
    constexpr int kMostNamedDefects = 20;
    std::string text;
    int named = 0, more = 0;
    for (const MeshDefect& defect : defects) {
      if (!is_fatal(defect)) continue;
      if (named == kMostNamedDefects) {
        ++more;
        continue;
      }
      text += (named++ ? "; " : "") + defect.message + " (" + to_string(defect.kind) + ")";
    }
    throw InputError(name + ": " + text + (more ? "; and " + std::to_string(more) + " more defects" : ""));
  }
  if (const std::size_t n = drop_inner_tags(parsed.mesh))
    parsed.warnings.push_back(std::to_string(n) + " tagged edges or corners are not on the boundary: dropped");
  drop_lone_faces(parsed);
  warn_of(defects, MeshDefect::Kind::inverted_cell,
          " of " + std::to_string(parsed.mesh.num_cells()) + " cells are flat or left-handed somewhere",
          parsed.warnings);
  warn_of(defects, MeshDefect::Kind::unused_vertex, " vertices belong to no cell", parsed.warnings);
}

/// Throws InputError if all vertices of the cells are in one place.
void require_extent(const std::string& name, const VolumeMesh& mesh) {
  const Vec3& first = mesh.positions[mesh.cell_vertices.front()];
  if (std::all_of(mesh.cell_vertices.begin(), mesh.cell_vertices.end(),
                  [&](Index v) { return mesh.positions[v] == first; }))
    throw InputError(name + ": all vertices of the cells are in one place");
}

/// Returns true if a cell's Jacobian determinant is negative at every corner.
bool is_left_handed(const VolumeMesh& mesh, std::size_t c) {
  const CellTopology& topology = cell_topology(mesh.kinds[c]);
  const auto cell = mesh.cell(c);
  for (int i = 0; i < topology.num_trivalent; ++i) {
    const auto& n = topology.corner_neighbors[i];
    const Vec3& x = mesh.positions[cell[i]];
    const Vec3 e0 = mesh.positions[cell[n[0]]] - x, e1 = mesh.positions[cell[n[1]]] - x,
               e2 = mesh.positions[cell[n[2]]] - x;
    if (!(e0.cross(e1).dot(e2) < 0)) return false;
  }
  return true;
}

/// Renumbers the corners of a cell so that its orientation is reversed.
void turn_over(VolumeMesh& mesh, std::size_t c) {
  const auto corner = [&](std::size_t i) -> Index& { return mesh.cell_vertices[mesh.cell_offsets[c] + i]; };
  switch (mesh.kinds[c]) {
    case CellKind::hex: std::swap(corner(5), corner(7)); [[fallthrough]];
    case CellKind::pyramid: std::swap(corner(1), corner(3)); break;
    case CellKind::prism: std::swap(corner(4), corner(5)); [[fallthrough]];
    case CellKind::tet: std::swap(corner(1), corner(2)); break;
  }
}

/// Renumbers the corners of all cells, or of all prisms, if each of them is left-handed at every corner: that is not
/// tangling, but a mirrored mesh or another numbering (programs number prisms in two ways). Prisms alone are left as
/// they are if the result has a defect that is more than a warning, such as two cells that see their common face from
/// the same side. Without `mend` nothing is renumbered, and there is only a warning.
void turn_over_mirrored(ParsedMesh& parsed, bool mend) {
  VolumeMesh& mesh = parsed.mesh;
  const auto all_mirrored = [&](bool only_prisms) {
    bool found = false;
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      if (only_prisms && mesh.kinds[c] != CellKind::prism) continue;
      if (!is_left_handed(mesh, c)) return false;
      found = true;
    }
    return found;
  };
  const bool all = all_mirrored(false);
  if (!all && !all_mirrored(true)) return;
  VolumeMesh turned = mesh;
  std::size_t count = 0;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (all || mesh.kinds[c] == CellKind::prism) turn_over(turned, c), ++count;
  const auto defects = validate(turned);
  if (!all && std::any_of(defects.begin(), defects.end(), [](const MeshDefect& d) { return !is_warning(d); })) return;
  if (mend) mesh = std::move(turned);
  parsed.warnings.push_back((all ? "all " : "all prisms, ") + std::to_string(count) +
                            " cells are left-handed at every corner, as of a mirrored mesh or of other numbering: "
                            "their corners " +
                            (mend ? "are" : "are not") + " numbered anew");
}

}  // namespace

FileCells read_cells(const fs::path& path, const ReadOptions& options) {
  const std::string name = path.string(), bytes = read_file(path);
  const bool is_medit = lower_case(path.extension().string()) == ".mesh" && !is_mfem(bytes) && !is_gmsh(bytes);
  ParsedMesh parsed;
  if (is_medit) {
    parsed = parse_medit(name, bytes, options.references);
  } else {
    NodalMesh mesh = parse_nodal(path, bytes, options.references);
    if (mesh.num_cells() == 0 && mesh.shells.num_faces() > 0) {
      mesh.shells.positions = std::move(mesh.positions);
      if (options.warnings)
        for (const std::string& warning : mesh.warnings) options.warnings->push_back(name + ": " + warning);
      return sound_polygons(std::move(mesh.shells), name, options.warnings);
    }
    if (mesh.num_cells() > 0 && mesh.max_order() > 1) return mesh;
    parsed.warnings = std::move(mesh.warnings);
    if (mesh.num_cells() > 0) parsed.mesh = linear_mesh(name, std::move(mesh));
  }
  if (parsed.mesh.num_cells() == 0) fail_without_cells(name, parsed.warnings);
  require_extent(name, parsed.mesh);
  turn_over_mirrored(parsed, options.check);
  if (options.check) check_mesh(name, parsed);
  if (const auto n = std::ranges::count(parsed.mesh.kinds, CellKind::pyramid); n > 0)
    parsed.warnings.push_back("pyramids, which cannot be subdivided or fitted: " + std::to_string(n));
  if (options.warnings)
    for (const std::string& warning : parsed.warnings) options.warnings->push_back(name + ": " + warning);
  return std::move(parsed.mesh);
}

VolumeMesh read_volume_mesh(const fs::path& path, const ReadOptions& options) {
  FileCells cells = read_cells(path, options);
  if (auto* mesh = std::get_if<VolumeMesh>(&cells)) return std::move(*mesh);
  if (auto* curved = std::get_if<NodalMesh>(&cells)) return linear_mesh(path.string(), std::move(*curved));
  throw InputError(path.string() + ": faces without cells: no hexes, prisms, tets or pyramids in the file");
}

void write_volume_mesh(const fs::path& path, const VolumeMesh& mesh) {
  const std::string extension = lower_case(path.extension().string());
  if (extension != ".mesh" && extension != ".vtk")
    throw InputError(path.string() + ": unknown volume mesh extension " + in_quotes(extension) +
                     ", expected the extension .mesh or .vtk");
  for (const MeshDefect& defect : validate(mesh))
    if (defect.kind <= MeshDefect::Kind::not_finite || defect.kind == MeshDefect::Kind::bad_tag)
      throw InputError("write_volume_mesh: " + defect.message);
  require_groups(mesh.face_groups, "write_volume_mesh");
  write_file_atomically(path, extension == ".mesh" ? format_medit(mesh) : format_legacy_vtk(mesh));
}

std::string volume_mesh_formats() { return readable_formats(true); }

}  // namespace subvol
