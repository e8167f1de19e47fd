// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/outputs.h"
#include "cli/runs/run_options.h"
#include "subvol/export/high_order_file.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/point_cloud.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace subvol::cli {

/// Throws InputError if the extension is none of a file with geometry, and lists the known ones.
void require_known_file(const std::filesystem::path& path);

/// True if a path has the extension of a surface and the file has faces. InputError: as `is_point_cloud_file`.
bool is_surface_file(const std::filesystem::path& path);

/// Holds what was read from a file: linear cells, curved cells, or a surface.
using LoadedMesh = std::variant<VolumeMesh, HighOrderFile, PolygonMesh>;

/// Reads a file of cells or of a surface, once.
///
/// check       linear cells must be valid, as for `load_volume`.
/// references  name of the cell data that become the references; empty: the usual ones.
/// InputError: as the readers; points without faces.
LoadedMesh load_mesh(const std::filesystem::path& path, std::vector<std::string>& warnings, bool check = true,
                     const std::string& references = {});

/// A target to fit or to compare with: a surface, or points on one.
using Target = std::variant<TriangleMesh, PointCloud>;
inline bool is_cloud(const Target& target) { return std::holds_alternative<PointCloud>(target); }

/// Loads points, a surface from a surface file, or the boundary of a volume mesh. InputError as the readers.
Target load_target(const std::filesystem::path& path, std::vector<std::string>& warnings);
/// Loads a target of a fit as `load_target`; of a volume mesh, also the interfaces between its regions.
Target load_target_with_regions(const std::filesystem::path& path, std::vector<std::string>& warnings);
/// Returns the boundary of a mesh, with the interfaces between its regions if it has several.
TriangleMesh surface_with_interfaces(const VolumeMesh& mesh);

/// Holds what a fit with a template reproduces of its target.
struct FittedTarget {
  std::optional<RegionSurface> regions;  ///< of the target, if the template has the same
  Target outer;                          ///< what the boundary of the result is compared with
};
/// Returns it for a template (`matched_target`); of points, all of them.
FittedTarget fitted_target(const Target& target, const VolumeMesh& template_mesh);
/// Returns what the boundary of a mesh is compared with: if sheets divide a target into regions, its outer surface.
Target outer_target(const Target& target, const VolumeMesh& mesh);
/// Load a surface or the boundary of a volume mesh, as triangles or as polygons; points are refused.
TriangleMesh load_surface(const std::filesystem::path& path, std::vector<std::string>& warnings);
PolygonMesh load_polygons(const std::filesystem::path& path, std::vector<std::string>& warnings);

/// A surface of polygons with tags by its own vertex numbers.
struct TaggedPolygons {
  PolygonMesh polygons;
  FeatureTags tags;
};
/// The boundary of a volume mesh, with those of its tags that lie on it.
TaggedPolygons tagged_polygons(const VolumeMesh& mesh);
/// `load_polygons` with the tags of a volume mesh; a surface file has none.
TaggedPolygons load_tagged_polygons(const std::filesystem::path& path, std::vector<std::string>& warnings);
/// Loads the surface on which a shell grows. Of a mesh of cells, that is the boundary of a region, which is given by
/// its name or number; `region` is empty afterwards. UsageError: there is no such region.
TaggedPolygons load_shell_surface(const std::filesystem::path& path, std::string& region,
                                  std::vector<std::string>& warnings);

/// Value of --references with which cells are read without references, as one region.
inline constexpr const char* kNoReferences = "none";

/// Loads a volume mesh that is valid except for inverted cells and unused vertices (or, unchecked, is just readable).
/// references: name of the cell data that become the references; empty: the usual ones; `kNoReferences`: none.
VolumeMesh load_volume(const std::filesystem::path& path, std::vector<std::string>& warnings, bool check = true,
                       const std::string& references = {});

/// Cells of a mesh, linear or curved.
using LoadedCells = std::variant<VolumeMesh, HighOrderFile>;
/// Loads linear cells as `load_volume`, or curved ones as `load_high_order`.
LoadedCells load_cells(const std::filesystem::path& path, std::vector<std::string>& warnings, bool check = true,
                       const std::string& references = {});

/// Returns the straight-sided cells of a curved mesh, with its labels.
VolumeMesh labels_of(const HighOrderFile& file);

/// Returns the regions of a mesh: their names and their references as numbers.
std::vector<Group> regions_of(const VolumeMesh& mesh);

/// Returns the number of the region with this number, else of the one with this name. UsageError: there is none, or
/// several have the name; the message begins with `option` and lists the regions.
int number_of_region(std::span<const Group> regions, const std::string& name, const std::string& option);

/// UsageError: an output is the part of a region that is not among these; the message lists them.
void require_regions(std::span<const Output> outputs, std::span<const Group> regions);

/// Returns the cells of one region, which is given by its name or its number. UsageError: there is none; the message
/// lists the regions.
VolumeMesh cells_of_region(const VolumeMesh& mesh, const std::string& region);
HighOrderFile cells_of_region(const HighOrderFile& file, const std::string& region);

/// `read_curved`; InputError also if the whole mesh is at one point. warnings: may be null.
HighOrderFile load_high_order(const std::filesystem::path& path, std::vector<std::string>* warnings = nullptr,
                              const std::string& references = {});

/// UsageError: --references was given for a file in which cell data cannot be chosen.
void require_choice_of_references(const std::filesystem::path& path, const std::string& references);

/// Positive numbers, one per line; blank lines are skipped. InputError, with the line: anything else.
std::vector<double> load_thicknesses(const std::filesystem::path& path);

/// Entry "input" of a report.
Json describe(const std::string& path, const TriangleMesh& mesh);
Json describe(const std::string& path, const PointCloud& cloud);
Json describe(const std::string& path, const Target& target);
Json describe(const std::string& path, const PolygonMesh& mesh);
Json describe(const std::string& path, const VolumeMesh& mesh);
Json describe(const std::string& path, const HighOrderMesh& mesh);

/// Formats that can be read as a target, for help.
std::string target_formats();

/// Formats with cells that can be read, for help.
std::string cell_formats();

}  // namespace subvol::cli
