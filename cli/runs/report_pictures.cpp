// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/report_pictures.h"

#include "cli/runs/loading.h"
#include "subvol/base/error.h"
#include "subvol/export/curved_file.h"
#include "subvol/export/export.h"
#include "subvol/export/high_order_file.h"
#include "subvol/export/raster.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/io/mesh_io.h"
#include "subvol/surface/boundary.h"

#include <png.h>

#include <algorithm>
#include <cstdio>
#include <optional>

namespace subvol::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 720, kHeight = 540;
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
  constexpr double kChordPercent = 0.05;
  CurvedBoundary boundary = curved_boundary(mesh, kChordPercent);
  Shown result;
  result.quality = at_vertices(boundary.triangles, boundary.faces,
                               boundary_minima(mesh.space.topology(), measure_quality(mesh).cell_minima));
  result.triangles = std::move(boundary.triangles);
  result.num_cells = mesh.space.num_cells();
  return result;
}

/// The file that a report names, relative to the current folder or to that of the report.
fs::path find_file(const std::string& name, const fs::path& folder) {
  std::error_code ignored;
  return fs::exists(name, ignored) ? fs::path(name) : folder / name;
}

Shown load_shown(const fs::path& path) {
  std::vector<std::string> warnings;
  if (is_high_order_file(path)) return shown(read_curved(path).mesh);
  if (is_volume_file(path)) return shown(load_volume(path, warnings));
  Shown result;
  result.triangles = load_surface(path, warnings);
  return result;
}

/// Draws the pictures of one report.
class Painter {
 public:
  Painter(const Json& report, fs::path folder, std::vector<std::string>& notes)
      : report_(report), folder_(std::move(folder)), notes_(notes) {}

  std::vector<ReportPicture> run() {
    const std::optional<Shown> target = load_input({"target", "surface"}), before = load_input({"template", "mesh"});
    const std::optional<Shown> result = load_result();
    const Shown* first = target ? &*target : result ? &*result : before ? &*before : nullptr;
    if (!first) return {};
    view_ = view_of(first->triangles.positions);
    if (target) add("Surface", *target, {});
    if (before) add("Before: the mesh given", *before, {});
    if (result && target && !report_.value("limit_surface_distance", report_.value("distance", Json())).is_null())
      add_distance(*result, *target);
    if (result && !result->quality.empty()) add_quality(*result);
    return std::move(pictures_);
  }

 private:
  std::optional<Shown> load(const std::string& name) {
    try {
      return load_shown(find_file(name, folder_));
    } catch (const std::exception& error) {
      notes_.push_back(std::string("not shown: ") + error.what());
      return std::nullopt;
    }
  }

  std::optional<Shown> load_input(std::initializer_list<const char*> names) {
    const Json input = report_.value("input", Json::object());
    for (const char* name : names)
      if (input.contains(name) && input[name].is_object())
        if (const std::string path = input[name].value("path", std::string()); !path.empty()) return load(path);
    return std::nullopt;
  }

  std::optional<Shown> load_result() {
    const Json quality = report_.value("quality", Json::object());
    const double num_cells = quality.value("cells", 0.0);  // a report may hold any number, even 1e77
    bool any = false;
    for (const Json& output : report_.value("outputs", Json::array())) {
      const std::string name = output.is_string() ? output.get<std::string>() : std::string();
      if (!is_volume_file(name) && !is_high_order_file(name)) continue;
      any = true;
      if (std::optional<Shown> found = load(name); found && static_cast<double>(found->num_cells) == num_cells)
        return found;
    }
    notes_.push_back(any ? "the result is not shown: no output holds as many cells as the report says"
                         : "the result is not shown: there is no output with cells that can be read (.mesh, .vtk, or "
                           ".vtu of curved cells)");
    return std::nullopt;
  }

  void add(const std::string& title, const Shown& what, std::vector<LinearColor> colors, std::string low = {},
           std::string high = {}) {
    const RasterSurface surface{what.triangles, std::move(colors), what.wires};
    pictures_.push_back(
        {title, png_bytes(rasterize(surface, view_, kWidth, kHeight)), std::move(low), std::move(high)});
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
  fs::path folder_;
  std::vector<std::string>& notes_;
  RasterView view_;
  std::vector<ReportPicture> pictures_;
};

}  // namespace

std::vector<ReportPicture> report_pictures(const Json& report, const fs::path& folder,
                                           std::vector<std::string>& notes) {
  return Painter(report, folder, notes).run();
}

}  // namespace subvol::cli
