// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/vtu_reader.h"
#include "subvol/mesh/face_groups.h"

#include <span>
#include <string>
#include <vector>

namespace subvol::internal {

/// Returns the groups of faces and the names of references as field data of a .vtu, for `read_groups`; empty if there
/// are none.
///
///   subvol_group_numbers     Int32, one for each group and each named reference
///   subvol_group_dimensions  UInt8: 2 for a group of faces, 3 for a reference
///   subvol_group_names       UInt8: the names in UTF-8, each followed by a line end
///   subvol_group_faces       Int32, 4 for each face in a group: its points, ascending; -1 in place of the fourth of a
///                            triangle
///   subvol_group_of_faces    Int32, one for each of these faces: the place of its group in the first list, from 0
std::string group_data(const VolumeFaceGroups& groups, std::span<const Group> regions);

/// Groups of faces and names of references of a file.
struct FileGroups {
  VolumeFaceGroups faces;
  std::vector<Group> regions;
};

/// Reads them; a file without them has none. num_points: bound of the points of faces. InputError: lists of wrong
/// length, numbers out of range.
FileGroups read_groups(const VtuArrays& file, std::size_t num_points);

}  // namespace subvol::internal
