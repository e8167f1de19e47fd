// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::internal {

/// The children of each node of a scene; several nodes may share a child.
using SceneNodes = std::vector<std::vector<std::size_t>>;

/// Largest depth of nodes, and of elements of a file, in one another: programs that read them recurse.
inline constexpr int kMostSceneDepth = 500;

/// Throws InputError, naming the file, unless the nodes below `root` can be written out as a tree: if a node is below
/// itself, if nodes are in one another deeper than kMostSceneDepth, or if shared nodes make far more than there are.
void require_sound_nodes(const std::string& name, const SceneNodes& children, std::size_t root);

/// Throw InputError, naming the file, if the nodes of a scene are as above or its elements are too deep in one another.
/// Assimp would take all memory or run over the end of the stack. The same for accessors of COLLADA that reach beyond
/// their arrays, which Assimp reads. All other faults are left for Assimp to find.
void require_sound_collada(const std::string& name, std::string_view bytes);
void require_sound_fbx(const std::string& name, std::string_view bytes);

}  // namespace subvol::internal
