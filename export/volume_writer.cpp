// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/volume_writer.h"

#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/export/cell_text.h"
#include "subvol/export/group_data.h"
#include "subvol/export/grouped_faces.h"
#include "subvol/export/nodal_export.h"
#include "subvol/export/text_format.h"
#include "subvol/io/nodal_writers.h"
#include "subvol/mesh/validate.h"

#include <algorithm>
#include <cmath>

namespace subvol {

using namespace internal;
namespace {

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
  require_groups(mesh.face_groups, "mesh");
  require_cell_minima(cell_minima, mesh.num_cells());
  for (const VertexField& field : fields) {
    if (field.values.size() != mesh.num_vertices()) throw InputError(field.name + ": expected one value per vertex");
    if (!std::all_of(field.values.begin(), field.values.end(), [](double x) { return std::isfinite(x); }))
      throw InputError(field.name + ": expected finite numbers");
  }
}

CellView view_of(const VolumeMesh& mesh, const GroupedFaces* faces = nullptr) {
  return {mesh.positions, mesh.kinds, {}, mesh.cell_offsets, mesh.cell_vertices, mesh.references, faces, mesh.regions};
}

}  // namespace

std::string vtu_text(const VolumeMesh& mesh, std::span<const double> cell_minima, std::span<const VertexField> fields) {
  require_cells(mesh, cell_minima, fields);
  return vtu_document(view_of(mesh), cell_minima, fields, {}, group_data(mesh.face_groups, mesh.regions));
}

std::string msh_text(const VolumeMesh& mesh, std::span<const double> cell_minima, std::span<const VertexField> fields,
                     MshVersion version) {
  require_cells(mesh, cell_minima, fields);
  const GroupedFaces faces = grouped_faces(mesh);
  return msh_document(view_of(mesh, &faces), cell_minima, fields, version);
}

void write_volume(const std::filesystem::path& path, const VolumeMesh& mesh, std::span<const double> cell_minima,
                  std::span<const VertexField> fields, MshVersion version) {
  const std::string extension = lower_case_extension(path);
  if (is_nodal_output(extension)) {
    require_cells(mesh, cell_minima, fields);
    return write_file_atomically(path, nodal_text(extension, nodal_mesh(mesh)));
  }
  if (extension != ".vtu" && extension != ".msh")
    throw InputError(path.string() + ": expected the extension .vtu, .msh, .inp, .bdf, .mfem, .e, .exo or .xdmf");
  write_file_atomically(
      path, extension == ".vtu" ? vtu_text(mesh, cell_minima, fields) : msh_text(mesh, cell_minima, fields, version));
}

}  // namespace subvol
