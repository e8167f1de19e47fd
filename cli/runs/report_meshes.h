// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "cli/runs/run_options.h"
#include "subvol/export/high_order_file.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace subvol::cli {

/// What a file holds that can be shown: linear cells, curved cells, or a surface.
using ShownMesh = LoadedMesh;

/// Loads such a file; volume meshes are not checked: what is wrong with them is to be seen. InputError as the readers.
ShownMesh load_shown_mesh(const std::filesystem::path& path, std::vector<std::string>& warnings,
                          const std::string& references = {});
std::size_t num_cells(const ShownMesh& mesh);
/// InputError: the mesh has a defect that `MeshTopology` cannot take, so that it has no boundary. Cost: `validate`.
void require_boundary(const VolumeMesh& mesh);

/// The meshes that a report is about, from the files that it names, as they are now.
struct ReportMeshes {
  std::optional<PolygonMesh> target;  ///< the surface, of triangles
  std::optional<ShownMesh> before;    ///< the template, or the mesh that was given
  std::optional<ShownMesh> result;    ///< of `check`: the mesh that was checked
  /// The control cage of which the result is a refinement. None if there is no such output.
  std::optional<VolumeMesh> cage;
};

/// Loads them. The result is the first output that holds as many cells as the report says.
///
/// folder   where relative names are looked up besides the current folder.
/// notes    receives a line for everything that could not be loaded, with the reason.
ReportMeshes load_report_meshes(const Json& report, const std::filesystem::path& folder,
                                std::vector<std::string>& notes);

}  // namespace subvol::cli
