// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/read_back.h"

#include "subvol/base/error.h"
#include "subvol/export/grouped_faces.h"
#include "subvol/export/lagrange_mesh.h"
#include "subvol/export/nodal_export.h"
#include "subvol/export/text_format.h"
#include "subvol/export/written_file.h"
#include "subvol/io/nodal_writers.h"

namespace subvol {

using namespace internal;
namespace {

namespace fs = std::filesystem;

/// Calls compare(file) if there is a file to read.
template <class Compare>
void read_back(const fs::path& path, const Compare& compare) {
  std::error_code ignored;
  if (fs::exists(path, ignored) && !fs::is_regular_file(path, ignored)) return;
  try {
    compare(WrittenFile(path));
  } catch (const InputError& error) {
    throw IoError(std::string("was written, but cannot be read back: ") + error.what());
  }
}

void compare_cells(const WrittenFile& file, const std::string& extension, const CellView& wanted, MshVersion version) {
  extension == ".vtu" ? compare_vtu(file, wanted) : compare_msh(file, wanted, version);
}

}  // namespace

void require_written(const fs::path& path, const VolumeMesh& mesh, MshVersion msh_version) {
  const std::string extension = lower_case_extension(path);
  read_back(path, [&](const WrittenFile& file) {
    if (extension == ".mesh" || extension == ".vtk") return compare_linear(file, mesh, extension == ".mesh");
    if (is_nodal_output(extension)) return compare_nodal(file, nodal_mesh(mesh));
    const GroupedFaces faces = grouped_faces(mesh);
    compare_cells(file, extension,
                  {mesh.positions, mesh.kinds, {}, mesh.cell_offsets, mesh.cell_vertices, mesh.references, &faces},
                  msh_version);
  });
}

void require_written(const fs::path& path, const HighOrderMesh& mesh, const HighOrderFileOptions& options) {
  const std::string extension = lower_case_extension(path);
  if (extension == ".mesh" || extension == ".vtk") return require_written(path, small_cells(mesh, options));
  if (is_nodal_output(extension)) {
    const NodalMesh wanted = written_nodes(mesh, extension, options);
    return read_back(path, [&](const WrittenFile& file) { compare_nodal(file, wanted); });
  }
  read_back(path, [&](const WrittenFile& file) {
    const bool is_vtu = extension == ".vtu";
    const HighOrderMesh written = file_cells(mesh, extension, options.map_tolerance_percent).mesh;
    const bool has_control_points = is_vtu && options.vtu_cells == VtuCells::bezier;
    LagrangeMesh cells = lagrange_mesh(written, lagrange_orders(written.space, kMaxOrder),
                                       is_vtu ? NodeOrdering::vtk : NodeOrdering::gmsh);
    if (has_control_points) use_control_points(cells);
    const GroupedFaces faces = options.face_groups && !is_vtu
                                   ? grouped_faces(cells, mesh.space.topology(), *options.face_groups)
                                   : GroupedFaces{};
    compare_cells(file, extension,
                  {cells.positions,
                   cells.kinds,
                   cells.orders,
                   cells.cell_offsets,
                   cells.cell_nodes,
                   options.references,
                   &faces,
                   {},
                   has_control_points},
                  options.msh_version);
    if (is_vtu) compare_map(file, mesh, options);
  });
}

void require_written(const fs::path& path, const PolygonMesh& surface) {
  read_back(path, [&](const WrittenFile& file) { compare_surface(file, surface); });
}

void require_written(const fs::path& path, const Scene& scene) {
  read_back(path, [&](const WrittenFile& file) { compare_scene(file, scene); });
}

}  // namespace subvol
