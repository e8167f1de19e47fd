// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/validate.h"

#include "subvol/base/error.h"
#include "subvol/mesh/cell_checks.h"
#include "subvol/mesh/face_checks.h"
#include "subvol/mesh/mesh_defects.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/tag_checks.h"

namespace subvol {

using namespace internal;

std::vector<MeshDefect> validate(const VolumeMesh& mesh) {
  DefectList defects;
  if (check_array_sizes(mesh, defects) && check_vertex_numbers(mesh, defects)) {
    check_positions(mesh, defects);
    if (check_cell_vertices(mesh, defects) && check_shared_faces(mesh, defects)) {
      const MeshTopology topology(mesh);
      check_conformity(mesh, topology, defects);
      check_boundary_is_manifold(topology, defects);
      check_orientation(mesh, topology, defects);
      check_tag_places(mesh, topology, defects);
    }
    check_jacobians(mesh, defects);
    check_tag_values(mesh, defects);
    check_unused_vertices(mesh, defects);
  }
  return defects.take_by_kind();
}

void require_valid(const VolumeMesh& mesh, const std::string& what, InvertedCells inverted) {
  using Kind = MeshDefect::Kind;
  for (const MeshDefect& defect : validate(mesh)) {
    const bool is_allowed = defect.kind == Kind::unused_vertex ||
                            (defect.kind == Kind::inverted_cell && inverted == InvertedCells::allowed);
    if (!is_allowed) throw InputError(what + ": " + defect.message);
  }
}

void require_groups(const VolumeFaceGroups& groups, const std::string& what) {
  for (const GroupedFace& entry : groups.faces)
    if (entry.group < 0 || static_cast<std::size_t>(entry.group) >= groups.groups.size())
      throw InputError(what + ": a face is in group " + std::to_string(entry.group) + " of " +
                       std::to_string(groups.groups.size()));
}

const char* to_string(MeshDefect::Kind kind) {
  using Kind = MeshDefect::Kind;
  switch (kind) {
    case Kind::no_cells: return "no_cells";
    case Kind::size_mismatch: return "size_mismatch";
    case Kind::index_out_of_range: return "index_out_of_range";
    case Kind::not_finite: return "not_finite";
    case Kind::repeated_vertex: return "repeated_vertex";
    case Kind::duplicate_cell: return "duplicate_cell";
    case Kind::face_of_many_cells: return "face_of_many_cells";
    case Kind::nonconforming_face: return "nonconforming_face";
    case Kind::nonmanifold_edge: return "nonmanifold_edge";
    case Kind::nonmanifold_vertex: return "nonmanifold_vertex";
    case Kind::inconsistent_orientation: return "inconsistent_orientation";
    case Kind::inverted_cell: return "inverted_cell";
    case Kind::bad_tag: return "bad_tag";
    case Kind::unused_vertex: return "unused_vertex";
  }
  return "unknown";
}

}  // namespace subvol
