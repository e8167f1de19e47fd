// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/surface_writer.h"

#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/markup.h"
#include "subvol/export/boundary_file.h"
#include "subvol/export/text_format.h"
#include "subvol/export/vtu_arrays.h"
#include "subvol/io/zip_archive.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <set>

namespace subvol {

using namespace internal;
namespace {

static_assert(std::endian::native == std::endian::little, "the binary formats here are little-endian");

template <class T>
void append_raw(std::string& bytes, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof raw);
}

Vec3 normal_of(const TriangleMesh& mesh, const std::array<Index, 3>& t) {
  const Vec3 normal = doubled_area_vector(mesh, t);
  const double length = normal.norm();
  return length > 0 && std::isfinite(length) ? Vec3(normal / length) : Vec3(Vec3::Zero());
}

// --- STL ------------------------------------------------------------------------------------------------------------

std::string binary_stl(const TriangleMesh& mesh) {
  std::string bytes = "subvol";
  bytes.resize(80, ' ');
  append_raw(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  const auto append = [&](const Vec3& x) {
    for (int k = 0; k < 3; ++k) append_raw(bytes, static_cast<float>(x[k]));
  };
  for (const auto& t : mesh.triangles) {
    append(normal_of(mesh, t));
    for (const Index v : t) append(mesh.positions[static_cast<std::size_t>(v)]);
    append_raw(bytes, std::uint16_t{0});
  }
  return bytes;
}

/// Returns true if single precision would move a vertex by more than a millionth of the extent of the surface: far from
/// the origin, and beyond the range of its numbers.
bool needs_double_precision(const TriangleMesh& mesh) {
  constexpr double kMostTimes = 16;  // single precision has 24 bits: 2^-24 * 16 is about 1e-6
  constexpr double kLargestFloat32 = std::numeric_limits<float>::max();
  constexpr double kSmallest = std::numeric_limits<float>::min() * kMostTimes;  // of an extent
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& t : mesh.triangles)
    for (const Index v : t) {
      low = low.cwiseMin(mesh.positions[static_cast<std::size_t>(v)]);
      high = high.cwiseMax(mesh.positions[static_cast<std::size_t>(v)]);
    }
  if (mesh.triangles.empty()) return false;
  const double largest = low.cwiseAbs().cwiseMax(high.cwiseAbs()).maxCoeff(), extent = (high - low).maxCoeff();
  return largest > kMostTimes * extent || largest > kLargestFloat32 || (extent > 0 && extent < kSmallest);
}

/// A name on one line.
std::string one_line(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return c < ' '; }, ' ');
  return trimmed(name);
}

/// Returns the names of the solids: those of the groups, and one for the faces of none. No two are the same, since
/// solids of one name are one group.
std::vector<std::string> solid_names(const std::vector<Group>& groups) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  const auto add = [&](const std::string& wanted) {
    std::string name = wanted;
    for (int n = 2; !taken.insert(name).second; ++n) name = wanted + ' ' + std::to_string(n);
    names.push_back(std::move(name));
  };
  for (const Group& group : groups) add(one_line(label_of(group)));
  add(groups.empty() ? "subvol" : "none");
  return names;
}

std::string text_stl(const TriangleMesh& mesh) {
  const std::vector<std::string> names = solid_names(mesh.face_groups.groups);
  const std::size_t num_groups = mesh.face_groups.groups.size();
  std::vector<std::vector<std::size_t>> of_solid(names.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Index group = mesh.face_groups.empty() ? kNoIndex : mesh.face_groups.of_face[t];
    of_solid[group == kNoIndex ? num_groups : static_cast<std::size_t>(group)].push_back(t);
  }
  std::string text;
  for (std::size_t s = 0; s < names.size(); ++s) {
    if (of_solid[s].empty()) continue;
    text += "solid " + names[s] + "\n";
    for (const std::size_t t : of_solid[s]) {
      text += "facet normal ";
      append_vector(text, normal_of(mesh, mesh.triangles[t]), " ");
      text += "\nouter loop\n";
      for (const Index v : mesh.triangles[t]) {
        text += "vertex ";
        append_vector(text, mesh.positions[static_cast<std::size_t>(v)], " ");
        text += '\n';
      }
      text += "endloop\nendfacet\n";
    }
    text += "endsolid " + names[s] + "\n";
  }
  return text;
}

// --- PLY ------------------------------------------------------------------------------------------------------------

std::string ply_bytes(const PolygonMesh& mesh) {
  const std::vector<std::int32_t> numbers = group_numbers_of_faces(mesh);
  const bool has_groups = !mesh.face_groups.empty();
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.positions.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
                      std::to_string(mesh.num_faces()) + "\nproperty list int int vertex_indices\n" +
                      (has_groups ? "property int reference\n" : "") + "end_header\n";
  for (const Vec3& x : mesh.positions)
    for (int k = 0; k < 3; ++k) append_raw(bytes, x[k]);
  for (std::size_t f = 0; f < mesh.num_faces(); ++f) {
    append_raw(bytes, static_cast<std::int32_t>(mesh.face_offsets[f + 1] - mesh.face_offsets[f]));
    for (std::size_t k = mesh.face_offsets[f]; k < mesh.face_offsets[f + 1]; ++k)
      append_raw(bytes, static_cast<std::int32_t>(mesh.face_vertices[k]));
    if (has_groups) append_raw(bytes, numbers[f]);
  }
  return bytes;
}

// --- VTP ------------------------------------------------------------------------------------------------------------

std::string vtp_text(const PolygonMesh& mesh) {
  const std::vector<std::int64_t> corners(mesh.face_vertices.begin(), mesh.face_vertices.end());
  const std::vector<std::int64_t> ends(mesh.face_offsets.begin() + 1, mesh.face_offsets.end());
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\">\n  <PolyData>\n";
  append_group_fields(text, mesh.face_groups);
  text += "    <Piece NumberOfPoints=\"" + std::to_string(mesh.positions.size()) +
          "\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" +
          std::to_string(mesh.num_faces()) + "\">\n      <Points>\n";
  append_data_array<double>(text, "Name=\"Points\" NumberOfComponents=\"3\"",
                            {mesh.positions.data()->data(), 3 * mesh.positions.size()});
  text += "      </Points>\n      <Polys>\n";
  append_data_array<std::int64_t>(text, "Name=\"connectivity\"", corners);
  append_data_array<std::int64_t>(text, "Name=\"offsets\"", ends);
  text += "      </Polys>\n";
  if (!mesh.face_groups.empty()) {
    text += "      <CellData>\n";
    append_data_array<std::int32_t>(text, "Name=\"group\"", group_numbers_of_faces(mesh));
    text += "      </CellData>\n";
  }
  return text + "    </Piece>\n  </PolyData>\n</VTKFile>\n";
}

// --- 3MF ------------------------------------------------------------------------------------------------------------

std::string model_of(const TriangleMesh& mesh) {
  const std::vector<Group>& groups = mesh.face_groups.groups;
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"millimeter\" "
      "xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\">\n<resources>\n";
  if (!groups.empty()) {
    text += "<basematerials id=\"1\">\n";
    for (const Group& group : groups)
      text += "<base name=\"" + escaped_markup(label_of(group)) + "\" displaycolor=\"#C0C0C0\"/>\n";
    text += "</basematerials>\n";
  }
  text += "<object id=\"2\" type=\"model\">\n<mesh>\n<vertices>\n";
  for (const Vec3& x : mesh.positions) {
    text += "<vertex x=\"";
    append_number(text, x[0]);
    text += "\" y=\"";
    append_number(text, x[1]);
    text += "\" z=\"";
    append_number(text, x[2]);
    text += "\"/>\n";
  }
  text += "</vertices>\n<triangles>\n";
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& corners = mesh.triangles[t];
    text += "<triangle v1=\"" + std::to_string(corners[0]) + "\" v2=\"" + std::to_string(corners[1]) + "\" v3=\"" +
            std::to_string(corners[2]) + "\"";
    if (const Index group = groups.empty() ? kNoIndex : mesh.face_groups.of_face[t]; group != kNoIndex)
      text += " pid=\"1\" p1=\"" + std::to_string(group) + "\"";
    text += "/>\n";
  }
  return text + "</triangles>\n</mesh>\n</object>\n</resources>\n<build>\n<item objectid=\"2\"/>\n</build>\n</model>\n";
}

std::string threemf_bytes(const TriangleMesh& mesh) {
  ZipWriter zip;
  zip.add("[Content_Types].xml",
          "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Types "
          "xmlns=\"http://schemas.openxmlformats.org/package/2006/content-types\"><Default Extension=\"rels\" "
          "ContentType=\"application/vnd.openxmlformats-package.relationships+xml\"/><Default Extension=\"model\" "
          "ContentType=\"application/vnd.ms-package.3dmanufacturing-3dmodel+xml\"/></Types>\n");
  zip.add("_rels/.rels",
          "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Relationships "
          "xmlns=\"http://schemas.openxmlformats.org/package/2006/relationships\"><Relationship Id=\"rel0\" "
          "Target=\"/3D/3dmodel.model\" Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>"
          "</Relationships>\n");
  zip.add("3D/3dmodel.model", model_of(mesh));
  return zip.take();
}

}  // namespace

bool is_surface_output(const std::string& extension) {
  return extension == ".stl" || extension == ".ply" || extension == ".vtp" || extension == ".3mf";
}

std::string surface_bytes(const std::string& extension, const PolygonMesh& surface) {
  require_polygons(surface, "surface");
  if (extension == ".ply") return ply_bytes(surface);
  if (extension == ".vtp") return vtp_text(surface);
  const TriangleMesh triangles = triangulate(surface);
  if (extension == ".3mf") return threemf_bytes(triangles);
  if (extension == ".stl")
    return triangles.face_groups.empty() && !needs_double_precision(triangles) ? binary_stl(triangles)
                                                                               : text_stl(triangles);
  throw InputError("surface_bytes: expected the extension .stl, .ply, .vtp or .3mf, found " + extension);
}

void write_surface(const std::filesystem::path& path, const PolygonMesh& surface) {
  write_file_atomically(path, surface_bytes(lower_case_extension(path), surface));
}

}  // namespace subvol
