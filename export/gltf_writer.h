// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/scene.h"

#include <filesystem>
#include <string>

namespace subvol {

/// The two forms of a glTF 2.0 file.
enum class GltfContainer {
  glb,  ///< one binary file
  gltf  ///< JSON, with the buffer embedded as base64
};

/// Returns a scene as the bytes of a glTF 2.0 file; equal scenes give equal bytes.
///
///   world = meters_per_unit R origin + meters_per_unit R p,   p = float(position - origin),   R: up axis to y
///
/// A quantized scene has its coordinates in units of its half extent u: p = u q / 32767, and its nodes are scaled by u.
///
/// Written per node: POSITION (float32, min and max exact), NORMAL, COLOR_0 (linear RGBA, normalized 16 bits), the
/// attributes as float32, indices of 16 bits if these suffice and of 32 otherwise, and a double-sided, rough,
/// nonmetallic material. Shapes become morph targets, with their names in the mesh's extras.targetNames, and one
/// animation "shapes" that passes from the first shape to the primitive itself; at rest the primitive is shown. The two
/// triangles of a quad stay consecutive. asset.generator is "subvol VERSION"; asset.extras and the root node's extras
/// (which survive an import) both hold unit, up_axis, version, the scene's extras and options.
///
/// InputError, naming node and array: no nodes; a node without positions or indices; arrays of unequal length; an index
/// out of range; a number that is not finite, or overflows float32; positions that are all below 1e-30; a normal whose
/// length is not 1 within 1e-6; a color outside [0, 1]; an attribute name that is not an underscore and capitals;
/// shapes of lines; meters_per_unit or seconds_per_shape not positive, or times of shapes that coincide in float32;
/// text that is not UTF-8; more than 2^31 bytes.
std::string gltf_bytes(const Scene& scene, GltfContainer container);

/// Writes `gltf_bytes` to a .glb or .gltf file, all of it or nothing.
///
/// InputError: another extension, or a scene that `gltf_bytes` refuses. IoError: the file cannot be written.
void write_gltf(const std::filesystem::path& path, const Scene& scene);

}  // namespace subvol
