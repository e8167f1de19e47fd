// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/outputs.h"
#include "subvol/export/cutaway.h"
#include "subvol/export/export.h"
#include "subvol/export/high_order_file.h"
#include "subvol/export/scene.h"
#include "subvol/export/tessellate.h"
#include "subvol/mesh/cell_topology.h"
#include "subvol/mesh/fit_state.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <filesystem>
#include <span>
#include <string>

namespace subvol::cli {

/// How surfaces for DCC tools are written.
struct WritingOptions {
  double chord_percent = 0.005;  ///< largest chord error of a tessellation, in percent of its bounding box's diagonal
  double meters_per_unit = 1;
  std::string up_axis = "y";
  std::filesystem::path source;                         ///< file that the result was made from, stored in the output
  Json options = Json::object();                        ///< options in force, stored in the output
  CutPlane cut{};                                       ///< plane of cutaways
  bool no_wireframe = false;                            ///< leaves the cells' edges out of scenes
  bool quantize = false;                                ///< writes scenes with small integers
  double map_tolerance_percent = kMapTolerancePercent;  ///< of polynomial cells in place of curved ones
  MshVersion msh_version = MshVersion::v4_1;
  VtuCells vtu_cells = VtuCells::lagrange;
  int linear_intervals = 0;  ///< per edge of a curved cell in .mesh and .vtk; 0: its mesh's largest order
};

/// Largest chord error of surfaces that are measured, in percent as above; coarse scenes do not make a coarse check.
double measured_chord_percent(const WritingOptions& options);

/// Parses the plane of a cutaway: x, y or z, optionally with a position as in "z:0.3". Returns an error message, or an
/// empty text.
std::string parse_cut(const std::string& text, CutPlane& cut);

// Every file is read back and compared with what it should hold, as far as `require_written` does: IoError.

/// Write a scene, or curved cells as .vtu, .msh, .mesh or .vtk.
void write_scene(const std::filesystem::path& path, const Scene& scene);
void write_curved_cells(const Output& output, const HighOrderMesh& mesh, const HighOrderFileOptions& options);

/// Writes a control cage and its finest mesh: the cells unchanged, .glb and .gltf as the tessellated limit surface
/// colored by quality, .obj and .usda as the boundary's polygons. `limit` is `tessellated_limit` of the cage; it is
/// needed if a scene of it is written (`shows_surface`) and may otherwise be null.
void write_output(const Output& output, const VolumeMesh& cage, const VolumeMesh& mesh, const TessellatedSurface* limit,
                  const WritingOptions& options);
/// True if the output is a scene of the result's surface.
bool shows_surface(const Output& output);

/// Writes one mesh unchanged: its cells, the flat faces of its boundary (.usda: as a subdivision cage), or a cutaway.
void write_output(const Output& output, const VolumeMesh& mesh, const WritingOptions& options);

/// Writes a high-order mesh: curved cells (.vtu, .msh), many linear ones (.mesh, .vtk), its curved boundary colored by
/// quality (.glb, .gltf) or as quads (.obj), or a cutaway. UsageError: .usda, which holds subdivision cages.
void write_output(const Output& output, const HighOrderFile& file, const WritingOptions& options);

/// Largest order of each kind of cells of a mesh; 0 if it has none of the kind.
using KindOrders = std::array<int, kNumCellKinds>;
/// Returns these orders if all cells have one order, or each its own.
KindOrders kind_orders(std::span<const CellKind> kinds, int order);
KindOrders kind_orders(const ElementSpace& space);

/// UsageError, to be raised before the work: curved cells of these orders cannot be written to such a file: none to
/// .usda, none above order 2 to formats of quadratic cells, and none to .msh that Gmsh does not evaluate.
void require_for_curved_cells(const Output& output, const KindOrders& orders);

/// Writes a limit surface's quads as .obj or .usda.
void write_polygons(const Output& output, const TessellatedSurface& limit, const WritingOptions& options);

/// Writes the course of a fit, starting with the template: a scene of its surface, or a page with its cells.
///
/// result  a refinement of the cage, or the cage itself. A page shows coarser refinements if there are many cells.
void write_animation(const Output& output, const VolumeMesh& cage, const VolumeMesh& result,
                     std::span<const FitState> states, const WritingOptions& options);
void write_animation(const Output& output, const HighOrderMesh& mesh, std::span<const FitState> states,
                     const WritingOptions& options);
bool has_animation(std::span<const Output> outputs);

/// Options of a scene written to this output.
SurfaceSceneOptions scene_options(const Output& output, const WritingOptions& options);

/// Writes polygons unchanged. UsageError: a format that holds cells.
void write_output(const Output& output, const PolygonMesh& surface, const WritingOptions& options);

/// The limit surface of a cage, tessellated as for a .glb.
TessellatedSurface tessellated_limit(const VolumeMesh& cage, const WritingOptions& options,
                                     const WorkProgress& progress = {});

}  // namespace subvol::cli
