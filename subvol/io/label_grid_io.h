// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/label_grid.h"

#include <filesystem>
#include <string>

namespace subvol {

/// Reads a segmentation; the extension chooses the format (docs/file-formats.md).
///
///   .npy           NumPy, three-dimensional; element [i, j, k] is voxel (i, j, k), of edge length 1
///   .nrrd          NRRD, three-dimensional, with its data in the same file: raw, gzip or text
///   .nii .nii.gz   NIfTI-1, with the volume in the same file
///
/// Labels are whole numbers from 0 (outside) to 2^31 - 1, of any type. Voxels have the size, place and directions that
/// the file tells; NRRD's spacings count as axes.
///
/// InputError, with the file: another extension; what is malformed or truncated; other than three dimensions (a fourth
/// of length 1 is dropped); a label that is negative or no whole number; voxels without volume; more than 2^31 - 1 of
/// them. Memory: some times the size of the file's data, whatever it claims.
LabelGrid read_label_grid(const std::filesystem::path& path);

/// Returns true if `read_label_grid` knows the extension of a path.
bool is_label_grid_file(const std::filesystem::path& path);

/// Returns the extensions as text for help and messages.
std::string label_grid_formats();

}  // namespace subvol
