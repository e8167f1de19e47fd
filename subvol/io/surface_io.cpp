// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/surface_io.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/length_range.h"
#include "subvol/base/text_scanner.h"
#include "subvol/io/file_formats.h"
#include "subvol/io/sound_points.h"
#include "subvol/io/surface_formats.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>

namespace subvol {

using namespace internal;

namespace fs = std::filesystem;

namespace {

/// Twice a triangle's area, relative to the square of its longest edge: at or below this it has no normal up to
/// rounding.
constexpr double kNoArea = 1e-15;

struct Parser {
  const char* extension;
  ParsedSurface (*parse)(const std::string& name, std::string_view bytes);
};
/// By the extensions of `file_formats()` of surfaces that are read.
constexpr Parser kParsers[] = {{".off", parse_off},   {".obj", parse_obj},  {".stl", parse_stl},  {".ply", parse_ply},
                               {".vtp", parse_vtp},   {".3mf", parse_3mf},  {".glb", parse_gltf}, {".gltf", parse_gltf},
                               {".fbx", parse_scene}, {".dae", parse_scene}};

/// Warnings and errors about one file.
class Remarks {
 public:
  Remarks(std::string name, std::vector<std::string>* warnings) : name_(std::move(name)), warnings_(warnings) {}
  void count(std::size_t n, const char* what, const char* of_one) {
    if (n > 0 && warnings_) warnings_->push_back(name_ + ": " + std::to_string(n) + " " + (n == 1 ? of_one : what));
  }
  void tell(const std::vector<std::string>& remarks) {
    if (!warnings_) return;
    for (const std::string& remark : remarks) warnings_->push_back(name_ + ": " + remark);
  }
  [[noreturn]] void fail(const std::string& message) const { throw InputError(name_ + ": " + message); }

 private:
  std::string name_;
  std::vector<std::string>* warnings_;
};

/// Cuts a polygon that names vertices twice, as one does whose hole is joined to its outline by an edge there and back.
/// Returns no triangles if the corners are no such polygon: they go along an edge twice the same way, or the triangles
/// overlap.
/// sorted  the corners in ascending order
std::vector<std::array<Index, 3>> cut_at_holes(const std::vector<Vec3>& positions, const std::vector<Index>& corners,
                                               std::vector<Index> sorted) {
  constexpr double kMostLostAreaShare = 1e-3;  // share of the area that a polygon may lose by not being flat
  if (corners.size() < 5 || corners.size() > kMaxPolygonCorners) return {};
  std::vector<std::pair<Index, Index>> edges;
  for (std::size_t i = 0; i < corners.size(); ++i) edges.emplace_back(corners[i], corners[(i + 1) % corners.size()]);
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return {};
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  PolygonMesh alone;
  for (const Index v : sorted) alone.positions.push_back(positions[v]);
  for (const Index v : corners)
    alone.face_vertices.push_back(
        static_cast<Index>(std::lower_bound(sorted.begin(), sorted.end(), v) - sorted.begin()));
  alone.face_offsets.push_back(corners.size());
  std::vector<std::array<Index, 3>> triangles;
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (const auto& t : triangulate(alone).triangles) {
    const auto& x = alone.positions;
    const Vec3 of_one = internal::doubled_area_vector(x, t);
    sum += of_one, area += of_one.norm();
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles.push_back({sorted[t[0]], sorted[t[1]], sorted[t[2]]});
  }
  if (!(area > 0 && area <= sum.norm() * (1 + kMostLostAreaShare))) return {};
  return triangles;
}

/// Drops corners that repeat the one before, and then faces that are not polygons. Cuts polygons with holes.
void drop_bad_faces(PolygonMesh& mesh, Remarks& remarks) {
  PolygonMesh kept;
  const std::vector<Index>& of_face = mesh.face_groups.of_face;
  std::size_t num_shortened = 0, num_dropped = 0, num_cut = 0;
  std::vector<Index> corners, sorted;
  for (std::size_t f = 0; f < mesh.num_faces(); ++f) {
    const auto face = mesh.face(f);
    corners.assign(face.begin(), face.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
    sorted = corners;
    std::sort(sorted.begin(), sorted.end());
    const auto keep = [&](std::span<const Index> polygon) {
      if (!of_face.empty()) kept.face_groups.of_face.push_back(of_face[f]);
      kept.face_vertices.insert(kept.face_vertices.end(), polygon.begin(), polygon.end());
      kept.face_offsets.push_back(kept.face_vertices.size());
    };
    const bool names_twice = std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end();
    if (corners.size() > kMaxPolygonCorners && !names_twice)
      remarks.fail("face " + std::to_string(f) + " has " + std::to_string(corners.size()) +
                   " corners, expected at most " + std::to_string(kMaxPolygonCorners));
    std::vector<std::array<Index, 3>> pieces;
    if (names_twice) pieces = cut_at_holes(mesh.positions, corners, sorted);
    if (!pieces.empty()) {
      ++num_cut;
      for (const auto& piece : pieces) keep(piece);
    } else if (corners.size() < 3 || names_twice) {
      ++num_dropped;
    } else {
      num_shortened += corners.size() < face.size();
      keep(corners);
    }
  }
  mesh.face_vertices = std::move(kept.face_vertices);
  mesh.face_offsets = std::move(kept.face_offsets);
  mesh.face_groups.of_face = std::move(kept.face_groups.of_face);
  remarks.count(num_shortened, "faces repeat a corner: the repetition is dropped",
                "face repeats a corner: the repetition is dropped");
  remarks.count(num_dropped, "faces have fewer than three different corners or name one twice: dropped",
                "face has fewer than three different corners or names one twice: dropped");
  remarks.count(num_cut, "polygons with holes are cut into triangles", "polygon with holes is cut into triangles");
  if (mesh.num_faces() == 0)
    remarks.fail(num_dropped == 0 ? "no faces"
                                  : "no usable faces: all " + std::to_string(num_dropped) +
                                        " have fewer than three different corners or name one twice");
}

/// Drops positions that `corners` does not name and renumbers `corners`. Returns the number of dropped positions.
std::size_t drop_unused(std::vector<Vec3>& positions, std::span<Index> corners) {
  std::vector<Index> renumbered(positions.size(), kNoIndex);
  for (const Index v : corners) renumbered[static_cast<std::size_t>(v)] = 0;
  std::size_t kept = 0;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (renumbered[v] == kNoIndex) continue;
    positions[kept] = positions[v];
    renumbered[v] = static_cast<Index>(kept++);
  }
  const std::size_t dropped = positions.size() - kept;
  positions.resize(kept);
  for (Index& v : corners) v = renumbered[static_cast<std::size_t>(v)];
  return dropped;
}

void check_extent(const std::vector<Vec3>& positions, const Remarks& remarks) {
  Vec3 lower = positions.front(), upper = positions.front();
  for (const Vec3& x : positions) {
    if (!x.allFinite()) remarks.fail("a coordinate is not finite");
    lower = lower.cwiseMin(x), upper = upper.cwiseMax(x);
  }
  if (lower == upper) remarks.fail("all vertices are in one place: the bounding box is a point");
  const double largest = std::max(lower.cwiseAbs().maxCoeff(), upper.cwiseAbs().maxCoeff());
  const double extent = (upper - lower).maxCoeff();
  std::string figure;
  append_number(figure, largest > kMostSupportedLength ? largest : extent);
  if (largest > kMostSupportedLength)
    remarks.fail("coordinates up to " + figure + ": areas overflow; scale the surface down");
  if (extent < kLeastSupportedLength)
    remarks.fail("the bounding box is only " + figure + " wide: areas underflow; scale it up");
}

using Triangle = std::array<Index, 3>;

bool has_area(const std::vector<Vec3>& x, const Triangle& t) {
  const Vec3 a = x[t[1]] - x[t[0]], b = x[t[2]] - x[t[0]], c = x[t[2]] - x[t[1]];
  return a.cross(b).norm() > kNoArea * std::max({a.squaredNorm(), b.squaredNorm(), c.squaredNorm()});
}

/// Returns for every vertex a number that it shares with exactly the vertices in the same place.
std::vector<Index> places(const std::vector<Vec3>& x) {
  std::vector<Index> order(x.size()), place(x.size());
  std::iota(order.begin(), order.end(), Index{0});
  const auto before = [&](Index v, Index w) {
    return std::lexicographical_compare(x[v].data(), x[v].data() + 3, x[w].data(), x[w].data() + 3);
  };
  std::sort(order.begin(), order.end(), before);
  for (std::size_t i = 0; i < order.size(); ++i)
    place[order[i]] = i > 0 && !before(order[i - 1], order[i]) ? place[order[i - 1]] : order[i];
  return place;
}

/// Drops the triangles for which is_bad(i) is true, and their groups. Returns the number of dropped triangles.
template <class IsBad>
std::size_t drop_triangles(TriangleMesh& mesh, const IsBad& is_bad) {
  std::vector<Index>& groups = mesh.face_groups.of_face;
  const std::size_t before = mesh.triangles.size();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < before; ++i) {
    if (is_bad(i)) continue;
    mesh.triangles[kept] = mesh.triangles[i];
    if (!groups.empty()) groups[kept] = groups[i];
    ++kept;
  }
  mesh.triangles.resize(kept);
  if (!groups.empty()) groups.resize(kept);
  return before - kept;
}

/// Drops all but the first of triangles with the same three places. Returns the number of dropped triangles.
std::size_t drop_duplicates(TriangleMesh& mesh) {
  const std::vector<Index> place = places(mesh.positions);
  std::vector<std::pair<Triangle, std::size_t>> keys(mesh.triangles.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    for (int j = 0; j < 3; ++j) keys[i].first[j] = place[mesh.triangles[i][j]];
    std::sort(keys[i].first.begin(), keys[i].first.end());
    keys[i].second = i;
  }
  std::sort(keys.begin(), keys.end());
  std::vector<char> duplicate(keys.size(), 0);
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (keys[i].first == keys[i - 1].first) duplicate[keys[i].second] = 1;
  return drop_triangles(mesh, [&](std::size_t i) { return duplicate[i] != 0; });
}

/// Drops all but the first of points in one place. Returns the number of dropped points.
std::size_t drop_repeated(std::vector<Vec3>& points) {
  const std::vector<Index> place = places(points);
  std::vector<Index> first(points.size(), kNoIndex);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    Index& known = first[static_cast<std::size_t>(place[i])];
    if (known != kNoIndex) continue;
    known = static_cast<Index>(i);
    points[kept++] = points[i];
  }
  const std::size_t dropped = points.size() - kept;
  points.resize(kept);
  return dropped;
}

/// Returns what a file holds instead of faces.
std::string why_no_faces(const ParsedSurface& parsed) {
  std::string text = "no faces";
  if (!parsed.mesh.positions.empty())
    text += ", only " + std::to_string(parsed.mesh.positions.size()) + " vertices (points are read from " +
            point_cloud_formats() + ")";
  for (const std::string& warning : parsed.warnings) text += "; " + warning;
  return text;
}

}  // namespace

PolygonMesh read_polygon_mesh(const fs::path& path, std::vector<std::string>* warnings) {
  const std::string extension = lower_case(path.extension().string());
  const auto* parser =
      std::find_if(std::begin(kParsers), std::end(kParsers), [&](const Parser& p) { return extension == p.extension; });
  if (parser == std::end(kParsers))
    throw InputError(path.string() + ": " + unknown_extension(path) + "; expected a surface: " + surface_formats());
  Remarks remarks(path.string(), warnings);
  ParsedSurface parsed = parser->parse(path.string(), read_file(path));
  if (parsed.mesh.num_faces() == 0) remarks.fail(why_no_faces(parsed));
  remarks.tell(parsed.warnings);
  make_names_utf8(parsed.mesh.face_groups.groups);
  return sound_polygons(std::move(parsed.mesh), path.string(), warnings);
}

namespace {

/// Refuses a surface of which a vertex is so far away that the rest is a point beside it: a digit was lost, or a
/// coordinate was never set.
void check_stray_vertices(const std::vector<Vec3>& positions, const Remarks& remarks) {
  constexpr double kStrayDistanceFactor = 1e6;  // times the distance of most vertices
  constexpr double kUsualVertexShare = 0.75;    // they lie within the usual distance
  const auto place = static_cast<std::ptrdiff_t>(kUsualVertexShare * static_cast<double>(positions.size() - 1));
  std::vector<double> values(positions.size());
  Vec3 middle;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t v = 0; v < positions.size(); ++v) values[v] = positions[v][axis];
    const auto median = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), median, values.end());
    middle[axis] = *median;
  }
  for (std::size_t v = 0; v < positions.size(); ++v) values[v] = (positions[v] - middle).stableNorm();
  const auto farthest = static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
  const double largest = values[farthest];
  std::nth_element(values.begin(), values.begin() + place, values.end());
  const double usual = values[static_cast<std::size_t>(place)];
  if (!(usual > 0) || largest <= kStrayDistanceFactor * usual) return;
  std::string place_text;
  for (int axis = 0; axis < 3; ++axis) {
    place_text += axis == 0 ? "" : ", ";
    append_number(place_text, positions[farthest][axis]);
  }
  remarks.fail("the vertex at (" + place_text + ") is " + formatted("%.2g", largest / usual) +
               " times as far from the middle as three quarters of the vertices are: is a coordinate wrong?");
}

}  // namespace

PolygonMesh sound_polygons(PolygonMesh mesh, const std::string& name, std::vector<std::string>* warnings) {
  Remarks remarks(name, warnings);
  drop_bad_faces(mesh, remarks);
  remarks.count(drop_unused(mesh.positions, mesh.face_vertices), "vertices belong to no face: dropped",
                "vertex belongs to no face: dropped");
  check_extent(mesh.positions, remarks);
  check_stray_vertices(mesh.positions, remarks);
  return mesh;
}

TriangleMesh read_triangle_mesh(const fs::path& path, std::vector<std::string>* warnings) {
  return sound_triangles(read_polygon_mesh(path, warnings), path.string(), warnings);
}

TriangleMesh sound_triangles(const PolygonMesh& polygons, const std::string& name, std::vector<std::string>* warnings) {
  Remarks remarks(name, warnings);
  TriangleMesh mesh = triangulate(polygons);
  const std::size_t num_flat =
      drop_triangles(mesh, [&](std::size_t i) { return !has_area(mesh.positions, mesh.triangles[i]); });
  remarks.count(num_flat, "triangles have no area: dropped", "triangle has no area: dropped");
  remarks.count(drop_duplicates(mesh), "triangles are there more than once: the first is kept",
                "triangle is there more than once: the first is kept");
  if (mesh.triangles.empty()) remarks.fail("no triangle has any area");
  drop_unused(mesh.positions, {mesh.triangles.front().data(), 3 * mesh.triangles.size()});
  return mesh;
}

bool is_point_cloud_file(const fs::path& path) {
  const std::string extension = lower_case(path.extension().string());
  return extension == ".xyz" || (extension == ".ply" && !ply_has_faces(path.string(), read_file(path)));
}

PointCloud read_point_cloud(const fs::path& path, std::vector<std::string>* warnings) {
  const std::string extension = lower_case(path.extension().string());
  Remarks remarks(path.string(), warnings);
  PointCloud cloud;
  if (extension == ".xyz") {
    std::size_t longer_lines = 0;
    cloud.points = parse_xyz(path.string(), read_file(path), longer_lines);
    remarks.count(longer_lines, "lines have more than three columns: the rest is skipped",
                  "line has more than three columns: the rest is skipped");
  } else if (extension == ".ply") {
    ParsedSurface parsed = parse_ply(path.string(), read_file(path));
    remarks.tell(parsed.warnings);
    PolygonMesh& mesh = parsed.mesh;
    remarks.count(mesh.num_faces(), "faces are skipped: only the points are read",
                  "face is skipped: only the points are read");
    cloud.points = std::move(mesh.positions);
  } else {
    remarks.fail(unknown_extension(path) + "; expected points: " + point_cloud_formats());
  }
  return sound_points(std::move(cloud.points), path.string(), warnings);
}

PointCloud internal::sound_points(std::vector<Vec3> points, const std::string& name,
                                  std::vector<std::string>* warnings) {
  Remarks remarks(name, warnings);
  if (points.empty()) remarks.fail("no points");
  check_extent(points, remarks);
  remarks.count(drop_repeated(points), "points are there more than once: the first is kept",
                "point is there more than once: the first is kept");
  if (points.size() < kLeastCloudPoints)
    remarks.fail("only " + std::to_string(points.size()) + " points, expected at least " +
                 std::to_string(kLeastCloudPoints));
  return {std::move(points)};
}

std::vector<double> read_vertex_attribute(const fs::path& path, const std::string& attribute) {
  if (lower_case(path.extension().string()) != ".ply")
    throw InputError(path.string() + ": only .ply files have vertex properties");
  return parse_ply_attribute(path.string(), read_file(path), attribute);
}

bool is_surface_extension(const std::string& extension) {
  const FileFormat* format = format_of_extension(extension);
  return format && !format->holds_cells && !format->read.empty();
}

std::string surface_formats() { return readable_formats(false); }

std::string point_cloud_formats() { return ".xyz, or .ply without faces"; }

}  // namespace subvol
