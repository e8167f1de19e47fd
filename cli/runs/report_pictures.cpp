// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/report_pictures.h"

#include "cli/runs/scene_chord.h"
#include "subvol/base/error.h"
#include "subvol/base/sort_unique.h"
#include "subvol/export/curved_file.h"
#include "subvol/export/cutaway.h"
#include "subvol/export/export.h"
#include "subvol/export/high_order_file.h"
#include "subvol/export/raster.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/surface/boundary.h"

#include <png.h>

#include <algorithm>
#include <cstdio>
#include <optional>

namespace subvol::cli {

using namespace internal;
namespace {

constexpr int kPictureWidth = 720, kPictureHeight = 540;
/// Edges are drawn on boundaries of at most this many faces: on finer ones they would hide everything else.
constexpr std::size_t kMostWiredFaces = 6000;

std::string png_bytes(const Image& image) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_RGBA;
  png_alloc_size_t size = 0;
  if (!png_image_write_to_memory(&header, nullptr, &size, 0, image.pixels.data(), 0, nullptr))
    throw std::runtime_error(std::string("libpng: ") + header.message);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&header, bytes.data(), &size, 0, image.pixels.data(), 0, nullptr))
    throw std::runtime_error(std::string("libpng: ") + header.message);
  bytes.resize(size);
  return bytes;
}

/// A boundary to draw, and the least quality of the cells at each of its points.
struct Shown {
  TriangleMesh triangles;
  std::vector<double> quality;
  std::vector<std::array<Index, 2>> wires;
  std::size_t num_cells = 0;
};

/// Least value of the faces around each vertex of triangles.
std::vector<double> at_vertices(const TriangleMesh& mesh, const std::vector<Index>& faces,
                                const std::vector<double>& face_values) {
  std::vector<double> values(mesh.positions.size(), 1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const Index v : mesh.triangles[t]) values[v] = std::min(values[v], face_values[faces[t]]);
  return values;
}

std::vector<double> boundary_minima(const MeshTopology& topology, const std::vector<double>& cell_minima) {
  std::vector<double> minima;
  for (const Index f : topology.boundary_faces()) minima.push_back(cell_minima[topology.face_cells(f)[0]]);
  return minima;
}

Shown shown(const VolumeMesh& mesh) {
  require_boundary(mesh);
  const MeshTopology topology(mesh);
  const PolygonMesh boundary = boundary_surface(mesh, topology);
  Shown result;
  std::vector<Index> faces;
  result.triangles = fan_triangles(boundary, &faces);
  result.quality = at_vertices(result.triangles, faces, boundary_minima(topology, measure_quality(mesh).cell_minima));
  result.num_cells = mesh.num_cells();
  if (boundary.num_faces() > kMostWiredFaces) return result;
  for (std::size_t f = 0; f < boundary.num_faces(); ++f)
    for (std::size_t begin = boundary.face_offsets[f], end = boundary.face_offsets[f + 1], k = begin; k < end; ++k)
      result.wires.push_back({boundary.face_vertices[k], boundary.face_vertices[k + 1 < end ? k + 1 : begin]});
  return result;
}

Shown shown(const HighOrderMesh& mesh) {
  CurvedBoundary boundary = curved_boundary(mesh, kSceneChordPercent);
  Shown result;
  result.quality = at_vertices(boundary.triangles, boundary.faces,
                               boundary_minima(mesh.space.topology(), measure_quality(mesh).cell_minima));
  result.triangles = std::move(boundary.triangles);
  result.num_cells = mesh.space.num_cells();
  return result;
}

Shown shown(const PolygonMesh& surface) {
  Shown result;
  result.triangles = triangulate(surface);
  return result;
}

Shown shown(const ShownMesh& mesh) {
  if (const auto* file = std::get_if<HighOrderFile>(&mesh)) return shown(file->mesh);
  if (const auto* surface = std::get_if<PolygonMesh>(&mesh)) return shown(*surface);
  return shown(std::get<VolumeMesh>(mesh));
}

/// Scaled Jacobians of the cells; empty for a surface.
std::vector<double> cell_minima(const ShownMesh& mesh) {
  if (const auto* cells = std::get_if<VolumeMesh>(&mesh)) return measure_quality(*cells).cell_minima;
  if (const auto* file = std::get_if<HighOrderFile>(&mesh)) return measure_quality(file->mesh).cell_minima;
  return {};
}

/// Triangles, colors and lines of a scene.
RasterSurface drawn(const Scene& scene) {
  RasterSurface surface;
  for (const SceneNode& node : scene.nodes) {
    const ScenePrimitive& primitive = node.primitive;
    const auto first = static_cast<Index>(surface.mesh.positions.size());
    surface.mesh.positions.insert(surface.mesh.positions.end(), primitive.positions.begin(), primitive.positions.end());
    for (std::size_t v = 0; v < primitive.positions.size(); ++v)
      surface.colors.push_back(primitive.colors.empty() ? LinearColor{0, 0, 0, 1} : primitive.colors[v]);
    const std::vector<Index>& i = primitive.indices;
    if (primitive.topology == ScenePrimitive::Topology::lines)
      for (std::size_t k = 0; k + 1 < i.size(); k += 2) surface.wires.push_back({first + i[k], first + i[k + 1]});
    else
      for (std::size_t k = 0; k + 2 < i.size(); k += 3)
        surface.mesh.triangles.push_back({first + i[k], first + i[k + 1], first + i[k + 2]});
  }
  return surface;
}

/// A number between 0 and 1 for each cell that tells regions apart; empty if there are not several.
std::vector<double> region_shades(const ShownMesh& mesh) {
  std::vector<int> of_cell;
  if (const auto* cells = std::get_if<VolumeMesh>(&mesh)) of_cell = cells->references;
  if (const auto* file = std::get_if<HighOrderFile>(&mesh)) of_cell = file->references;
  std::vector<int> all = of_cell;
  sort_unique(all);
  std::vector<double> shades;
  if (all.size() < 2) return shades;
  for (const int reference : of_cell)
    shades.push_back((static_cast<double>(std::ranges::lower_bound(all, reference) - all.begin()) + 0.5) /
                     static_cast<double>(all.size()));
  return shades;
}

/// The cells up to a plane, from the side from which the section is seen, in colors of the viridis map.
/// shades: of each cell, in [0, 1].
RasterSurface cut_open(const ShownMesh& mesh, const RasterView& view, const std::vector<double>& shades) {
  CutPlane plane;
  Eigen::Index axis = 0;
  view.towards_viewer.cwiseAbs().maxCoeff(&axis);  // across the line of sight, as far as an axis is
  plane.axis = static_cast<int>(axis);
  SurfaceSceneOptions options;
  options.wireframe = shades.size() <= kMostWiredFaces;
  if (const auto* file = std::get_if<HighOrderFile>(&mesh))
    return drawn(cutaway_scene(file->mesh, shades, plane, options));
  return drawn(cutaway_scene(std::get<VolumeMesh>(mesh), shades, plane, options));
}

/// Draws the pictures of one report.
class Painter {
 public:
  Painter(const Json& report, const ReportMeshes& meshes, std::vector<std::string>& notes)
      : report_(report), meshes_(meshes), notes_(notes) {}

  std::vector<ReportPicture> run() {
    std::optional<Shown> target, before, result;
    if (meshes_.target) attempt([&] { target = shown(*meshes_.target); });
    if (meshes_.before) attempt([&] { before = shown(*meshes_.before); });
    if (meshes_.result) attempt([&] { result = shown(*meshes_.result); });
    const Shown* first = target ? &*target : result ? &*result : before ? &*before : nullptr;
    if (!first) return {};
    view_ = view_of(first->triangles.positions);
    if (target) add("Surface", *target, {});
    if (before) add("Before: the mesh given", *before, {});
    if (result && target && !report_.value("limit_surface_distance", report_.value("distance", Json())).is_null())
      attempt([&] { add_distance(*result, *target); });
    if (result && !result->quality.empty()) {
      if (meshes_.cage)
        attempt([&] { add_limit(*meshes_.cage); });
      else
        add_quality(*result);
      attempt([&] {
        add("Result, cut open: scaled Jacobian of the cells",
            cut_open(*meshes_.result, view_, cell_minima(*meshes_.result)), "0", "1");
      });
      if (const std::vector<double> shades = region_shades(*meshes_.result); !shades.empty())
        attempt([&] {
          add("Result, cut open: regions", cut_open(*meshes_.result, view_, shades), "first region", "last region");
        });
    }
    return std::move(pictures_);
  }

 private:
  /// Draws one picture; a mesh with defects may have no boundary or no inside to draw.
  template <class Draw>
  void attempt(const Draw& draw) {
    try {
      draw();
    } catch (const InputError& error) {
      notes_.push_back(std::string("not shown: ") + error.what());
    }
  }

  void add(const std::string& title, const RasterSurface& surface, std::string low, std::string high) {
    pictures_.push_back(
        {title, png_bytes(rasterize(surface, view_, kPictureWidth, kPictureHeight)), std::move(low), std::move(high)});
  }

  void add(const std::string& title, const Shown& what, std::vector<LinearColor> colors, std::string low = {},
           std::string high = {}) {
    add(title, RasterSurface{what.triangles, std::move(colors), what.wires}, std::move(low), std::move(high));
  }

  /// The limit surface of the cage that was found, with the edges of its faces.
  void add_limit(const VolumeMesh& cage) {
    SurfaceSceneOptions options;
    options.max_chord_percent = kSceneChordPercent;
    const VolumeMesh* finest = std::get_if<VolumeMesh>(&*meshes_.result);
    add("Result, limit surface: scaled Jacobian of the cells below it", drawn(surface_scene(cage, finest, options)),
        "0", "1");
  }

  void add_quality(const Shown& result) {
    std::vector<LinearColor> colors;
    for (const double value : result.quality) colors.push_back(quality_color(value));
    add("Result: scaled Jacobian of the cells", result, std::move(colors), "0", "1");
  }

  void add_distance(const Shown& result, const Shown& target) {
    const std::vector<Vec3>& x = result.triangles.positions;
    std::vector<ClosestPoint::Hit> hits(x.size());
    ClosestPoint(target.triangles).closest(x, hits);
    double most = 0;
    for (const auto& hit : hits) most = std::max(most, hit.distance);
    std::vector<LinearColor> colors;
    for (const auto& hit : hits) colors.push_back(quality_color(most > 0 ? std::max(1e-9, hit.distance / most) : 1e-9));
    const Json input = report_.at("input").value("target", Json::object());
    const double diagonal = input.value("bounding_box_diagonal", 0.0);
    char high[64];
    std::snprintf(high, sizeof high, diagonal > 0 ? "%.3g %%" : "%.3g", diagonal > 0 ? 100 * most / diagonal : most);
    add("Result: distance to the surface", result, std::move(colors), "0", high);
  }

  const Json& report_;
  const ReportMeshes& meshes_;
  std::vector<std::string>& notes_;
  RasterView view_;
  std::vector<ReportPicture> pictures_;
};

}  // namespace

std::vector<ReportPicture> report_pictures(const Json& report, const ReportMeshes& meshes,
                                           std::vector<std::string>& notes) {
  return Painter(report, meshes, notes).run();
}

}  // namespace subvol::cli
