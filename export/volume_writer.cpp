// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/volume_writer.h"

#include "export/text_format.h"
#include "subvol/atomic_file.h"
#include "subvol/error.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>

namespace subvol {
namespace {

static_assert(std::endian::native == std::endian::little, "the arrays of a .vtu are written as they lie in memory");

void require_cells(const VolumeMesh& mesh, std::span<const double> cell_minima, std::span<const VertexField> fields) {
  if (mesh.num_cells() == 0) throw InputError("mesh: expected at least one cell");
  if (mesh.cell_offsets.size() != mesh.num_cells() + 1 || mesh.cell_offsets.back() != mesh.cell_vertices.size() ||
      (!mesh.references.empty() && mesh.references.size() != mesh.num_cells()))
    throw InputError("mesh: arrays of inconsistent length");
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (mesh.cell_offsets[c + 1] - mesh.cell_offsets[c] !=
        static_cast<std::size_t>(cell_topology(mesh.kinds[c]).num_vertices))
      throw InputError("mesh: cell " + std::to_string(c) + " has a number of corners that is not its kind's");
  for (const Index v : mesh.cell_vertices)
    if (v < 0 || static_cast<std::size_t>(v) >= mesh.num_vertices())
      throw InputError("mesh: vertex number " + std::to_string(v) + " is out of range");
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (!mesh.positions[v].allFinite())
      throw InputError("mesh: vertex " + std::to_string(v) + ": expected finite coordinates");
  if (!cell_minima.empty() && cell_minima.size() != mesh.num_cells())
    throw InputError("cell_minima: expected one value per cell");
  if (!std::all_of(cell_minima.begin(), cell_minima.end(), [](double x) { return std::isfinite(x); }))
    throw InputError("cell_minima: expected finite numbers");
  for (const VertexField& field : fields) {
    if (field.values.size() != mesh.num_vertices()) throw InputError(field.name + ": expected one value per vertex");
    if (!std::all_of(field.values.begin(), field.values.end(), [](double x) { return std::isfinite(x); }))
      throw InputError(field.name + ": expected finite numbers");
  }
}

void append_base64(std::string& text, const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
}

template <class T>
void append_data_array(std::string& text, const char* type, const std::string& attributes, std::span<const T> values) {
  const std::uint64_t size = values.size() * sizeof(T);
  std::string bytes(sizeof size + size, '\0');
  std::memcpy(bytes.data(), &size, sizeof size);
  if (size > 0) std::memcpy(bytes.data() + sizeof size, values.data(), size);
  text += std::string("        <DataArray type=\"") + type + "\" " + attributes + " format=\"binary\">";
  append_base64(text, bytes);
  text += "</DataArray>\n";
}

std::uint8_t vtk_type(CellKind kind) { return kind == CellKind::tet ? 71 : kind == CellKind::hex ? 72 : 73; }
int gmsh_type(CellKind kind) { return kind == CellKind::tet ? 4 : kind == CellKind::hex ? 5 : 6; }

/// Cells in the order of a .msh: by reference, then kind, then number.
using Blocks = std::map<std::pair<int, CellKind>, std::vector<std::size_t>>;

Blocks blocks_of(const VolumeMesh& mesh) {
  Blocks blocks;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    blocks[{mesh.references.empty() ? 0 : mesh.references[c], mesh.kinds[c]}].push_back(c);
  return blocks;
}

/// Volume numbers, from 1 in the order of the references.
std::map<int, int> volume_numbers(const Blocks& blocks) {
  std::map<int, int> numbers;
  for (const auto& [key, cells] : blocks) numbers.try_emplace(key.first, static_cast<int>(numbers.size()) + 1);
  return numbers;
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

void append_entities(std::string& text, const VolumeMesh& mesh, const std::map<int, int>& volumes) {
  Vec3 low = mesh.positions[0], high = low;
  for (const Vec3& p : mesh.positions) low = low.cwiseMin(p), high = high.cwiseMax(p);
  text += "$Entities\n";
  append_line(text, {0, 0, 0, volumes.size()});
  for (const auto& [reference, number] : volumes) {
    append_number(text, number);
    text += ' ';
    append_vector(text, low, " ");
    text += ' ';
    append_vector(text, high, " ");
    text += reference > 0 ? " 1 " + std::to_string(reference) : " 0";
    text += " 0\n";
  }
  text += "$EndEntities\n";
}

void append_nodes(std::string& text, const VolumeMesh& mesh) {
  const std::size_t n = mesh.num_vertices();
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

void append_elements(std::string& text, const VolumeMesh& mesh, const Blocks& blocks,
                     const std::map<int, int>& volumes) {
  text += "$Elements\n";
  append_line(text, {blocks.size(), mesh.num_cells(), 1, mesh.num_cells()});
  std::size_t number = 0;
  for (const auto& [key, cells] : blocks) {
    append_line(text, {3, static_cast<std::size_t>(volumes.at(key.first)),
                       static_cast<std::size_t>(gmsh_type(key.second)), cells.size()});
    for (const std::size_t c : cells) {
      append_number(text, ++number);
      for (const Index v : mesh.cell(c)) {
        text += ' ';
        append_number(text, v + std::int64_t{1});
      }
      text += '\n';
    }
  }
  text += "$EndElements\n";
}

void append_element_data(std::string& text, const Blocks& blocks, std::span<const double> cell_minima) {
  text += "$ElementData\n1\n\"scaled_jacobian\"\n1\n0\n3\n0\n1\n";
  append_line(text, {cell_minima.size()});
  std::size_t number = 0;
  for (const auto& [key, cells] : blocks)
    for (const std::size_t c : cells) {
      append_number(text, ++number);
      text += ' ';
      append_number(text, cell_minima[c]);
      text += '\n';
    }
  text += "$EndElementData\n";
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

std::string vtu_text(const VolumeMesh& mesh, std::span<const double> cell_minima, std::span<const VertexField> fields) {
  require_cells(mesh, cell_minima, fields);
  const std::span<const double> coordinates(mesh.positions[0].data(), 3 * mesh.num_vertices());
  const std::vector<std::int64_t> corners(mesh.cell_vertices.begin(), mesh.cell_vertices.end());
  const std::vector<std::int64_t> ends(mesh.cell_offsets.begin() + 1, mesh.cell_offsets.end());
  const std::vector<std::int32_t> references(mesh.references.begin(), mesh.references.end());
  std::vector<std::uint8_t> types;
  for (const CellKind kind : mesh.kinds) types.push_back(vtk_type(kind));
  std::string text =
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"2.2\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
      "  <UnstructuredGrid>\n    <Piece NumberOfPoints=\"" + std::to_string(mesh.num_vertices()) +
      "\" NumberOfCells=\"" + std::to_string(mesh.num_cells()) + "\">\n      <Points>\n";
  append_data_array(text, "Float64", "Name=\"Points\" NumberOfComponents=\"3\"", coordinates);
  text += "      </Points>\n      <Cells>\n";
  append_data_array<std::int64_t>(text, "Int64", "Name=\"connectivity\"", corners);
  append_data_array<std::int64_t>(text, "Int64", "Name=\"offsets\"", ends);
  append_data_array<std::uint8_t>(text, "UInt8", "Name=\"types\"", types);
  text += "      </Cells>\n";
  if (!fields.empty()) text += "      <PointData>\n";
  for (const VertexField& field : fields)
    append_data_array<double>(text, "Float64", "Name=\"" + field.name + "\"", field.values);
  if (!fields.empty()) text += "      </PointData>\n";
  text += "      <CellData>\n";
  if (!references.empty()) append_data_array<std::int32_t>(text, "Int32", "Name=\"reference\"", references);
  if (!cell_minima.empty()) append_data_array(text, "Float64", "Name=\"scaled_jacobian\"", cell_minima);
  return text + "      </CellData>\n    </Piece>\n  </UnstructuredGrid>\n</VTKFile>\n";
}

std::string msh_text(const VolumeMesh& mesh, std::span<const double> cell_minima, std::span<const VertexField> fields) {
  require_cells(mesh, cell_minima, fields);
  const Blocks blocks = blocks_of(mesh);
  const std::map<int, int> volumes = volume_numbers(blocks);
  std::string text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
  append_entities(text, mesh, volumes);
  append_nodes(text, mesh);
  append_elements(text, mesh, blocks, volumes);
  if (!cell_minima.empty()) append_element_data(text, blocks, cell_minima);
  for (const VertexField& field : fields) append_node_data(text, field);
  return text;
}

void write_volume(const std::filesystem::path& path, const VolumeMesh& mesh, std::span<const double> cell_minima,
                  std::span<const VertexField> fields) {
  const std::string extension = lower_case_extension(path);
  if (extension != ".vtu" && extension != ".msh") throw InputError(path.string() + ": expected the extension .vtu or .msh");
  write_file_atomically(path, extension == ".vtu" ? vtu_text(mesh, cell_minima, fields)
                                                  : msh_text(mesh, cell_minima, fields));
}

}  // namespace subvol
