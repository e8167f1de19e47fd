// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/text_scanner.h"
#include "subvol/export/surface_writer.h"
#include "subvol/export/text_format.h"
#include "subvol/export/written_file.h"
#include "subvol/surface/boundary.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace subvol::internal {
namespace {

/// tolerance  largest difference of coordinates.
void compare_polygons(const WrittenFile& file, const PolygonMesh& found, const PolygonMesh& wanted, double tolerance) {
  file.same_count("vertices", found.positions.size(), wanted.positions.size());
  file.same_count("faces", found.num_faces(), wanted.num_faces());
  for (std::size_t v = 0; v < wanted.positions.size(); ++v)
    file.same((found.positions[v] - wanted.positions[v]).cwiseAbs().maxCoeff() <= tolerance, "vertex", v);
  for (std::size_t f = 0; f < wanted.num_faces(); ++f)
    file.same(found.face_offsets[f + 1] == wanted.face_offsets[f + 1], "the number of corners of face", f);
  file.same_count("corners of faces", found.face_vertices.size(), wanted.face_vertices.size());
  for (std::size_t k = 0; k < wanted.face_vertices.size(); ++k)
    file.same(found.face_vertices[k] == wanted.face_vertices[k], "corner", k);
}

/// Reads the polygons as written: none is dropped, unlike in the reader for other programs' files.
PolygonMesh obj_polygons(const WrittenFile& file) {
  const std::string bytes = read_file(file.path());
  TextScanner lines(file.path().string(), bytes, TextScanner::Comments::none);
  PolygonMesh mesh;
  while (const auto line = lines.line()) {
    if (!line->starts_with("v ") && !line->starts_with("f ")) continue;
    TextScanner words(file.path().string(), line->substr(1));
    if ((*line)[0] == 'v') {
      const double x = words.number("x"), y = words.number("y");
      mesh.positions.emplace_back(x, y, words.number("z"));
      continue;
    }
    while (words.peek()) mesh.face_vertices.push_back(static_cast<Index>(words.integer("a vertex") - 1));
    mesh.face_offsets.push_back(mesh.face_vertices.size());
  }
  return mesh;
}

/// Reads the numbers of a value of a .usda: an array, or a tuple, which ends at the first closing bracket.
std::vector<double> usda_numbers(const WrittenFile& file, const std::string& bytes, const std::string& declaration,
                                 const std::string& brackets = "[]") {
  const std::string opening = "\n    " + declaration + " = " + brackets[0];  // not within a name of a group
  const std::size_t begin = bytes.find(opening), end = bytes.find(brackets[1], begin + opening.size());
  if (begin == std::string::npos || end == std::string::npos) file.differs("there is no " + declaration);
  std::string numbers = bytes.substr(begin + opening.size(), end - begin - opening.size());
  std::replace_if(
      numbers.begin(), numbers.end(), [](char c) { return c == '(' || c == ')' || c == ','; }, ' ');
  TextScanner scan(file.path().string(), numbers);
  std::vector<double> values;
  while (scan.peek()) values.push_back(scan.number("a number"));
  return values;
}

/// origin  receives the translation that the file adds to its points.
PolygonMesh usda_polygons(const WrittenFile& file, Vec3& origin) {
  const std::string bytes = read_file(file.path());
  PolygonMesh mesh;
  const std::vector<double> points = usda_numbers(file, bytes, "point3f[] points");
  origin = Vec3::Zero();
  const std::string translate = "double3 xformOp:translate";
  if (bytes.find("\n    " + translate + " = ") != std::string::npos) {
    const std::vector<double> value = usda_numbers(file, bytes, translate, "()");
    file.same_count("coordinates of the translation", value.size(), 3);
    origin = Vec3(value.data());
  }
  for (std::size_t i = 0; i + 2 < points.size(); i += 3) mesh.positions.emplace_back(origin + Vec3(&points[i]));
  for (const double count : usda_numbers(file, bytes, "int[] faceVertexCounts"))
    mesh.face_offsets.push_back(mesh.face_offsets.back() + static_cast<std::size_t>(count));
  for (const double vertex : usda_numbers(file, bytes, "int[] faceVertexIndices"))
    mesh.face_vertices.push_back(static_cast<Index>(vertex));
  return mesh;
}

/// Compares the coordinates of a binary file; those of text are the numbers themselves.
void compare_binary_stl(const WrittenFile& file, const std::string& bytes, const TriangleMesh& wanted) {
  constexpr std::size_t kHeaderBytes = 84, kFacetBytes = 50, kVertexBytes = 12;
  Eigen::AlignedBox3d box;
  for (const auto& triangle : wanted.triangles)
    for (const Index v : triangle) box.extend(wanted.positions[static_cast<std::size_t>(v)]);
  const double tolerance = kMostReadBackErrorShare * box.sizes().maxCoeff();
  file.same_count("bytes", bytes.size(), kHeaderBytes + kFacetBytes * wanted.triangles.size());
  for (std::size_t t = 0; t < wanted.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t j = 0; j < 3; ++j) {
        float x = 0;
        std::memcpy(&x, bytes.data() + kHeaderBytes + kFacetBytes * t + kVertexBytes * (k + 1) + j * sizeof x,
                    sizeof x);
        const double error =
            x - wanted.positions[static_cast<std::size_t>(wanted.triangles[t][k])][static_cast<int>(j)];
        file.same(std::abs(error) <= tolerance, "the corners of triangle", t);
      }
}

}  // namespace

void compare_surface(const WrittenFile& file, const PolygonMesh& wanted) {
  const std::string extension = lower_case_extension(file.path());
  if (is_surface_output(extension)) {
    const std::string bytes = read_file(file.path());
    if (bytes != surface_bytes(extension, wanted)) file.differs("its bytes are not what was written");
    if (extension == ".stl" && !bytes.starts_with("solid ")) compare_binary_stl(file, bytes, triangulate(wanted));
    return;
  }
  Vec3 origin = Vec3::Zero();
  const PolygonMesh found = extension == ".obj" ? obj_polygons(file) : usda_polygons(file, origin);
  // Subtracting the translation and adding it again rounds twice.
  constexpr double kTranslationRounding = 4 * std::numeric_limits<double>::epsilon();
  double reach = 0;
  for (const Vec3& p : wanted.positions) reach = std::max(reach, p.cwiseAbs().maxCoeff());
  compare_polygons(file, found, wanted, origin.isZero(0) ? 0 : kTranslationRounding * reach);
}

}  // namespace subvol::internal
