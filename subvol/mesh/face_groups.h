// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <compare>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

class MeshTopology;

/// A named set of faces or cells: what files call group, physical group, solid, material, side set or reference.
struct Group {
  std::string name;   ///< may be empty: the group has only a number
  int number = 0;     ///< what formats without names write
  int dimension = 2;  ///< 2: of faces; 3: of cells
  friend bool operator==(const Group&, const Group&) = default;
};

/// Rewrites names that are not UTF-8 as if they were Latin-1, as older programs write them: most formats, and the
/// programs that read them, expect UTF-8.
void make_names_utf8(std::vector<Group>& groups);

/// The groups of a surface's faces. A face is in one group or in none. Without groups, both lists are empty.
struct FaceGroups {
  std::vector<Group> groups;   ///< no two have the same number
  std::vector<Index> of_face;  ///< one entry per triangle or polygon: a place in `groups`, or kNoIndex
  bool empty() const { return groups.empty(); }
  friend bool operator==(const FaceGroups&, const FaceGroups&) = default;
};

/// The vertices of a face of a volume mesh in ascending order; the fourth of a triangle is kNoIndex.
using FaceKey = std::array<Index, 4>;

/// Returns the key of a face from its 3 or 4 corners in any order.
FaceKey face_key(std::span<const Index> corners);

/// A face of a volume mesh that is in a group: a place in `VolumeFaceGroups::groups`.
struct GroupedFace {
  FaceKey face;
  Index group;
  friend auto operator<=>(const GroupedFace&, const GroupedFace&) = default;
};

/// The groups of a volume mesh's faces, those of the boundary and those between cells.
///
/// Faces are named by their vertices, as tags are, so that cells may be renumbered, turned and dropped. A face may be
/// in several groups. A face that the mesh does not have is no error: writers leave it out.
struct VolumeFaceGroups {
  std::vector<Group> groups;       ///< no two have the same number
  std::vector<GroupedFace> faces;  ///< ascending, none twice
  bool empty() const { return groups.empty(); }
  friend bool operator==(const VolumeFaceGroups&, const VolumeFaceGroups&) = default;
};

/// Sorts the faces and drops those that are there twice.
void normalize(VolumeFaceGroups& groups);

/// Returns the first group of a face, the one with the lowest place, or kNoIndex. Cost: logarithmic.
Index group_of(const VolumeFaceGroups& groups, std::span<const Index> corners);

/// Returns the first group of each boundary face, in the order of `MeshTopology::boundary_faces()`; empty if there are
/// no groups.
std::vector<Index> groups_of_boundary(const VolumeFaceGroups& groups, const MeshTopology& topology);

/// Returns groups of boundary faces.
///
/// of_boundary_face  a place in `groups`, or kNoIndex, for each entry of `MeshTopology::boundary_faces()`.
VolumeFaceGroups groups_from_boundary(std::vector<Group> groups, const MeshTopology& topology,
                                      std::span<const Index> of_boundary_face);

/// Returns the groups after the vertices have been renumbered. A face is dropped if one of its vertices is (kNoIndex),
/// or if two of them become one.
///
/// number  new number of each vertex, or kNoIndex; one entry per vertex of the mesh.
VolumeFaceGroups renumbered(const VolumeFaceGroups& groups, std::span<const Index> number);

/// Returns the groups without those faces that the mesh does not have.
VolumeFaceGroups groups_of_faces(const VolumeFaceGroups& groups, const MeshTopology& topology);

/// Appends the groups of another mesh whose vertices are numbered from `first_vertex` on. Groups with the same name and
/// number, or without a name and with the same number, become one; a number that is taken is replaced by the lowest
/// positive one that is free.
void append_groups(VolumeFaceGroups& groups, const VolumeFaceGroups& others, Index first_vertex);

/// Returns the lowest positive number that no group of a list has.
int free_number(std::span<const Group> groups);

/// Returns the name of a group for people: its name, or "group 7" if it has none.
std::string label_of(const Group& group);

/// Collects the groups of a file by name or by number while its faces are read.
class GroupList {
 public:
  /// Returns the place of the group with this name; a new one has the lowest free positive number.
  Index by_name(const std::string& name, int dimension = 2);
  /// Returns the place of the group with this number; a new one has no name.
  Index by_number(int number, int dimension = 2);
  std::vector<Group> take() { return std::move(groups_); }
  const std::vector<Group>& groups() const { return groups_; }

 private:
  Index add(Group group);

  std::vector<Group> groups_;
  std::map<std::string, Index> names_;
  std::map<int, Index> numbers_;
  int next_number_ = 1;
};

}  // namespace subvol
