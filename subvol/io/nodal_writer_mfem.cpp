// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/mfem_numbering.h"
#include "subvol/io/nodal_writers.h"
#include "subvol/io/positive_numbers.h"

#include <algorithm>
#include <map>
#include <set>
#include <vector>

namespace subvol::internal {

namespace {

/// Returns the cells by their corners, with their groups. Vertices of no linear cell keep their place.
VolumeMesh corner_cells(const NodalMesh& mesh) {
  std::vector<Index> number;
  VolumeMesh result = corner_mesh(mesh, mesh.max_order() == 1, number);
  result.face_groups = renumbered(mesh.face_groups, number);
  return result;
}

/// Appends the faces of the boundary and those of groups, seen from outside.
void append_boundary(std::string& text, const VolumeMesh& mesh) {
  text += "\nboundary\n";
  if (mesh.face_groups.empty()) {  // MFEM makes its own
    text += "0\n";
    return;
  }
  std::vector<int> numbers;
  for (const Group& group : mesh.face_groups.groups) numbers.push_back(group.number);
  PositiveNumbers attributes(numbers);
  int otherwise = 0;
  std::map<FaceKey, int> num_cells;
  const auto each_face = [&](const auto& visit) {
    std::vector<Index> corners;
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const CellTopology& topology = cell_topology(mesh.kinds[c]);
      for (int f = 0; f < topology.num_faces; ++f) {
        corners.clear();
        for (int i = 0; i < topology.face_sizes[static_cast<std::size_t>(f)]; ++i)
          corners.push_back(mesh.cell(
              c)[static_cast<std::size_t>(topology.faces[static_cast<std::size_t>(f)][static_cast<std::size_t>(i)])]);
        visit(corners);
      }
    }
  };
  each_face([&](const std::vector<Index>& corners) { ++num_cells[face_key(corners)]; });
  std::string lines;
  std::size_t count = 0;
  std::set<FaceKey> written;
  each_face([&](const std::vector<Index>& corners) {
    const Index group = group_of(mesh.face_groups, corners);
    const FaceKey key = face_key(corners);
    if ((group == kNoIndex && num_cells[key] > 1) || !written.insert(key).second) return;
    if (group == kNoIndex && otherwise == 0) otherwise = attributes.take_free();
    const int attribute =
        group == kNoIndex ? otherwise : attributes.of(mesh.face_groups.groups[static_cast<std::size_t>(group)].number);
    lines += std::to_string(attribute) + (corners.size() == 3 ? " 2" : " 3");
    for (const Index v : corners) lines += " " + std::to_string(v);
    lines += '\n';
    ++count;
  });
  text += std::to_string(count) + "\n" + lines;
}

void append_position(std::string& text, const Vec3& p) {
  for (int k = 0; k < 3; ++k) {
    append_number(text, p[k]);
    text += k < 2 ? ' ' : '\n';
  }
}

void append_nodes(std::string& text, const NodalMesh& mesh, const VolumeMesh& corners, int order) {
  const MfemNodes nodes =
      number_mfem_nodes(corners.num_vertices(), corners.kinds, corners.cell_offsets, corners.cell_vertices, order);
  std::vector<Vec3> values(nodes.count, Vec3::Zero());
  for (std::size_t i = 0; i < nodes.nodes.size(); ++i)
    values[static_cast<std::size_t>(nodes.nodes[i])] = mesh.positions[static_cast<std::size_t>(mesh.nodes[i])];
  text += "\nnodes\nFiniteElementSpace\nFiniteElementCollection: H1_3D_P" + std::to_string(order) +
          "\nVDim: 3\nOrdering: 1\n\n";
  for (const Vec3& value : values) append_position(text, value);
}

}  // namespace

std::string mfem_text(const NodalMesh& mesh) {
  const int order = mesh.orders.front();
  if (std::any_of(mesh.orders.begin(), mesh.orders.end(), [&](int p) { return p != order; }))
    throw InputError("MFEM: cells of several orders, expected one for all");
  if (order > 2 && mesh.spacing != NodeSpacing::lobatto)
    throw InputError("MFEM: expected nodes at the Gauss-Lobatto points");
  const VolumeMesh corners = corner_cells(mesh);
  std::string text =
      "MFEM mesh v1.0\n\n# written by subvol; tetrahedra 4, cubes 5, prisms 6, pyramids 7\n\n"
      "dimension\n3\n\nelements\n" +
      std::to_string(mesh.num_cells()) + "\n";
  PositiveNumbers attributes(mesh.references);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    constexpr const char* kMfemShapeTexts[] = {" 4", " 6", " 5", " 7"};
    text += std::to_string(attributes.of(mesh.references.empty() ? 0 : mesh.references[c])) +
            kMfemShapeTexts[static_cast<std::size_t>(mesh.kinds[c])];
    for (const Index v : corners.cell(c)) text += " " + std::to_string(v);
    text += '\n';
  }
  append_boundary(text, corners);
  text += "\nvertices\n" + std::to_string(corners.num_vertices()) + "\n";
  if (order > 1) {
    append_nodes(text, mesh, corners, order);
    return text;
  }
  text += "3\n";
  for (const Vec3& position : corners.positions) append_position(text, position);
  return text;
}

}  // namespace subvol::internal
