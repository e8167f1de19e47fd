// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <string>
#include <vector>

namespace subvol::internal {

/// The faces between regions. A *region* is all cells of one reference; the faces between two regions are their
/// *interface*.
struct Interfaces {
  std::vector<std::array<int, 2>> pairs;  ///< references of the two regions of each interface, ascending
  std::vector<Index> faces;               ///< numbers of `MeshTopology`, ascending
  std::vector<Index> pair_of_face;        ///< for each of `faces`, its place in `pairs`
  bool empty() const { return faces.empty(); }
};

/// Returns the interfaces of a mesh; none if it has no references or all are equal. topology: of this mesh.
/// Cost: linear in the faces.
Interfaces find_interfaces(const VolumeMesh& mesh, const MeshTopology& topology);

/// Returns the corners of a face between two regions, so that the normal points from the smaller to the larger
/// reference; unused entries are kNoIndex.
std::array<Index, 4> oriented_face(const VolumeMesh& mesh, const MeshTopology& topology, Index face);

/// Marks the edges and vertices of interfaces with 1. One entry per edge and vertex of the topology; empty: there are
/// no interfaces.
struct InterfaceMarks {
  std::vector<char> edges, vertices;
  /// 1 for edges of *feature curves*, where more than two faces of the boundary and of interfaces meet.
  std::vector<char> curves;
  bool has_edge(Index e) const { return !edges.empty() && edges[e] != 0; }
  bool has_vertex(Index v) const { return !vertices.empty() && vertices[v] != 0; }
  bool is_curve(Index e) const { return !curves.empty() && curves[e] != 0; }
};
InterfaceMarks mark_interfaces(const MeshTopology& topology, const Interfaces& interfaces);

/// Returns the references that occur, ascending; {0} for a mesh without references.
std::vector<int> region_references(const VolumeMesh& mesh);

/// Puts the faces of each interface into a group of their own, named by its two regions: "core|shell", "region 1|region
/// 3". Groups that the mesh has are kept. Cost: linear but for a sort of the faces.
void add_interface_groups(VolumeMesh& mesh);

/// Returns the name of a region for people: that of its group in `VolumeMesh::regions`, or "region 3".
std::string region_label(const VolumeMesh& mesh, int reference);

}  // namespace subvol::internal
