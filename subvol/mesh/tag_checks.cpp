// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/tag_checks.h"

#include "subvol/mesh/interfaces.h"

#include <array>

namespace subvol::internal {

namespace {

/// Returns true if a number is that of a vertex of the mesh.
bool names_vertex(const VolumeMesh& mesh, Index v) {
  return v >= 0 && static_cast<std::size_t>(v) < mesh.num_vertices();
}

}  // namespace

void check_tag_places(const VolumeMesh& mesh, const MeshTopology& topology, DefectList& defects) {
  if (mesh.tags.empty()) return;
  const InterfaceMarks marks = mark_interfaces(topology, find_interfaces(mesh, topology));
  for (const CreaseEdge& crease : mesh.tags.creases) {
    if (!names_vertex(mesh, crease.v0) || !names_vertex(mesh, crease.v1)) continue;
    const Index e = topology.find_edge(crease.v0, crease.v1);
    if (e == kNoIndex || (!topology.is_boundary_edge(e) && !marks.has_edge(e)))
      defects.add(
          MeshDefect::Kind::bad_tag, crease.v0,
          "crease " + number_list(std::array{crease.v0, crease.v1}) + " is no edge of the boundary or of an interface");
  }
  for (const CornerVertex& corner : mesh.tags.corners)
    if (names_vertex(mesh, corner.vertex) && !topology.is_boundary_vertex(corner.vertex) &&
        !marks.has_vertex(corner.vertex))
      defects.add(MeshDefect::Kind::bad_tag, corner.vertex,
                  "corner " + std::to_string(corner.vertex) + " is not on the boundary or on an interface");
}

void check_tag_values(const VolumeMesh& mesh, DefectList& defects) {
  const auto complain = [&](bool bad, Index v, const std::string& message) {
    if (bad) defects.add(MeshDefect::Kind::bad_tag, v, message);
  };
  const CreaseEdge* last = nullptr;
  for (const CreaseEdge& crease : mesh.tags.creases) {
    const std::string name = "crease " + number_list(std::array{crease.v0, crease.v1});
    complain(!names_vertex(mesh, crease.v0) || !names_vertex(mesh, crease.v1), crease.v0,
             name + " names a vertex that is not there");
    complain(crease.v0 >= crease.v1, crease.v0, name + " must name the smaller vertex first");
    complain(!(crease.sharpness > 0), crease.v0, name + " must have a sharpness > 0");
    complain(last && std::pair(last->v0, last->v1) >= std::pair(crease.v0, crease.v1), crease.v0,
             name + " is out of order or there twice");
    last = &crease;
  }
  const CornerVertex* previous = nullptr;
  for (const CornerVertex& corner : mesh.tags.corners) {
    const std::string name = "corner " + std::to_string(corner.vertex);
    complain(!names_vertex(mesh, corner.vertex), corner.vertex, name + " is a vertex that is not there");
    complain(!(corner.sharpness > 0), corner.vertex, name + " must have a sharpness > 0");
    complain(previous && previous->vertex >= corner.vertex, corner.vertex, name + " is out of order or there twice");
    previous = &corner;
  }
}

}  // namespace subvol::internal
