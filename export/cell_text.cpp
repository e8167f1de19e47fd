// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/cell_text.h"

#include "subvol/base/error.h"
#include "subvol/export/text_format.h"
#include "subvol/export/vtu_arrays.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <compare>
#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace subvol::internal {
namespace {

constexpr int kGmshTets[] = {4, 11, 29, 30, 31, 71, 72, 73, 74, 75};
constexpr int kGmshPrisms[] = {6, 13};
constexpr int kGmshPyramids[] = {7};
constexpr int kGmshHexes[] = {5, 12, 92, 93, 94, 95, 96, 97, 98};

constexpr int kGmshTriangles[] = {2, 9, 21, 23, 25, 42, 43, 44, 45, 46};
constexpr int kGmshQuads[] = {3, 10, 36, 37, 38, 47, 48, 49, 50, 51};

std::span<const int> gmsh_types(CellKind kind) {
  switch (kind) {
    case CellKind::tet: return kGmshTets;
    case CellKind::prism: return kGmshPrisms;
    case CellKind::pyramid: return kGmshPyramids;
    case CellKind::hex: break;
  }
  return kGmshHexes;
}

/// A volume of a .msh: the cells of one reference and order. Gmsh assumes that all tets of a volume have the same
/// order.
struct Volume {
  int reference, order;
  auto operator<=>(const Volume&) const = default;
};

/// Cells in the order of a .msh: by volume, then kind, then number.
using Blocks = std::map<std::pair<Volume, CellKind>, std::vector<std::size_t>>;

Blocks blocks_of(const CellView& mesh) {
  Blocks blocks;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    blocks[{{mesh.references.empty() ? 0 : mesh.references[c], mesh.order(c)}, mesh.kinds[c]}].push_back(c);
  return blocks;
}

/// Numbers of the volumes, from 1 in the order of the references.
std::map<Volume, int> volume_numbers(const Blocks& blocks) {
  std::map<Volume, int> numbers;
  for (const auto& [key, cells] : blocks) numbers.try_emplace(key.first, static_cast<int>(numbers.size()) + 1);
  return numbers;
}

/// A surface of a .msh: the faces of the same groups and order.
struct Surface {
  std::vector<Index> groups;
  int order;
  auto operator<=>(const Surface&) const = default;
};

/// Faces in the order of a .msh: by surface, then number of corners, then number.
using FaceBlocks = std::map<std::pair<Surface, std::uint8_t>, std::vector<std::size_t>>;

FaceBlocks face_blocks_of(const CellView& mesh) {
  FaceBlocks blocks;
  if (!mesh.faces) return blocks;
  for (std::size_t f = 0; f < mesh.faces->num_faces(); ++f)
    blocks[{{mesh.faces->of_face[f], mesh.faces->orders[f]}, mesh.faces->sizes[f]}].push_back(f);
  return blocks;
}

std::map<Surface, int> surface_numbers(const FaceBlocks& blocks) {
  std::map<Surface, int> numbers;
  for (const auto& [key, faces] : blocks) numbers.try_emplace(key.first, static_cast<int>(numbers.size()) + 1);
  return numbers;
}

/// The numbers of the groups, all different and > 0: a number that is not is replaced by the first free one.
std::vector<int> physical_surfaces(std::span<const Group> groups) {
  std::vector<int> numbers;
  std::set<int> taken;
  for (const Group& group : groups) taken.insert(group.number);
  int next = 1;
  std::set<int> used;
  for (const Group& group : groups) {
    int number = group.number;
    if (number <= 0 || used.contains(number)) {
      while (taken.contains(next)) ++next;
      number = next++;
    }
    used.insert(number);
    numbers.push_back(number);
  }
  return numbers;
}

/// The physical group of each reference, > 0: if only some cells have a group, programs lose the others or refuse the
/// file. A positive reference is its own group; any other gets the first free number.
std::map<int, int> physical_groups(const Blocks& blocks) {
  std::map<int, int> groups;
  std::set<int> taken;
  for (const auto& [key, cells] : blocks)
    if (const int reference = key.first.reference; reference > 0) taken.insert(groups[reference] = reference);
  int next = 1;
  for (const auto& [key, cells] : blocks) {
    if (const int reference = key.first.reference; reference > 0 || groups.contains(reference)) continue;
    while (taken.contains(next)) ++next;
    groups[key.first.reference] = next++;
  }
  return groups;
}

void append_line(std::string& text, std::initializer_list<std::size_t> numbers) {
  const char* separator = "";
  for (const std::size_t number : numbers) {
    text += separator;
    append_number(text, number);
    separator = " ";
  }
  text += '\n';
}

constexpr std::size_t kLongestGmshName = 126;

/// Cuts a name to so many bytes, not within a character.
std::string cut_name(const std::string& name, std::size_t longest) {
  if (name.size() <= longest) return name;
  std::size_t end = longest;
  while (end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0) == 0x80) --end;
  return name.substr(0, end);
}

/// Names of a .msh. Names that differ stay different when they are cut: those behind the first get a number.
class GmshNames {
 public:
  std::string take(const std::string& wanted) {
    std::string name = gmsh_name(wanted);
    for (int n = 2; names_.try_emplace(name, wanted).first->second != wanted; ++n) {
      const std::string number = ' ' + std::to_string(n);
      name = cut_name(gmsh_name(wanted), kLongestGmshName - number.size()) + number;
    }
    return name;
  }

 private:
  std::map<std::string, std::string> names_;  ///< what each was made of
};

std::string region_name(const CellView& mesh, int reference) {
  for (const Group& region : mesh.regions)
    if (region.number == reference && !region.name.empty()) return region.name;
  return "reference " + std::to_string(reference);
}

void append_physical_names(std::string& text, const CellView& mesh, const std::map<int, int>& groups) {
  const std::size_t num_surfaces = mesh.faces ? mesh.faces->groups.size() : 0;
  text += "$PhysicalNames\n" + std::to_string(num_surfaces + groups.size()) + "\n";
  GmshNames of_surfaces, of_volumes;
  if (mesh.faces) {
    const std::vector<int> numbers = physical_surfaces(mesh.faces->groups);
    for (std::size_t g = 0; g < num_surfaces; ++g)
      text += "2 " + std::to_string(numbers[g]) + " \"" + of_surfaces.take(label_of(mesh.faces->groups[g])) + "\"\n";
  }
  for (const auto& [reference, group] : groups)
    text += "3 " + std::to_string(group) + " \"" + of_volumes.take(region_name(mesh, reference)) + "\"\n";
  text += "$EndPhysicalNames\n";
}

void append_surface_entities(std::string& text, const CellView& mesh, const std::map<Surface, int>& surfaces,
                             const std::string& box) {
  if (!mesh.faces) return;
  const std::vector<int> numbers = physical_surfaces(mesh.faces->groups);
  for (const auto& [surface, number] : surfaces) {
    text += std::to_string(number) + ' ' + box + ' ' + std::to_string(surface.groups.size());
    for (const Index group : surface.groups) text += ' ' + std::to_string(numbers[group]);
    text += " 0\n";
  }
}

void append_entities(std::string& text, const CellView& mesh, const std::map<Surface, int>& surfaces,
                     const std::map<Volume, int>& volumes, const std::map<int, int>& groups) {
  Vec3 low = mesh.positions[0], high = low;
  for (const Vec3& p : mesh.positions) low = low.cwiseMin(p), high = high.cwiseMax(p);
  std::string box;
  append_vector(box, low, " ");
  box += ' ';
  append_vector(box, high, " ");
  text += "$Entities\n";
  append_line(text, {0, 0, surfaces.size(), volumes.size()});
  append_surface_entities(text, mesh, surfaces, box);
  for (const auto& [volume, number] : volumes)
    text += std::to_string(number) + ' ' + box + " 1 " + std::to_string(groups.at(volume.reference)) + " 0\n";
  text += "$EndEntities\n";
}

void append_nodes(std::string& text, const CellView& mesh) {
  const std::size_t n = mesh.positions.size();
  text += "$Nodes\n";
  append_line(text, {1, n, 1, n});
  append_line(text, {3, 1, 0, n});
  for (std::size_t v = 1; v <= n; ++v) append_line(text, {v});
  for (const Vec3& position : mesh.positions) {
    append_vector(text, position, " ");
    text += '\n';
  }
  text += "$EndNodes\n";
}

void append_element(std::string& text, std::size_t number, std::span<const Index> nodes) {
  append_number(text, number);
  for (const Index v : nodes) {
    text += ' ';
    append_number(text, v + std::int64_t{1});
  }
  text += '\n';
}

void append_elements(std::string& text, const CellView& mesh, const Blocks& blocks,
                     const std::map<Volume, int>& volumes, const FaceBlocks& face_blocks,
                     const std::map<Surface, int>& surfaces) {
  const std::size_t total = mesh.num_cells() + (mesh.faces ? mesh.faces->num_faces() : 0);
  text += "$Elements\n";
  append_line(text, {blocks.size() + face_blocks.size(), total, 1, total});
  std::size_t number = 0;
  for (const auto& [key, cells] : blocks) {
    const auto& [volume, kind] = key;
    append_line(text, {3, static_cast<std::size_t>(volumes.at(volume)),
                       static_cast<std::size_t>(gmsh_type(kind, volume.order)), cells.size()});
    for (const std::size_t c : cells) append_element(text, ++number, mesh.cell(c));
  }
  for (const auto& [key, faces] : face_blocks) {
    append_line(text, {2, static_cast<std::size_t>(surfaces.at(key.first)),
                       static_cast<std::size_t>(gmsh_face_type(key.second, key.first.order)), faces.size()});
    for (const std::size_t f : faces) append_element(text, ++number, mesh.faces->face(f));
  }
  text += "$EndElements\n";
}

// --- Version 2.2 ----------------------------------------------------------------------------------------------------

void append_old_nodes(std::string& text, const CellView& mesh) {
  text += "$Nodes\n" + std::to_string(mesh.positions.size()) + "\n";
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    append_number(text, v + 1);
    text += ' ';
    append_vector(text, mesh.positions[v], " ");
    text += '\n';
  }
  text += "$EndNodes\n";
}

/// Appends the elements with their types, physical groups and volumes or surfaces.
void append_old_elements(std::string& text, const CellView& mesh, const Blocks& blocks,
                         const std::map<Volume, int>& volumes, const std::map<int, int>& groups,
                         const FaceBlocks& face_blocks, const std::map<Surface, int>& surfaces) {
  std::string lines;
  std::size_t count = 0;
  const auto append = [&](int type, int group, int entity, std::span<const Index> nodes) {
    append_number(lines, ++count);
    for (const int number : {type, 2, group, entity}) (lines += ' ') += std::to_string(number);
    for (const Index v : nodes) {
      lines += ' ';
      append_number(lines, v + std::int64_t{1});
    }
    lines += '\n';
  };
  for (const auto& [key, cells] : blocks)
    for (const std::size_t c : cells)
      append(gmsh_type(key.second, key.first.order), groups.at(key.first.reference), volumes.at(key.first),
             mesh.cell(c));
  const std::vector<int> numbers = mesh.faces ? physical_surfaces(mesh.faces->groups) : std::vector<int>{};
  for (const auto& [key, faces] : face_blocks)
    for (const std::size_t f : faces)
      for (const Index group : key.first.groups)
        append(gmsh_face_type(key.second, key.first.order), numbers[static_cast<std::size_t>(group)],
               surfaces.at(key.first), mesh.faces->face(f));
  text += "$Elements\n" + std::to_string(count) + "\n" + lines + "$EndElements\n";
}

// --- Data -----------------------------------------------------------------------------------------------------------

/// Appends the values of all elements; a face has that of its cell. Readers such as meshio expect one for each element.
void append_element_data(std::string& text, std::span<const std::size_t> of_element,
                         std::span<const double> cell_minima) {
  text += "$ElementData\n1\n\"scaled_jacobian\"\n1\n0\n3\n0\n1\n";
  append_line(text, {of_element.size()});
  for (std::size_t e = 0; e < of_element.size(); ++e) {
    append_number(text, e + 1);
    text += ' ';
    append_number(text, cell_minima[of_element[e]]);
    text += '\n';
  }
  text += "$EndElementData\n";
}

/// The cell of each element of version 4.1.
std::vector<std::size_t> cells_of_elements(const CellView& mesh, const Blocks& blocks, const FaceBlocks& face_blocks) {
  std::vector<std::size_t> of_element;
  for (const auto& [key, cells] : blocks) of_element.insert(of_element.end(), cells.begin(), cells.end());
  for (const auto& [key, faces] : face_blocks)
    for (const std::size_t f : faces) of_element.push_back(static_cast<std::size_t>(mesh.faces->cells[f]));
  return of_element;
}

void append_node_data(std::string& text, const VertexField& field) {
  text += "$NodeData\n1\n\"" + field.name + "\"\n1\n0\n3\n0\n1\n";
  append_line(text, {field.values.size()});
  for (std::size_t v = 0; v < field.values.size(); ++v) {
    append_number(text, v + 1);
    text += ' ';
    append_number(text, field.values[v]);
    text += '\n';
  }
  text += "$EndNodeData\n";
}

}  // namespace

std::uint8_t vtk_type(CellKind kind, bool is_bezier) {
  const int first = is_bezier ? 78 : 71;
  return static_cast<std::uint8_t>(first + (kind == CellKind::tet ? 0 : kind == CellKind::hex ? 1 : 2));
}

std::uint8_t vtk_linear_type(CellKind kind) {
  constexpr std::uint8_t kVtkLinearTypes[] = {10, 13, 12, 14};
  return kVtkLinearTypes[static_cast<std::size_t>(kind)];
}

void turn_wedge(std::int64_t* corners) {
  std::swap(corners[1], corners[2]);
  std::swap(corners[4], corners[5]);
}

int max_gmsh_order(CellKind kind) { return static_cast<int>(gmsh_types(kind).size()); }

int gmsh_type(CellKind kind, int order) {
  assert(order >= 1 && order <= max_gmsh_order(kind));
  return gmsh_types(kind)[static_cast<std::size_t>(order) - 1];
}

int gmsh_face_type(std::size_t num_corners, int order) {
  assert(order >= 1 && order <= static_cast<int>(std::size(kGmshTriangles)));
  return num_corners == 3 ? kGmshTriangles[order - 1] : kGmshQuads[order - 1];
}

std::string gmsh_name(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  std::replace(name.begin(), name.end(), '"', '\'');
  return cut_name(name, kLongestGmshName);
}

void require_cell_minima(std::span<const double> cell_minima, std::size_t num_cells) {
  if (!cell_minima.empty() && cell_minima.size() != num_cells)
    throw InputError("cell_minima: expected one value per cell");
  if (!std::all_of(cell_minima.begin(), cell_minima.end(), [](double x) { return std::isfinite(x); }))
    throw InputError("cell_minima: expected finite numbers");
}

std::string vtu_document(const CellView& mesh, std::span<const double> cell_minima, std::span<const VertexField> fields,
                         const std::string& field_data, const std::string& group_data) {
  const std::span<const double> coordinates(mesh.positions.data()->data(), 3 * mesh.positions.size());
  const bool is_linear = mesh.orders.empty();
  std::vector<std::int64_t> corners(mesh.nodes.begin(), mesh.nodes.end());
  for (std::size_t c = 0; is_linear && c < mesh.num_cells(); ++c)
    if (mesh.kinds[c] == CellKind::prism) turn_wedge(corners.data() + mesh.offsets[c]);
  const std::vector<std::int64_t> ends(mesh.offsets.begin() + 1, mesh.offsets.end());
  const std::vector<std::int32_t> references(mesh.references.begin(), mesh.references.end());
  std::vector<std::uint8_t> types;
  for (const CellKind kind : mesh.kinds)
    types.push_back(is_linear ? vtk_linear_type(kind) : vtk_type(kind, mesh.has_control_points));
  std::string text = std::string("<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"") +
                     (is_linear ? "1.0" : "2.2") +
                     "\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <UnstructuredGrid>\n";
  text += "    <Piece NumberOfPoints=\"" + std::to_string(mesh.positions.size()) + "\" NumberOfCells=\"" +
          std::to_string(mesh.num_cells()) + "\">\n      <Points>\n";
  append_data_array(text, "Name=\"Points\" NumberOfComponents=\"3\"", coordinates);
  text += "      </Points>\n      <Cells>\n";
  append_data_array<std::int64_t>(text, "Name=\"connectivity\"", corners);
  append_data_array<std::int64_t>(text, "Name=\"offsets\"", ends);
  append_data_array<std::uint8_t>(text, "Name=\"types\"", types);
  text += "      </Cells>\n";
  if (!fields.empty()) text += "      <PointData>\n";
  for (const VertexField& field : fields) append_data_array<double>(text, "Name=\"" + field.name + "\"", field.values);
  if (!fields.empty()) text += "      </PointData>\n";
  // MFEM takes the attributes of cells from the first array, if it is called material.
  text += references.empty() ? "      <CellData>\n" : "      <CellData Scalars=\"material\">\n";
  if (!references.empty()) append_data_array<std::int32_t>(text, "Name=\"material\"", references);
  const std::vector<std::int32_t> orders(mesh.orders.begin(), mesh.orders.end());
  if (!orders.empty()) append_data_array<std::int32_t>(text, "Name=\"order\"", orders);
  if (!references.empty()) append_data_array<std::int32_t>(text, "Name=\"reference\"", references);
  if (!cell_minima.empty()) append_data_array(text, "Name=\"scaled_jacobian\"", cell_minima);
  text += "      </CellData>\n    </Piece>\n";
  // The groups of linear cells stand in the grid, where meshio and VTK read them; meshio refuses a file with more than
  // a grid. Data of curved cells stand behind it, since MFEM reads a grid only if it has nothing but its piece.
  if (is_linear && !group_data.empty()) text += "    <FieldData>\n" + group_data + "    </FieldData>\n";
  text += "  </UnstructuredGrid>\n";
  const std::string behind = is_linear ? field_data : field_data + group_data;
  if (!behind.empty()) text += "  <FieldData>\n" + behind + "  </FieldData>\n";
  return text + "</VTKFile>\n";
}

std::string msh_document(const CellView& mesh, std::span<const double> cell_minima, std::span<const VertexField> fields,
                         MshVersion version) {
  const Blocks blocks = blocks_of(mesh);
  const std::map<Volume, int> volumes = volume_numbers(blocks);
  const FaceBlocks face_blocks = face_blocks_of(mesh);
  const std::map<Surface, int> surfaces = surface_numbers(face_blocks);
  const bool is_old = version == MshVersion::v2_2;
  std::string text = is_old ? "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" : "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
  const std::map<int, int> groups = physical_groups(blocks);
  append_physical_names(text, mesh, groups);
  if (is_old) {  // without data of elements, which meshio does not read from this version
    append_old_nodes(text, mesh);
    append_old_elements(text, mesh, blocks, volumes, groups, face_blocks, surfaces);
  } else {
    append_entities(text, mesh, surfaces, volumes, groups);
    append_nodes(text, mesh);
    append_elements(text, mesh, blocks, volumes, face_blocks, surfaces);
    if (!cell_minima.empty()) append_element_data(text, cells_of_elements(mesh, blocks, face_blocks), cell_minima);
  }
  for (const VertexField& field : fields) append_node_data(text, field);
  return text;
}

}  // namespace subvol::internal
