// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/report_meshes.h"
#include "cli/runs/scene_chord.h"
#include "subvol/base/work_progress.h"
#include "subvol/export/viewer_content.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <optional>
#include <span>
#include <string>

namespace subvol::cli {

using internal::ViewerContent;
using internal::ViewerMesh;

/// What to show of a mesh besides its cells.
struct ViewingOptions {
  const TriangleMesh* target = nullptr;       ///< the surface to measure distances to and to show as a ghost; or null
  bool limit = false;                         ///< the mesh is a control cage: show its limit surface
  double chord_percent = kSceneChordPercent;  ///< of that surface, in percent of the diagonal of its box
};

/// Measures a mesh and makes it ready for the viewer: its quality, cells that are inverted or not proved to be valid,
/// references, orders, distances of the boundary from the target.
///
/// path  of the file, whose other fields are added if it is a .vtu; empty: none.
/// InputError: a vertex number out of range, a cage that has no limit surface. progress: may end nothing.
ViewerMesh measured_viewer_mesh(std::string name, const ShownMesh& mesh, const ViewingOptions& options,
                                const std::filesystem::path& path = {}, const WorkProgress& progress = {});

/// What a page shows of a mesh. path, progress: as above. warnings: about what could not be measured. InputError: as
/// above.
ViewerContent mesh_content(const std::string& title, const ShownMesh& mesh, const ViewingOptions& options,
                           std::vector<std::string>& warnings, const std::filesystem::path& path = {},
                           const WorkProgress& progress = {});

/// A mesh in the course of a fit.
struct Moment {
  std::string name;
  ShownMesh mesh;
};

/// Returns what a page shows of the course of a fit. The page begins with the last moment.
///
/// moments  in their order, at least one.
ViewerContent timeline_content(const std::string& title, std::span<const Moment> moments,
                               const ViewingOptions& options);

/// What a page shows of a report: before and after, the target, the limit surface. Nothing if there is no mesh.
std::optional<ViewerContent> report_content(const Json& report, const ReportMeshes& meshes,
                                            std::vector<std::string>& notes, const WorkProgress& progress = {});

}  // namespace subvol::cli
