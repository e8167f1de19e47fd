// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/outputs.h"
#include "export/cutaway.h"
#include "export/export.h"
#include "export/high_order_file.h"
#include "export/scene.h"
#include "export/tessellate.h"
#include "subvol/mesh/fit_state.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>
#include <span>
#include <string>

namespace subvol::cli {

/// How surfaces for DCC tools are written.
struct WritingOptions {
  double chord_percent = 0.005;   ///< largest chord error of a tessellation, per cent of its bounding box's diagonal
  double metres_per_unit = 1;
  std::string up_axis = "y";
  std::filesystem::path source;   ///< file the result was made from, kept in the file
  Json options = Json::object();  ///< options in force, kept in the file
  CutPlane cut{};                 ///< of cutaways
  bool no_wireframe = false;      ///< scenes without the cells' edges
  bool quantize = false;          ///< scenes in small whole numbers
  double map_tolerance_percent = kMapTolerancePercent;  ///< of polynomial cells in the place of curved ones
  int linear_intervals = 0;       ///< of a curved cell's edges in .mesh and .vtk; 0: its mesh's largest order
};

/// Largest chord error of surfaces that are measured, per cent as above: coarse scenes do not make a coarse check.
double measured_chord_percent(const WritingOptions& options);

/// Reads where a cutaway is cut: x, y or z, also with a place as "z:0.3". Returns what is wrong, or nothing.
std::string parse_cut(const std::string& text, CutPlane& cut);

// Whatever is written is read back and compared with what it should be, as far as `require_written` does: IoError.

/// Writes a scene; curved cells as .vtu, .msh, .mesh or .vtk.
void write_scene(const std::filesystem::path& path, const Scene& scene);
void write_curved_cells(const Output& output, const HighOrderMesh& mesh, const HighOrderFileOptions& options);

/// Writes a control cage and its finest mesh: cells as they are, .glb and .gltf as the tessellated limit surface
/// coloured by quality, .obj and .usda as the boundary's polygons. `limit` is `tessellated_limit` of the cage; it is
/// asked for where a scene of it is to be written (`shows_surface`) and may be null elsewhere.
void write_output(const Output& output, const VolumeMesh& cage, const VolumeMesh& mesh, const TessellatedSurface* limit,
                  const WritingOptions& options);
/// Whether the output is a scene of the result's surface.
bool shows_surface(const Output& output);

/// Writes one mesh as it is: its cells, the flat faces of its boundary (.usda: as a subdivision cage), or a cutaway.
void write_output(const Output& output, const VolumeMesh& mesh, const WritingOptions& options);

/// Writes a high-order mesh: curved cells (.vtu, .msh), many linear ones (.mesh, .vtk), its curved boundary coloured by
/// quality (.glb, .gltf) or as quads (.obj), a cutaway. UsageError: .usda, which holds subdivision cages.
void write_output(const Output& output, const HighOrderFile& file, const WritingOptions& options);

/// UsageError, before the work: curved cells are not written to such a file (.usda).
void require_for_curved_cells(const Output& output);

/// Writes a limit surface's quads, as .obj or .usda.
void write_polygons(const Output& output, const TessellatedSurface& limit, const WritingOptions& options);

/// Writes a fit as it went: a scene of its surface, from the template on.
void write_animation(const Output& output, const VolumeMesh& cage, std::span<const FitState> states,
                     const WritingOptions& options);
void write_animation(const Output& output, const HighOrderMesh& mesh, std::span<const FitState> states,
                     const WritingOptions& options);
bool has_animation(std::span<const Output> outputs);

/// What a scene written to this output says of itself.
SurfaceSceneOptions scene_options(const Output& output, const WritingOptions& options);

/// Writes polygons as they stand. UsageError: a format that holds cells.
void write_output(const Output& output, const PolygonMesh& surface, const WritingOptions& options);

/// The limit surface of a cage as it is written to .glb.
TessellatedSurface tessellated_limit(const VolumeMesh& cage, const WritingOptions& options,
                                     const WorkProgress& progress = {});

}  // namespace subvol::cli
