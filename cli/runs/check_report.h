// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "fit/elements/high_order_mesh.h"
#include "fit/features/crease_distance.h"
#include "fit/geometry/surface_distance.h"
#include "fit/mesh_check.h"
#include "subvol/subdivision/audit.h"

#include <filesystem>
#include <string>
#include <vector>

namespace subvol::cli {

/// A check as it stands in reports: defects, topology, quality, certificate, self-intersections, distance.
Json check_json(const MeshCheck& check);

/// The Lagrange cells of a .vtu, as VTK and others read them, beside the curved cells that its field data hold.
struct LagrangeCheck {
  double difference_percent = 0;  ///< largest distance found between the two, of the diagonal of the vertices' box
  bool differs = false;           ///< by more than rounding
  QualityReport quality;          ///< of the Lagrange cells as polynomials, with their certificate

  bool valid() const { return quality.certificate.all_certified(); }
};
/// mesh: what `read_high_order` read from the same file.
LagrangeCheck check_lagrange_cells(const std::filesystem::path& path, const HighOrderMesh& mesh);
Json lagrange_json(const LagrangeCheck& check);
std::string to_text(const LagrangeCheck& check);

/// Cells that are not proved positive, ascending; none where that was not looked at.
std::vector<Index> not_certified_cells(const MeshCheck& check);

/// Shape of the cells, and what is proved of them.
Json quality_json(const QualityReport& quality);

/// What in a mesh's boundary works against good cells under subdivision.
Json audit_json(const SubdivisionAudit& found);

/// A distance in the mesh's unit and in per cent of a diagonal; `a` is ours, `b` the target. One-sided: what goes to
/// the target is left out.
Json distance_json(const SurfaceDistance& distance, double diagonal);

/// How well creases meet the target's sharp edges; and the same as one line for people.
Json creases_json(const CreaseDistance& creases);
std::string to_text(const CreaseDistance& creases);

}  // namespace subvol::cli
