// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "export/high_order_file.h"
#include "fit/elements/high_order_mesh.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/point_cloud.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace subvol::cli {

/// InputError: a path's extension is none of a file with geometry; it lists those there are. Where it is one that holds
/// something else than a surface (a volume mesh has one, its boundary) or linear cells, that is said.
void require_known_file(const std::filesystem::path& path);
void require_surface_file(const std::filesystem::path& path);
void require_cell_file(const std::filesystem::path& path);

/// Whether a path's extension is one of a volume mesh.
bool is_volume_file(const std::filesystem::path& path);

/// Whether it is that of a high-order mesh, for `read_high_order`.
bool is_high_order_file(const std::filesystem::path& path);

/// What can be fitted, and compared with: a surface, or points on one.
using Target = std::variant<TriangleMesh, PointCloud>;
inline bool is_cloud(const Target& target) { return std::holds_alternative<PointCloud>(target); }

/// Points, a surface from a surface file, or the boundary of a volume mesh. InputError as the readers.
Target load_target(const std::filesystem::path& path, std::vector<std::string>& warnings);
/// The same where only triangles will do: points are refused as well.
TriangleMesh load_surface(const std::filesystem::path& path, std::vector<std::string>& warnings);
PolygonMesh load_polygons(const std::filesystem::path& path, std::vector<std::string>& warnings);

/// A surface of polygons with tags by its own vertex numbers.
struct TaggedPolygons {
  PolygonMesh polygons;
  FeatureTags tags;
};
/// The boundary of a volume mesh, with those of its tags that are on it.
TaggedPolygons tagged_polygons(const VolumeMesh& mesh);
/// `load_polygons` with the tags of a volume mesh; those of a surface file are none.
TaggedPolygons load_tagged_polygons(const std::filesystem::path& path, std::vector<std::string>& warnings);

/// A volume mesh that is sound but for inverted cells and unused vertices (or, unchecked, just readable).
/// references: name of the cell data that become them; empty: those that are meant.
VolumeMesh load_volume(const std::filesystem::path& path, std::vector<std::string>& warnings, bool check = true,
                       const std::string& references = {});

/// `read_high_order`; InputError also where all of the mesh is in one place.
HighOrderFile load_high_order(const std::filesystem::path& path);

/// UsageError: --references was given for a file whose cell data cannot be chosen from.
void require_choice_of_references(const std::filesystem::path& path, const std::string& references);

/// Positive numbers, one a line; blank lines are passed over. InputError, with the line: anything else.
std::vector<double> load_thicknesses(const std::filesystem::path& path);

/// What stands under "input" in a report.
Json describe(const std::string& path, const TriangleMesh& mesh);
Json describe(const std::string& path, const PointCloud& cloud);
Json describe(const std::string& path, const Target& target);
Json describe(const std::string& path, const PolygonMesh& mesh);
Json describe(const std::string& path, const VolumeMesh& mesh);
Json describe(const std::string& path, const HighOrderMesh& mesh);

/// What can be read as a target, for help.
std::string target_formats();

/// What can be read that holds cells, for help.
std::string cell_formats();

}  // namespace subvol::cli
