// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/io/file_place.h"
#include "subvol/io/inp_sets.h"
#include "subvol/io/left_out.h"
#include "subvol/io/nodal_formats.h"
#include "subvol/io/nodal_mesh.h"

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace subvol::internal {

/// A solid element of Abaqus: the digits of its type after "3D".
struct InpType {
  int digits;
  CellKind kind;
  int order;
};

/// The content of an Abaqus or CalculiX file. Nodes and elements keep the numbers that they have in the file, because a
/// line may name one that comes later.
struct InpContent {
  struct Element {
    const InpType* type;
    std::size_t first_node, num_nodes;
    std::size_t set;  ///< of *ELEMENT, ELSET=; InpSets::kNoInpSet if it has none
    FilePlace place;
  };
  struct Shell {
    std::size_t end;  ///< of its nodes
    std::size_t set;
    FilePlace place;
  };
  struct Side {
    std::int64_t element;  ///< its number, if `set` is InpSets::kNoInpSet
    std::size_t set;
    int number;     ///< of the face
    Index surface;  ///< place in the list of groups
    FilePlace place;
  };

  InpContent() = default;
  InpContent(const InpContent&) = delete;  // sets refer to the maps
  InpContent& operator=(const InpContent&) = delete;

  std::vector<Vec3> positions;
  std::unordered_map<std::int64_t, Index> nodes, elements_by_label;  ///< places by number
  InpSets element_sets{"*ELSET", elements_by_label}, node_sets{"*NSET", nodes};
  std::vector<Element> elements;
  std::vector<std::int64_t> element_nodes;
  std::vector<Shell> shells;
  std::vector<std::int64_t> shell_nodes;           ///< corners
  std::map<std::string, std::size_t> num_skipped;  ///< lines of elements of other types, but for
  std::map<std::string, std::size_t> num_shells;   ///< those of shells
  std::vector<std::size_t> sections;               ///< their sets of elements
  GroupList faces;                                 ///< groups of the surfaces
  std::map<Index, std::string> plain_names;        ///< of surfaces of instances, without the instance
  std::vector<Side> sides;
  LeftOut left_out;
};

/// Returns the number of a name such as REFERENCE_7, or REFERENCE_M7 for -7; nothing if it is no such name.
std::optional<int> inp_number(const std::string& name, std::string_view prefix);

/// Makes the mesh: cells, groups of faces, references and regions; without cells, a surface of the shells. The sets are
/// closed. InputError, with file and line: a node, a face or an element set that there is not.
NodalMesh mesh_of_inp(InpContent& content);

}  // namespace subvol::internal
