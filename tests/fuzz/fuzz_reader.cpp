// SPDX-License-Identifier: GPL-3.0-or-later
// libFuzzer target of one of the library's readers: kExtension says of which files. Whatever the bytes, the reader
// returns something sound or throws InputError.

#include "subvol/base/error.h"
#include "subvol/base/fingerprint.h"
#include "subvol/export/curved_file.h"
#include "subvol/fit/stages/checkpoint.h"
#include "subvol/io/label_grid_io.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/validate.h"
#include "tests/fuzz/bytes_as_file.h"

using subvol::fuzz::kExtension;
using subvol::fuzz::require;

namespace {

void require_finite(const std::vector<subvol::Vec3>& points) {
  for (const subvol::Vec3& p : points) require(p.allFinite());
}

void require_indices(std::span<const subvol::Index> indices, std::size_t num_vertices) {
  for (const subvol::Index v : indices) require(v >= 0 && static_cast<std::size_t>(v) < num_vertices);
}

void read_surface(const std::filesystem::path& file) {
  std::vector<std::string> warnings;
  const subvol::PolygonMesh polygons = subvol::read_polygon_mesh(file, &warnings);
  require(polygons.num_faces() > 0);
  require_finite(polygons.positions);
  require_indices(polygons.face_vertices, polygons.positions.size());
  const subvol::TriangleMesh mesh = subvol::read_triangle_mesh(file, &warnings);
  require(!mesh.triangles.empty());
  require_finite(mesh.positions);
  for (const auto& triangle : mesh.triangles) require_indices(triangle, mesh.positions.size());
}

void read_points(const std::filesystem::path& file) {
  std::vector<std::string> warnings;
  const subvol::PointCloud cloud = subvol::read_point_cloud(file, &warnings);
  require(cloud.points.size() >= subvol::kLeastCloudPoints);
  require_finite(cloud.points);
}

/// Linear cells as such, and all cells as polynomials, also those of a .vtu with an exact map.
void read_cells(const std::filesystem::path& file) {
  std::vector<std::string> warnings;
  const subvol::FileCells cells = subvol::read_cells(file, {.check = false, .warnings = &warnings});
  if (const auto* mesh = std::get_if<subvol::VolumeMesh>(&cells)) {
    require_finite(mesh->positions);
    require_indices(mesh->cell_vertices, mesh->positions.size());
  }
  if (const auto* surface = std::get_if<subvol::PolygonMesh>(&cells)) {
    require_finite(surface->positions);
    require_indices(surface->face_vertices, surface->positions.size());
    return;
  }
  const subvol::HighOrderMesh mesh = subvol::read_curved(file, &warnings).mesh;
  require(mesh.coefficients.size() == mesh.space.num_nodes());
}

void read_labels(const std::filesystem::path& file) {
  const subvol::LabelGrid grid = subvol::read_label_grid(file);
  std::size_t voxels = 1;
  for (const int n : grid.counts) voxels *= static_cast<std::size_t>(n);
  require(grid.labels.size() == voxels);
  for (const int label : grid.labels) require(label >= 0);
}

void read(const std::filesystem::path& file) {
  if (kExtension == ".mesh" || kExtension == ".vtk") {
    std::vector<std::string> warnings;
    const subvol::VolumeMesh mesh = subvol::read_volume_mesh(file, {.warnings = &warnings});
    for (const subvol::MeshDefect& defect : validate(mesh))
      require(defect.kind == subvol::MeshDefect::Kind::inverted_cell ||
              defect.kind == subvol::MeshDefect::Kind::unused_vertex);
  } else if (subvol::is_label_grid_file(file)) {
    read_labels(file);
  } else if (subvol::is_nodal_extension(file)) {
    read_cells(file);
  } else if (subvol::is_point_cloud_file(file)) {
    read_points(file);
  } else {
    read_surface(file);
    if (kExtension == ".ply") subvol::read_vertex_attribute(file, "quality");
  }
}

/// The format's line and the fingerprint are made right: they would keep everything else from being looked at.
void read_checkpoint_of(std::string_view bytes) {
  const std::string name = "checkpoint", sample = subvol::internal::checkpoint_bytes({}, {});
  const std::string head = sample.substr(0, sample.find('\n') + 1);
  const std::string_view content = bytes.substr(std::min(bytes.size(), head.size() + 17));
  const std::string whole = head + subvol::internal::Fingerprint().add(content).text() + '\n' + std::string(content);
  const subvol::internal::Checkpoint read = subvol::internal::parse_checkpoint(whole, name);
  const std::string written = subvol::internal::checkpoint_bytes(read.identity, read.stages);
  const subvol::internal::Checkpoint again = subvol::internal::parse_checkpoint(written, name);
  require(written.size() == whole.size() &&
          subvol::internal::checkpoint_bytes(again.identity, again.stages) == written);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    if (kExtension == ".checkpoint")
      read_checkpoint_of({reinterpret_cast<const char*>(data), size});
    else
      read(subvol::fuzz::as_file(data, size));
  } catch (const subvol::InputError& error) {
    require(std::string_view(error.what()).size() > 3);
  }
  return 0;
}
