// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/features/crease_distance.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/subdivision/audit.h"
#include "subvol/surface/region_surface.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace subvol::cli {

/// The report's entries about a check: defects, topology, quality, certificate, self-intersections, distance.
Json check_json(const MeshCheck& check);

/// Returns the regions and interfaces of a mesh. start: those of the mesh that it was made from, or of its target, by
/// reference, for `start_volume` and `start_area`; null: without these.
/// prefix: of these names, "start" or "target".
Json regions_json(const RegionReport& report, const RegionReport* start = nullptr, const char* prefix = "start");
/// Returns the same with the volumes and areas of the target, if it has the same regions, or else of the mesh that the
/// result was made from.
Json regions_json(const RegionReport& report, const std::optional<RegionSurface>& target, const VolumeMesh& start);
/// Returns a warning for each region whose volume differs by more than `kAutomaticVolumePercent` from that of the
/// region of the same reference in another mesh, or in the target. whose: what the other one is called, such as
/// "target".
std::vector<std::string> warnings_of_volumes(const RegionReport& result, const RegionReport& wanted,
                                             const std::string& whose);
std::vector<std::string> warnings_of_volumes(const MeshCheck& check, const std::optional<RegionSurface>& target);

/// Check of the Lagrange cells of a .vtu, which VTK and other programs read, against the curved cells in its field
/// data.
struct LagrangeCheck {
  double difference_percent = 0;  ///< largest distance found between the two, in percent of the diagonal of the
                                  ///< vertices' box
  bool differs = false;           ///< the two differ by more than rounding
  QualityReport quality;          ///< of the Lagrange cells as polynomials, with their certificate

  bool valid() const { return quality.certificate.all_certified(); }
};
/// mesh: the result of `read_high_order` for the same file.
LagrangeCheck check_lagrange_cells(const std::filesystem::path& path, const HighOrderMesh& mesh);
Json lagrange_json(const LagrangeCheck& check);
std::string to_text(const LagrangeCheck& check);

/// Cells that are not certified, ascending; none if that was not checked.
std::vector<Index> not_certified_cells(const MeshCheck& check);

/// Shape of the cells and their certificate.
Json quality_json(const QualityReport& quality);

/// Boundary configurations of a mesh that degrade cells under subdivision.
Json audit_json(const SubdivisionAudit& found);

/// A distance in the mesh's unit and in percent of a diagonal; `a` is the mesh, `b` the target. A one-sided distance
/// lacks the entries from the mesh to the target.
Json distance_json(const SurfaceDistance& distance, double diagonal);

/// Distances between creases and the target's sharp edges; the text is one line for people.
Json creases_json(const CreaseDistance& creases);
std::string to_text(const CreaseDistance& creases);

}  // namespace subvol::cli
