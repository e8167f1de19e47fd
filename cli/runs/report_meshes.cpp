// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/report_meshes.h"

#include "cli/runs/loading.h"
#include "subvol/base/error.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"

#include <cmath>
#include <utility>

namespace subvol::cli {
namespace {

namespace fs = std::filesystem;

/// Loads the files of one report.
class Loader {
 public:
  Loader(const Json& report, fs::path folder, std::vector<std::string>& notes)
      : report_(report), folder_(std::move(folder)), notes_(notes) {}

  ReportMeshes run() {
    ReportMeshes meshes;
    const bool is_check = report_.value("command", std::string()) == "check";
    if (std::optional<ShownMesh> target = load_input({"target", "surface"})) meshes.target = surface_of(*target);
    if (is_check) {
      meshes.result = load_input({"mesh"});
      return meshes;
    }
    meshes.before = load_input({"template", "mesh"});
    load_outputs(meshes);
    return meshes;
  }

 private:
  std::optional<ShownMesh> load(const std::string& name) {
    try {
      std::error_code ignored;
      std::vector<std::string> warnings;
      return load_shown_mesh(fs::exists(name, ignored) ? fs::path(name) : folder_ / name, warnings);
    } catch (const std::exception& error) {
      notes_.push_back(std::string("not shown: ") + error.what());
      return std::nullopt;
    }
  }

  std::optional<ShownMesh> load_input(std::initializer_list<const char*> names) {
    const Json input = report_.value("input", Json::object());
    for (const char* name : names) {
      if (!input.contains(name)) continue;
      const Json& entry = input[name];
      const std::string path = entry.is_string()   ? entry.get<std::string>()
                               : entry.is_object() ? entry.value("path", std::string())
                                                   : std::string();
      if (!path.empty()) return load(path);
    }
    return std::nullopt;
  }

  /// The surface of an input as triangles; nothing for points.
  std::optional<PolygonMesh> surface_of(const ShownMesh& mesh) const {
    try {
      if (const auto* surface = std::get_if<PolygonMesh>(&mesh)) return as_polygons(triangulate(*surface));
      if (const auto* cells = std::get_if<VolumeMesh>(&mesh)) {
        require_boundary(*cells);
        return as_polygons(triangulate(boundary_surface(*cells, MeshTopology(*cells))));
      }
    } catch (const InputError& error) {
      notes_.push_back(std::string("the surface is not shown: ") + error.what());
    }
    return std::nullopt;
  }

  /// A report may say any number, even 1e77.
  double said_cells() const { return report_.value("quality", Json::object()).value("cells", 0.0); }

  void load_outputs(ReportMeshes& meshes) {
    const double said = said_cells();
    bool any = false;
    std::optional<VolumeMesh> other;
    for (const Json& output : report_.value("outputs", Json::array())) {
      const std::string name = output.is_string() ? output.get<std::string>() : std::string();
      if (!is_nodal_extension(name)) continue;
      any = true;
      if (meshes.result && meshes.cage) break;
      std::optional<ShownMesh> found = load(name);
      if (!found) continue;
      if (!meshes.result && static_cast<double>(num_cells(*found)) == said)
        meshes.result = std::move(found);
      else if (auto* cells = std::get_if<VolumeMesh>(&*found); cells && !other)
        other = std::move(*cells);
    }
    if (meshes.result && other && is_cage_of(*other, *meshes.result)) meshes.cage = std::move(other);
    if (meshes.result) return;
    notes_.push_back(any ? "the result is not shown: no output holds as many cells as the report says"
                         : "the result is not shown: there is no output with cells that can be read (.mesh, .vtk, or "
                           ".vtu of curved cells)");
  }

  /// True if a mesh becomes the result by subdivisions, as far as the number of cells tells: each cell becomes as many
  /// hexes as it has corners, each of these eight.
  static bool is_cage_of(const VolumeMesh& cage, const ShownMesh& result) {
    if (!std::holds_alternative<VolumeMesh>(result)) return false;
    std::size_t count = cage.cell_vertices.size();
    while (count < num_cells(result)) count *= 8;
    return count > 0 && count == num_cells(result);
  }

  const Json& report_;
  fs::path folder_;
  std::vector<std::string>& notes_;
};

}  // namespace

ShownMesh load_shown_mesh(const fs::path& path, std::vector<std::string>& warnings, const std::string& references) {
  return load_mesh(path, warnings, false, references);
}

void require_boundary(const VolumeMesh& mesh) {
  using Kind = MeshDefect::Kind;
  for (const MeshDefect& defect : validate(mesh))
    for (const Kind kind : {Kind::no_cells, Kind::size_mismatch, Kind::index_out_of_range, Kind::repeated_vertex,
                            Kind::face_of_many_cells})
      if (defect.kind == kind) throw InputError("the mesh has no boundary: " + defect.message);
}

std::size_t num_cells(const ShownMesh& mesh) {
  if (const auto* cells = std::get_if<VolumeMesh>(&mesh)) return cells->num_cells();
  if (const auto* file = std::get_if<HighOrderFile>(&mesh)) return file->mesh.space.num_cells();
  return 0;
}

ReportMeshes load_report_meshes(const Json& report, const fs::path& folder, std::vector<std::string>& notes) {
  return Loader(report, folder, notes).run();
}

}  // namespace subvol::cli
