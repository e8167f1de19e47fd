// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Written files are read back and compared with the data that went into them: the numbers of elements, their positions
// (exact, or within the steps of a quantized scene), and their kinds.
//
// All functions throw IoError, naming the file and the first difference, or why the file cannot be read. Files that are
// not regular (a pipe, a device) are skipped, because they do not return what was written. Cost: about that of writing.

#include "subvol/export/high_order_file.h"
#include "subvol/export/scene.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>

namespace subvol {

/// Checks a .mesh (with tags), .vtk, .vtu, .msh, .inp, .bdf, .mfem, .e, .exo or .xdmf (the last only as text).
void require_written(const std::filesystem::path& path, const VolumeMesh& mesh,
                     MshVersion msh_version = MshVersion::v4_1);
/// Checks a .vtu (with the map), a .msh, .inp, .bdf, .mfem, .e, .exo or .xdmf, or a .mesh or .vtk of linear cells.
void require_written(const std::filesystem::path& path, const HighOrderMesh& mesh, const HighOrderFileOptions& options);
/// Checks an .obj or .usda; the bytes of a .stl, .ply, .vtp or .3mf.
void require_written(const std::filesystem::path& path, const PolygonMesh& surface);
/// Checks a .glb or .gltf.
void require_written(const std::filesystem::path& path, const Scene& scene);

}  // namespace subvol
