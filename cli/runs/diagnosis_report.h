// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "cli/runs/run_options.h"
#include "subvol/fit/mending/surface_repair.h"
#include "subvol/fit/target/surface_diagnosis.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace subvol::cli {

/// A surface in a file, face by face: nothing of what it holds is dropped but faces without three different corners.
struct FileSurface {
  TriangleMesh mesh;
  std::vector<Index> face_of_triangle;  ///< the face of the file that each triangle is cut from, from 0
};

FileSurface file_surface(const PolygonMesh& polygons);

/// Says what is done to a surface before it is filled.
struct FillingOptions {
  RegionRule rule = RegionRule::automatic;
  std::optional<double> wrap_percent{};  ///< `WrapOptions::voxel_percent`; nothing: surfaces are not wrapped
};

/// Loads a surface, the sheets of a mesh with several regions, or those of a segmentation (`surface_of_labels`), ready
/// to be filled. With RegionRule::merge, all labels are one region. An interrupt ends the repair (`interrupted`).
SurfaceRepair load_to_fill(const std::filesystem::path& path, const FillingOptions& options,
                           std::vector<std::string>& warnings);

/// Repairs a surface for which a template is to be made (`repair_surface`), and adds what was done to warnings. Other
/// targets are left as they are. An interrupt ends the repair.
void repair_to_fill(Target& target, RegionRule rule, std::vector<std::string>& warnings);

/// Return the numbers, names and volumes of a surface's regions, as text and as an entry of a report.
std::string to_text(const RegionSurface& regions);
Json regions_json(const RegionSurface& regions);

/// Names the triangles of a diagnosis by the faces of the file.
void number_by_faces(SurfaceDiagnosis& diagnosis, const FileSurface& surface);

/// Entries of a report.
Json diagnosis_json(const SurfaceDiagnosis& diagnosis);

/// Text for people: a line for each finding, the places of those that prevent filling, and a verdict.
std::string to_text(const SurfaceDiagnosis& diagnosis);

/// Tells what a fit without a template does to a surface that cannot be filled as it is.
struct FillingForecast {
  SurfaceRepair repair;
  std::string refusal;  ///< why the fit refuses the surface; empty: it does not
};

/// Tries what `load_to_fill` does without options. An interrupt ends it.
/// told  warnings of the file that were told before; others become repairs of the forecast.
FillingForecast forecast_filling(const std::filesystem::path& path, const std::vector<std::string>& told);

/// Return the forecast as text, a line for each repair, and as an entry of a report.
std::string to_text(const FillingForecast& forecast);
Json filling_json(const FillingForecast& forecast);

/// Adds what was repaired, and what was left, to warnings.
void add_remarks(const SurfaceRepair& repair, std::vector<std::string>& warnings);

}  // namespace subvol::cli
