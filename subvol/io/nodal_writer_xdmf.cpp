// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/markup.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/nodal_formats.h"
#include "subvol/io/nodal_sides.h"
#include "subvol/io/nodal_writers.h"
#include "subvol/io/positive_numbers.h"

#include <algorithm>
#include <map>

namespace subvol::internal {

namespace {

/// Cells or faces of XDMF: the name and the number of their shape, and their nodes.
struct XdmfShape {
  const char* name;
  int number;  ///< in a mixed topology
};

XdmfShape cell_shape(CellKind kind, int order) {
  constexpr XdmfShape kXdmfLinearShapes[] = {{"Tetrahedron", 6}, {"Wedge", 8}, {"Hexahedron", 9}, {"Pyramid", 7}};
  constexpr XdmfShape kXdmfQuadraticShapes[] = {{"Tetrahedron_10", 38}, {"Wedge_18", 41}, {"Hexahedron_27", 50}};
  return (order == 1 ? kXdmfLinearShapes : kXdmfQuadraticShapes)[static_cast<std::size_t>(kind)];
}

XdmfShape face_shape(std::size_t num_corners, int order) {
  if (num_corners == 3) return order == 1 ? XdmfShape{"Triangle", 4} : XdmfShape{"Triangle_6", 36};
  return order == 1 ? XdmfShape{"Quadrilateral", 5} : XdmfShape{"Quadrilateral_9", 35};
}

/// Elements of a grid with one number each.
struct XdmfGrid {
  std::vector<XdmfShape> shapes;
  std::vector<std::vector<Index>> elements;
  std::vector<int> numbers;  ///< one per element, or empty
};

/// Appends an array in the text of the file.
template <class Appender>
void append_item(std::string& text, const std::string& dimensions, const char* type, const Appender& append) {
  text += "<DataItem Dimensions=\"" + dimensions + "\" NumberType=\"" + type + "\" Precision=\"8\" Format=\"XML\">\n";
  append();
  text += "</DataItem>";
}

void append_topology(std::string& text, const XdmfGrid& grid) {
  const auto is_first = [&](const XdmfShape& shape) { return shape.number == grid.shapes.front().number; };
  const bool is_mixed = !std::all_of(grid.shapes.begin(), grid.shapes.end(), is_first);
  const std::string count = std::to_string(grid.elements.size());
  std::size_t size = 0;
  for (const auto& element : grid.elements) size += element.size() + (is_mixed ? 1 : 0);
  const std::string per_element = std::to_string(grid.elements.front().size());
  text += "<Topology TopologyType=\"" + std::string(is_mixed ? "Mixed" : grid.shapes.front().name) +
          "\" NumberOfElements=\"" + count + "\"" +
          (is_mixed ? std::string() : " NodesPerElement=\"" + per_element + "\"") + ">\n";
  append_item(text, is_mixed ? std::to_string(size) : count + " " + per_element, "Int", [&] {
    for (std::size_t e = 0; e < grid.elements.size(); ++e) {
      if (is_mixed) text += std::to_string(grid.shapes[e].number) + ' ';
      for (const Index node : grid.elements[e]) text += std::to_string(node) + ' ';
      text.back() = '\n';
    }
  });
  text += "</Topology>\n";
}

void append_geometry(std::string& text, const NodalMesh& mesh) {
  text += "<Geometry GeometryType=\"XYZ\">\n";
  append_item(text, std::to_string(mesh.positions.size()) + " 3", "Float", [&] {
    for (const Vec3& x : mesh.positions) {
      for (int k = 0; k < 3; ++k) {
        append_number(text, x[k]);
        text += k < 2 ? ' ' : '\n';
      }
    }
  });
  text += "</Geometry>\n";
}

/// Appends the names of numbers as meshio writes and reads them: a document of its own.
void append_names(std::string& text, const std::vector<Group>& groups) {
  if (groups.empty()) return;
  text += "<Information Name=\"names\"><![CDATA[<main>";
  for (const Group& group : groups)
    text += "<map key=\"" + escaped_markup(label_of(group)) + "\" dim=\"" + std::to_string(group.dimension) + "\">" +
            std::to_string(group.number) + "</map>";
  text += "</main>]]></Information>\n";
}

std::string document(const NodalMesh& mesh, const std::string& name, const XdmfGrid& grid, const std::string& attribute,
                     const std::vector<Group>& names) {
  std::string text =
      "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\">\n<Domain>\n<Grid Name=\"" + name + "\" GridType=\"Uniform\">\n";
  append_topology(text, grid);
  append_geometry(text, mesh);
  if (!grid.numbers.empty()) {
    text += "<Attribute Name=\"" + attribute + "\" AttributeType=\"Scalar\" Center=\"Cell\">\n";
    append_item(text, std::to_string(grid.numbers.size()) + " 1", "Int", [&] {
      for (const int number : grid.numbers) (text += std::to_string(number)) += '\n';
    });
    text += "</Attribute>\n";
  }
  append_names(text, names);
  return text + "</Grid>\n</Domain>\n</Xdmf>\n";
}

}  // namespace

std::string xdmf_text(const NodalMesh& mesh) {
  const int order = common_order(mesh, "XDMF", 2);
  XdmfGrid grid;
  const std::vector<int> wedge = mirrored_places(CellKind::prism, order);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    grid.shapes.push_back(cell_shape(mesh.kinds[c], order));
    const auto cell = mesh.cell(c);
    grid.elements.emplace_back(cell.begin(), cell.end());
    if (mesh.kinds[c] == CellKind::prism)  // XDMF has VTK's wedges: the first triangle is seen from outside
      for (std::size_t i = 0; i < cell.size(); ++i) grid.elements.back()[i] = cell[static_cast<std::size_t>(wedge[i])];
  }
  grid.numbers = mesh.references;
  return document(mesh, "mesh", grid, "reference", mesh.references.empty() ? std::vector<Group>{} : mesh.regions);
}

std::string xdmf_faces_text(const NodalMesh& mesh) {
  const int order = common_order(mesh, "XDMF", 2);
  std::vector<Group> groups = mesh.face_groups.groups;
  std::vector<int> given;
  for (const Group& group : groups) given.push_back(group.number);
  PositiveNumbers positive(given);
  for (Group& group : groups) group.number = positive.of(group.number);
  struct Face {
    std::size_t cell;
    const std::vector<int>* corners;
    bool is_inner;
  };
  const auto tables = faces_by_kind(inp_faces);
  std::map<FaceKey, Face> faces;
  std::vector<FaceKey> in_order;
  std::vector<Index> corners;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (const std::vector<int>& face : tables[static_cast<std::size_t>(mesh.kinds[c])]) {
      corners.clear();
      for (const int i : face) corners.push_back(mesh.cell(c)[static_cast<std::size_t>(i)]);
      const auto [known, is_new] = faces.try_emplace(face_key(corners), Face{c, &face, false});
      if (is_new)
        in_order.push_back(known->first);
      else
        known->second.is_inner = true;
    }
  XdmfGrid grid;
  for (const FaceKey& key : in_order) {
    const Face& face = faces.at(key);
    const std::size_t size = key.back() == kNoIndex ? 3 : 4;
    const Index group = group_of(mesh.face_groups, std::span(key).first(size));
    if (face.is_inner && group == kNoIndex) continue;
    grid.shapes.push_back(face_shape(size, order));
    grid.elements.push_back(face_nodes(mesh, face.cell, *face.corners));
    grid.numbers.push_back(group == kNoIndex ? 0 : groups[static_cast<std::size_t>(group)].number);
  }
  return document(mesh, "groups", grid, "group", groups);
}

}  // namespace subvol::internal
