// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/usd_writer.h"

#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/version.h"
#include "subvol/export/text_format.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>

namespace subvol {

using namespace internal;
namespace {

/// A run of crease edges of one sharpness; it is closed if the last vertex is the first.
struct Chain {
  std::vector<Index> vertices;
  double sharpness;
};

/// Joins the edges of one sharpness into chains, starting at the smallest vertex numbers.
class ChainBuilder {
 public:
  ChainBuilder(const std::vector<CreaseEdge>& edges, double sharpness) : sharpness_(sharpness) {
    for (const CreaseEdge& edge : edges)
      if (edge.sharpness == sharpness) {
        neighbors_[edge.v0].insert(edge.v1);
        neighbors_[edge.v1].insert(edge.v0);
      }
    for (const auto& [vertex, others] : neighbors_)
      if (others.size() != 2) ends_.insert(vertex);
  }

  void append_to(std::vector<Chain>& chains) {
    for (const Index end : ends_)
      while (!neighbors_[end].empty()) chains.push_back(walk(end));
    for (auto& [vertex, others] : neighbors_)  // only loops are left
      if (!others.empty()) chains.push_back(walk(vertex));
  }

 private:
  Chain walk(Index vertex) {
    Chain chain{{vertex}, sharpness_};
    do {
      const Index next = *neighbors_[vertex].begin();
      neighbors_[vertex].erase(next);
      neighbors_[next].erase(vertex);
      chain.vertices.push_back(next);
      vertex = next;
    } while (!ends_.contains(vertex) && !neighbors_[vertex].empty());
    return chain;
  }

  double sharpness_;
  std::map<Index, std::set<Index>> neighbors_;
  std::set<Index> ends_;
};

std::vector<Chain> crease_chains(const FeatureTags& tags) {
  std::set<double, std::greater<>> sharpnesses;
  for (const CreaseEdge& edge : tags.creases) sharpnesses.insert(edge.sharpness);
  std::vector<Chain> chains;
  for (const double sharpness : sharpnesses) ChainBuilder(tags.creases, sharpness).append_to(chains);
  return chains;
}

void require_tags(const PolygonMesh& cage, const FeatureTags& tags) {
  std::set<std::pair<Index, Index>> edges;
  if (!tags.creases.empty())
    for (std::size_t f = 0; f < cage.num_faces(); ++f)
      for (std::size_t begin = cage.face_offsets[f], end = cage.face_offsets[f + 1], k = begin; k < end; ++k)
        edges.insert(std::minmax(cage.face_vertices[k], cage.face_vertices[k + 1 < end ? k + 1 : begin]));
  for (const CreaseEdge& edge : tags.creases) {
    const std::string where = "usd: crease " + std::to_string(edge.v0) + " " + std::to_string(edge.v1);
    if (!edges.contains(std::minmax(edge.v0, edge.v1))) throw InputError(where + ": expected an edge of the cage");
    if (!(edge.sharpness > 0)) throw InputError(where + ": expected a sharpness above 0");
  }
  for (const CornerVertex& corner : tags.corners) {
    const std::string where = "usd: corner " + std::to_string(corner.vertex);
    if (corner.vertex < 0 || static_cast<std::size_t>(corner.vertex) >= cage.positions.size())
      throw InputError(where + ": expected a vertex of the cage");
    if (!(corner.sharpness > 0)) throw InputError(where + ": expected a sharpness above 0");
  }
}

void require_options(const UsdOptions& options) {
  const auto letter = [](unsigned char c) { return (c | 32) >= 'a' && (c | 32) <= 'z'; };
  const auto inside = [&](unsigned char c) { return letter(c) || c == '_' || (c >= '0' && c <= '9'); };
  const std::string& name = options.name;
  if (name.empty() || !inside(name[0]) || (name[0] >= '0' && name[0] <= '9') ||
      !std::all_of(name.begin(), name.end(), inside))
    throw InputError("usd: name \"" + name + "\": expected letters, digits and underscores, no digit first");
  if (!(options.meters_per_unit > 0) || !std::isfinite(options.meters_per_unit))
    throw InputError("usd: meters_per_unit: expected a positive number");
}

/// Appends one attribute line: `    type name = [a, b, ...]`.
template <class Range, class Append>
void append_array(std::string& text, const char* declaration, const Range& values, Append append) {
  text += std::string("    ") + declaration + " = [";
  bool first = true;
  for (const auto& value : values) {
    if (!first) text += ", ";
    first = false;
    append(value);
  }
  text += "]\n";
}

/// The offset subtracted from the points, which USD keeps in single precision; a transform adds it again, in double.
/// Zero unless the cage is much farther from the origin than it is large.
Vec3 origin_of(const Vec3& low, const Vec3& high) {
  constexpr double kFarOriginRatio = 8;
  const double reach = std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff());
  return reach > kFarOriginRatio * (high - low).maxCoeff() ? Vec3(low + 0.5 * (high - low)) : Vec3::Zero();
}

/// Points of a prim, and the box around them.
class PlacedPoints {
 public:
  explicit PlacedPoints(const std::vector<Vec3>& points) : points_(points), low_(points[0]), high_(points[0]) {
    for (const Vec3& p : points) low_ = low_.cwiseMin(p), high_ = high_.cwiseMax(p);
    origin_ = origin_of(low_, high_);
  }

  void append_place(std::string& text) const {
    if (!origin_.isZero(0)) {
      text += "    double3 xformOp:translate = ";
      append_point(text, origin_);
      text += "\n    uniform token[] xformOpOrder = [\"xformOp:translate\"]\n";
    }
    append_placed(text, "float3[] extent", {low_, high_});
  }
  void append_points(std::string& text) const { append_placed(text, "point3f[] points", points_); }

 private:
  static void append_point(std::string& text, const Vec3& p) {
    text += '(';
    append_vector(text, p, ", ");
    text += ')';
  }
  void append_placed(std::string& text, const char* declaration, const std::vector<Vec3>& points) const {
    append_array(text, declaration, points, [&](const Vec3& p) {
      if (!(p - origin_).cast<float>().allFinite())
        throw InputError("usd: positions: expected coordinates in the range of float32");
      append_point(text, p - origin_);
    });
  }

  const std::vector<Vec3>& points_;
  Vec3 low_, high_, origin_;
};

void append_geometry(std::string& text, const PolygonMesh& cage) {
  const auto number = [&](auto value) { append_number(text, value); };
  const PlacedPoints points(cage.positions);
  points.append_place(text);
  std::vector<std::size_t> counts;
  for (std::size_t f = 0; f < cage.num_faces(); ++f) counts.push_back(cage.face_offsets[f + 1] - cage.face_offsets[f]);
  append_array(text, "int[] faceVertexCounts", counts, number);
  append_array(text, "int[] faceVertexIndices", cage.face_vertices, number);
  points.append_points(text);
}

/// Appends the cells as a TetMesh, with the boundary facing outward.
void append_tets(std::string& text, const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  const auto tuple = [&](std::span<const Index> corners) {
    text += '(';
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (i > 0) text += ", ";
      append_number(text, corners[i]);
    }
    text += ')';
  };
  std::vector<std::span<const Index>> cells, faces;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) cells.push_back(mesh.cell(c));
  for (const Index f : topology.boundary_faces()) faces.push_back(topology.face(f));
  const PlacedPoints points(mesh.positions);
  text += "\ndef TetMesh \"cells\"\n{\n";
  points.append_place(text);
  points.append_points(text);
  append_array(text, "int3[] surfaceFaceVertexIndices", faces, tuple);
  append_array(text, "int4[] tetVertexIndices", cells, tuple);
  text += "    uniform token orientation = \"rightHanded\"\n}\n";
}

void append_tags(std::string& text, const FeatureTags& tags) {
  const auto number = [&](auto value) { append_number(text, value); };
  std::vector<Index> indices, corners;
  std::vector<std::size_t> lengths;
  std::vector<double> sharpnesses, corner_sharpnesses;
  for (const Chain& chain : crease_chains(tags)) {
    indices.insert(indices.end(), chain.vertices.begin(), chain.vertices.end());
    lengths.push_back(chain.vertices.size());
    sharpnesses.push_back(std::min(chain.sharpness, kInfiniteSharpness));
  }
  for (const CornerVertex& corner : tags.corners) {
    corners.push_back(corner.vertex);
    corner_sharpnesses.push_back(std::min(corner.sharpness, kInfiniteSharpness));
  }
  append_array(text, "int[] creaseIndices", indices, number);
  append_array(text, "int[] creaseLengths", lengths, number);
  append_array(text, "float[] creaseSharpnesses", sharpnesses, number);
  append_array(text, "int[] cornerIndices", corners, number);
  append_array(text, "float[] cornerSharpnesses", corner_sharpnesses, number);
}

/// Returns a name as USD allows it for a prim: letters, digits and underscores, no digit first, none twice.
std::string prim_name(const std::string& name, std::set<std::string>& taken) {
  std::string plain;
  for (const char c : name) {
    const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    plain += is_letter || (c >= '0' && c <= '9') ? c : '_';
  }
  if (plain.empty() || (plain[0] >= '0' && plain[0] <= '9')) plain = '_' + plain;
  std::string unique = plain;
  for (int n = 2; !taken.insert(unique).second; ++n) unique = plain + '_' + std::to_string(n);
  return unique;
}

/// Returns a text in quotes.
std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  return result + '"';
}

/// Appends a GeomSubset for each group that has faces.
void append_groups(std::string& text, const FaceGroups& groups) {
  if (groups.empty()) return;
  text += "    uniform token subsetFamily:group:familyType = \"nonOverlapping\"\n";
  std::vector<std::vector<std::size_t>> faces(groups.groups.size());
  for (std::size_t f = 0; f < groups.of_face.size(); ++f)
    if (groups.of_face[f] != kNoIndex) faces[groups.of_face[f]].push_back(f);
  std::set<std::string> taken;
  for (std::size_t g = 0; g < faces.size(); ++g) {
    if (faces[g].empty()) continue;
    const Group& group = groups.groups[g];
    text += "\n    def GeomSubset \"" + prim_name(label_of(group), taken) +
            "\" (\n        customData = {\n            string name = " + quoted(group.name) +
            "\n            int number = " + std::to_string(group.number) + "\n        }\n    )\n    {\n" +
            "        uniform token elementType = \"face\"\n        uniform token familyName = \"group\"\n    ";
    append_array(text, "int[] indices", faces[g], [&](std::size_t f) { append_number(text, f); });
    text += "    }\n";
  }
}

}  // namespace

bool consists_of_tets(const VolumeMesh& mesh) {
  return mesh.num_cells() > 0 && std::ranges::all_of(mesh.kinds, [](CellKind kind) { return kind == CellKind::tet; });
}

std::string usd_text(const PolygonMesh& cage, const FeatureTags& tags, const UsdOptions& options) {
  require_options(options);
  require_polygons(cage, "usd");
  require_tags(cage, tags);
  if (options.tets && !consists_of_tets(*options.tets)) throw InputError("usd: TetMesh: expected tets alone");
  std::string text = "#usda 1.0\n(\n    defaultPrim = \"" + options.name + "\"\n    doc = \"subvol " + version() +
                     "\"\n    metersPerUnit = ";
  append_number(text, options.meters_per_unit);
  text += std::string("\n    upAxis = \"") + (options.up_axis == UpAxis::y ? "Y" : "Z") + "\"\n)\n\ndef Mesh \"" +
          options.name + "\"\n{\n";
  append_geometry(text, cage);
  text +=
      "    uniform token subdivisionScheme = \"catmullClark\"\n"
      "    token interpolateBoundary = \"edgeAndCorner\"\n"
      "    token triangleSubdivisionRule = \"catmullClark\"\n"
      "    uniform token orientation = \"rightHanded\"\n";
  append_tags(text, tags);
  append_groups(text, cage.face_groups);
  text += "}\n";
  if (options.tets) append_tets(text, *options.tets);
  return text;
}

void write_usd(const std::filesystem::path& path, const PolygonMesh& cage, const FeatureTags& tags,
               const UsdOptions& options) {
  if (lower_case_extension(path) != ".usda") throw InputError(path.string() + ": expected the extension .usda");
  write_file_atomically(path, usd_text(cage, tags, options));
}

}  // namespace subvol
