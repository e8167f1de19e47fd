// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/boundary_file.h"

#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/export/text_format.h"
#include "subvol/export/vtu_arrays.h"

#include <algorithm>
#include <cstdint>
#include <vector>

namespace subvol {

using namespace internal;
namespace {

void require_boundary(const PolygonMesh& boundary, const BoundaryOrigin& origin) {
  require_polygons(boundary, "boundary");
  if ((!origin.vertices.empty() && origin.vertices.size() != boundary.positions.size()) ||
      (!origin.cells.empty() && origin.cells.size() != boundary.num_faces()))
    throw InputError("boundary: expected one vertex of the volume for each vertex, and one cell for each face");
}

std::uint8_t type_of(std::size_t corners) { return corners == 3 ? 5 : corners == 4 ? 9 : 7; }

std::size_t num_corners_of(const PolygonMesh& mesh, std::size_t f) {
  return mesh.face_offsets[f + 1] - mesh.face_offsets[f];
}

/// Returns the groups with positive numbers.
std::vector<Group> positive_groups(std::vector<Group> groups) {
  for (Group& group : groups)
    if (group.number <= 0) group.number = free_number(groups);
  return groups;
}

std::vector<std::int32_t> numbers_of_faces(const PolygonMesh& mesh, const std::vector<Group>& groups) {
  std::vector<std::int32_t> numbers(mesh.num_faces(), 0);
  if (groups.empty()) return numbers;
  for (std::size_t f = 0; f < numbers.size(); ++f)
    if (const Index group = mesh.face_groups.of_face[f]; group != kNoIndex) numbers[f] = groups[group].number;
  return numbers;
}

/// How a file holds the names of groups.
enum class NameArray {
  texts,  ///< as VTK writes texts
  codes   ///< bytes: meshio stops at texts
};

/// Returns the codes of the characters of the names, each name ended by 0.
std::vector<std::uint8_t> codes_of_names(const std::vector<Group>& groups) {
  std::vector<std::uint8_t> codes;
  for (const Group& group : groups) {
    const std::string name = label_of(group);
    codes.insert(codes.end(), name.begin(), name.end());
    codes.push_back(0);
  }
  return codes;
}

void append_names(std::string& text, const std::vector<Group>& groups, NameArray kind) {
  const std::vector<std::uint8_t> codes = codes_of_names(groups);
  if (kind == NameArray::codes)
    return append_data_array<std::uint8_t>(
        text, "Name=\"group_names\" NumberOfTuples=\"" + std::to_string(codes.size()) + '"', codes);
  text += "        <DataArray type=\"String\" Name=\"group_names\" NumberOfTuples=\"" + std::to_string(groups.size()) +
          "\" format=\"ascii\">";
  for (const std::uint8_t code : codes) text += std::to_string(code) + ' ';
  text += "</DataArray>\n";
}

void append_groups(std::string& text, const std::vector<Group>& groups, NameArray kind) {
  if (groups.empty()) return;
  std::vector<std::int32_t> numbers;
  for (const Group& group : groups) numbers.push_back(group.number);
  text += "    <FieldData>\n";
  const std::string size = std::to_string(groups.size());
  append_data_array<std::int32_t>(text, "Name=\"group_numbers\" NumberOfTuples=\"" + size + '"', numbers);
  append_names(text, groups, kind);
  text += "    </FieldData>\n";
}

/// Appends numbers, one a line.
template <class Numbers>
void append_lines(std::string& text, const Numbers& numbers) {
  for (const auto number : numbers) {
    append_number(text, number);
    text += '\n';
  }
}

void append_vtk_groups(std::string& text, const std::vector<Group>& groups) {
  if (groups.empty()) return;
  text += "FIELD FieldData 2\ngroup_numbers 1 " + std::to_string(groups.size()) + " int\n";
  for (const Group& group : groups) text += std::to_string(group.number) + "\n";
  const std::vector<std::uint8_t> codes = codes_of_names(groups);  // as in .vtu
  text += "group_names 1 " + std::to_string(codes.size()) + " unsigned_char\n";
  for (const std::uint8_t code : codes) text += std::to_string(code) + "\n";
}

}  // namespace

std::vector<std::int32_t> group_numbers_of_faces(const PolygonMesh& mesh) {
  return numbers_of_faces(mesh, positive_groups(mesh.face_groups.groups));
}

void append_group_fields(std::string& text, const FaceGroups& groups) {
  append_groups(text, positive_groups(groups.groups), NameArray::texts);
}

std::string boundary_vtu_text(const PolygonMesh& boundary, const BoundaryOrigin& origin) {
  require_boundary(boundary, origin);
  const std::vector<Group> groups = positive_groups(boundary.face_groups.groups);
  std::vector<std::uint8_t> types;
  for (std::size_t f = 0; f < boundary.num_faces(); ++f) types.push_back(type_of(num_corners_of(boundary, f)));
  const std::vector<std::int64_t> corners(boundary.face_vertices.begin(), boundary.face_vertices.end());
  const std::vector<std::int64_t> ends(boundary.face_offsets.begin() + 1, boundary.face_offsets.end());
  std::string text =
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
      "  <UnstructuredGrid>\n    <Piece NumberOfPoints=\"" +
      std::to_string(boundary.positions.size()) + "\" NumberOfCells=\"" + std::to_string(types.size()) +
      "\">\n      <Points>\n";
  append_data_array<double>(text, "Name=\"Points\" NumberOfComponents=\"3\"",
                            {boundary.positions.data()->data(), 3 * boundary.positions.size()});
  text += "      </Points>\n      <Cells>\n";
  append_data_array<std::int64_t>(text, "Name=\"connectivity\"", corners);
  append_data_array<std::int64_t>(text, "Name=\"offsets\"", ends);
  append_data_array<std::uint8_t>(text, "Name=\"types\"", types);
  text += "      </Cells>\n";
  if (!origin.vertices.empty()) {
    text += "      <PointData>\n";
    append_data_array<std::int32_t>(text, "Name=\"vertex\"", origin.vertices);
    text += "      </PointData>\n";
  }
  text += "      <CellData>\n";
  append_data_array<std::int32_t>(text, "Name=\"group\"", numbers_of_faces(boundary, groups));
  if (!origin.cells.empty()) append_data_array<std::int32_t>(text, "Name=\"cell\"", origin.cells);
  text += "      </CellData>\n    </Piece>\n";
  append_groups(text, groups, NameArray::codes);
  return text + "  </UnstructuredGrid>\n</VTKFile>\n";
}

std::string boundary_vtk_text(const PolygonMesh& boundary, const BoundaryOrigin& origin) {
  require_boundary(boundary, origin);
  const std::vector<Group> groups = positive_groups(boundary.face_groups.groups);
  const std::string n = std::to_string(boundary.num_faces());
  std::string text = "# vtk DataFile Version 3.0\nsubvol boundary\nASCII\nDATASET UNSTRUCTURED_GRID\n";
  append_vtk_groups(text, groups);
  text += "POINTS " + std::to_string(boundary.positions.size()) + " double\n";
  for (const Vec3& position : boundary.positions) {
    append_vector(text, position, " ");
    text += '\n';
  }
  text += "CELLS " + n + " " + std::to_string(boundary.num_faces() + boundary.face_vertices.size()) + "\n";
  for (std::size_t f = 0; f < boundary.num_faces(); ++f) {
    append_number(text, num_corners_of(boundary, f));
    for (std::size_t k = boundary.face_offsets[f]; k < boundary.face_offsets[f + 1]; ++k) {
      text += ' ';
      append_number(text, boundary.face_vertices[k]);
    }
    text += '\n';
  }
  text += "CELL_TYPES " + n + "\n";
  for (std::size_t f = 0; f < boundary.num_faces(); ++f)
    text += std::to_string(type_of(num_corners_of(boundary, f))) + "\n";
  text += "CELL_DATA " + n + "\nSCALARS group int 1\nLOOKUP_TABLE default\n";
  append_lines(text, numbers_of_faces(boundary, groups));
  if (!origin.cells.empty()) {
    text += "SCALARS cell int 1\nLOOKUP_TABLE default\n";
    append_lines(text, origin.cells);
  }
  if (origin.vertices.empty()) return text;
  text += "POINT_DATA " + std::to_string(boundary.positions.size()) + "\nSCALARS vertex int 1\nLOOKUP_TABLE default\n";
  append_lines(text, origin.vertices);
  return text;
}

void write_boundary(const std::filesystem::path& path, const PolygonMesh& boundary, const BoundaryOrigin& origin) {
  const std::string extension = lower_case_extension(path);
  if (extension != ".vtu" && extension != ".vtk")
    throw InputError(path.string() + ": expected the extension .vtu or .vtk");
  write_file_atomically(
      path, extension == ".vtu" ? boundary_vtu_text(boundary, origin) : boundary_vtk_text(boundary, origin));
}

}  // namespace subvol
