// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Files that have been written are read back and compared with what went into them: how many things there are, where
// they are (exactly, or within the steps of a quantized scene), and of which kind.
//
// All throw IoError, naming the file and the first thing that differs, or why it cannot be read. What is no regular
// file (a pipe, a device) is passed over: what went in does not come out again. Cost: about that of writing.

#include "export/high_order_file.h"
#include "export/scene.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <filesystem>

namespace subvol {

/// .mesh (with tags), .vtk, .vtu, .msh.
void require_written(const std::filesystem::path& path, const VolumeMesh& mesh);
/// .vtu (with the map), .msh; .mesh and .vtk as linear cells.
void require_written(const std::filesystem::path& path, const HighOrderMesh& mesh, const HighOrderFileOptions& options);
/// .obj, .usda.
void require_written(const std::filesystem::path& path, const PolygonMesh& surface);
/// .glb, .gltf.
void require_written(const std::filesystem::path& path, const Scene& scene);

}  // namespace subvol
