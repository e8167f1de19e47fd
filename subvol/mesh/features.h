// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/feature_tags.h"
#include "subvol/mesh/volume_mesh.h"

#include <vector>

namespace subvol {

/// Finds the creases and corners of a mesh's boundary, and of its interfaces between regions, by one angle; all of them
/// are infinitely sharp.
///
///   crease  edge whose two faces' normals n0, n1 differ by more than the angle: |angle(n0, n1)| > angle
///   corner  vertex of three or more creases, or of two whose directions differ by more than the angle
///
/// Feature curves, where an interface ends at other sheets (`InterfaceMarks`), are sharp without a tag; for corners,
/// they count as creases. A face's normal is the direction of its area vector, so a warped quad counts with its mean
/// plane. Convex and reflex edges count alike. A vertex where a single crease ends stays smooth, as on subdivision
/// surfaces.
///
/// mesh           passes `validate` except for `unused_vertex` and `inverted_cell`; its own tags are not read.
/// angle_degrees  deviation from flat, in [0, 180]; outside or NaN: InputError. 180 tags nothing.
/// Degenerate: the angle is 0 at a face without area and at a crease without length. Cost: linear.
FeatureTags features_by_angle(const VolumeMesh& mesh, double angle_degrees);

/// Returns the union of two sets of tags; if both name an edge or vertex, the larger sharpness counts. The inputs need
/// not be sorted.
FeatureTags merge_tags(const FeatureTags& a, const FeatureTags& b);

/// Returns, for each crease of a mesh that was subdivided once, its parent's position in the creases of the control
/// mesh. Both must be sorted; every fine crease must be half of one of the control mesh.
std::vector<Index> parents_of_creases(const FeatureTags& fine, const FeatureTags& control);

}  // namespace subvol
