// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/scene_nodes.h"

#include "subvol/base/error.h"

#include <algorithm>

namespace subvol::internal {

void require_sound_nodes(const std::string& name, const SceneNodes& children, std::size_t root) {
  constexpr std::size_t kMostRepeatedSceneNodes = 1 << 20;  // nodes that share children could double with every level
  enum class State : char { unseen, open, done };
  struct Place {
    std::size_t node, next = 0;
  };
  const std::size_t most = children.size() + kMostRepeatedSceneNodes;
  std::vector<State> states(children.size(), State::unseen);
  std::vector<std::size_t> counts(children.size(), 1);  // of a node and all below it
  std::vector<int> depths(children.size(), 1);
  std::vector<Place> path{{root}};
  states[root] = State::open;
  while (!path.empty()) {
    Place& place = path.back();
    const std::size_t node = place.node;
    if (place.next < children[node].size()) {
      const std::size_t child = children[node][place.next++];
      if (states[child] == State::open) throw InputError(name + ": a node of the scene is a child of itself");
      if (states[child] == State::done) continue;
      states[child] = State::open;
      path.push_back({child});
      continue;
    }
    for (const std::size_t child : children[node]) {
      counts[node] = std::min(counts[node] + counts[child], most + 1);
      depths[node] = std::max(depths[node], depths[child] + 1);
    }
    if (depths[node] > kMostSceneDepth)
      throw InputError(name + ": nodes of the scene nested more than " + std::to_string(kMostSceneDepth) + " deep");
    if (counts[node] > most) throw InputError(name + ": nodes of the scene repeat others more than a million times");
    states[node] = State::done;
    path.pop_back();
  }
}

}  // namespace subvol::internal
