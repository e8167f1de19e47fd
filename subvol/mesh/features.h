// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/feature_tags.h"
#include "subvol/mesh/volume_mesh.h"

namespace subvol {

/// Creases and corners of a mesh's boundary by one angle, all infinitely sharp.
///
///   crease  boundary edge whose two faces' normals n0, n1 differ by more than the angle: |angle(n0, n1)| > angle
///   corner  boundary vertex of three or more creases, or of two whose directions differ by more than the angle
///
/// A face's normal is that of its area vector, so a warped quad counts with its mean plane. Convex and reflex edges
/// count alike. A vertex with one crease (where it runs out) stays smooth, as subdivision surfaces treat it.
///
/// mesh           passes `validate` but for `unused_vertex` and `inverted_cell`; its own tags are not read.
/// angle_degrees  deviation from flat, in [0, 180]; outside or NaN: InputError. 180 tags nothing.
/// Degenerate: a face without area and an edge without length are flat. Cost: linear.
FeatureTags features_by_angle(const VolumeMesh& mesh, double angle_degrees);

/// Union of two sets of tags; where both name an edge or vertex the larger sharpness counts. Inputs need not be sorted.
FeatureTags merge_tags(const FeatureTags& a, const FeatureTags& b);

}  // namespace subvol
