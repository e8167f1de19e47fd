// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/solid_topology.h"

#include "subvol/base/error.h"
#include "subvol/surface/crowded_edges.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include <algorithm>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace subvol {

namespace {

/// Merges vertices of equal position and removes vertices of no triangle. The remaining vertices are numbered in the
/// order in which the triangles name them; `names` receives the smallest input number of each.
TriangleMesh welded(const TriangleMesh& mesh, std::size_t& dropped, std::vector<Index>& names) {
  std::vector<char> used(mesh.positions.size(), 0);
  for (const auto& t : mesh.triangles)
    for (Index v : t) {
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.positions.size() || !mesh.positions[v].allFinite())
        throw InputError("surface: a triangle names a vertex that is not there, or whose position is not finite");
      used[v] = 1;
    }
  std::vector<Index> order;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v]) order.push_back(static_cast<Index>(v));
  const auto less = [&](Index a, Index b) {
    const Vec3 &p = mesh.positions[a], &q = mesh.positions[b];
    return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
  };
  std::stable_sort(order.begin(), order.end(), less);
  std::vector<Index> first(mesh.positions.size(), kNoIndex);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && !less(order[i - 1], order[i]);
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  TriangleMesh result;
  const std::vector<Index>& groups = mesh.face_groups.of_face;
  result.face_groups.groups = mesh.face_groups.groups;
  std::vector<Index> number(mesh.positions.size(), kNoIndex);
  const auto vertex = [&](Index v) {
    Index& n = number[first[v]];
    if (n == kNoIndex) {
      n = static_cast<Index>(result.positions.size());
      result.positions.push_back(mesh.positions[v]);
      names.push_back(first[v]);
    }
    return n;
  };
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const std::array<Index, 3> corners{vertex(t[0]), vertex(t[1]), vertex(t[2])};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      ++dropped;
      continue;
    }
    result.triangles.push_back(corners);
    if (!groups.empty()) result.face_groups.of_face.push_back(groups[i]);
  }
  return result;
}

struct HalfEdge {
  Index low, high, triangle;
  bool forward;
};

std::vector<HalfEdge> sorted_half_edges(const TriangleMesh& mesh) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t e = 0; e < 3; ++e) {
      const Index v = mesh.triangles[t][e], w = mesh.triangles[t][(e + 1) % 3];
      edges.push_back({std::min(v, w), std::max(v, w), static_cast<Index>(t), v < w});
    }
  std::sort(edges.begin(), edges.end(), [](const HalfEdge& a, const HalfEdge& b) {
    return std::tie(a.low, a.high, a.triangle) < std::tie(b.low, b.high, b.triangle);
  });
  return edges;
}

/// Calls visit(run) with the half-edges of each edge.
template <class Visit>
void for_each_edge(std::span<const HalfEdge> edges, Visit&& visit) {
  for (std::size_t first = 0, last; first < edges.size(); first = last) {
    last = first + 1;
    while (last < edges.size() && edges[last].low == edges[first].low && edges[last].high == edges[first].high) ++last;
    visit(edges.subspan(first, last - first));
  }
}

struct Neighbor {
  Index triangle = kNoIndex;
  bool flipped = false;  ///< true if both triangles run the same way along their common edge
};

void require_two_triangles(const TriangleMesh& mesh, std::span<const HalfEdge> edges, std::span<const Index> names) {
  CrowdedEdges crowded;
  const auto name = [&](Index v) { return vertex_text(names[v], &mesh.positions[v]); };
  for_each_edge(edges, [&](std::span<const HalfEdge> run) {
    if (run.size() > 2) crowded.add(name(run[0].low), name(run[0].high), run.size());
  });
  if (!crowded.empty()) throw InputError("surface: it bounds no solid: " + crowded.text());
}

/// Returns the neighbors across the edges of each triangle, in no particular order. names: vertex numbers for messages.
std::vector<std::vector<Neighbor>> neighbors_of(const TriangleMesh& mesh, std::span<const HalfEdge> edges,
                                                std::span<const Index> names) {
  require_two_triangles(mesh, edges, names);
  std::vector<std::vector<Neighbor>> neighbors(mesh.triangles.size());
  for_each_edge(edges, [&](std::span<const HalfEdge> run) {
    if (run.size() < 2) return;
    const bool flipped = run[0].forward == run[1].forward;
    neighbors[run[0].triangle].push_back({run[1].triangle, flipped});
    neighbors[run[1].triangle].push_back({run[0].triangle, flipped});
  });
  return neighbors;
}

/// Flips triangles to agree with their neighbors; the majority of a component stays as it is. Returns the component of
/// each triangle, or -1 for a triangle without neighbors.
std::vector<int> orient(TriangleMesh& mesh, std::span<const Index> names, SolidBoundary& result) {
  const auto neighbors = neighbors_of(mesh, sorted_half_edges(mesh), names);
  std::vector<int> component(mesh.triangles.size(), -1);
  std::vector<char> turned(mesh.triangles.size(), 0);
  std::vector<Index> queue;
  int count = 0;
  for (std::size_t seed = 0; seed < mesh.triangles.size(); ++seed) {
    if (component[seed] >= 0 || neighbors[seed].empty()) continue;
    queue.assign(1, static_cast<Index>(seed));
    component[seed] = count;
    for (std::size_t q = 0; q < queue.size(); ++q) {
      const auto t = static_cast<std::size_t>(queue[q]);
      for (const Neighbor& n : neighbors[t]) {
        const auto other = static_cast<std::size_t>(n.triangle);
        const char wanted = static_cast<char>(turned[t] != static_cast<char>(n.flipped));
        if (component[other] < 0) {
          component[other] = count;
          turned[other] = wanted;
          queue.push_back(n.triangle);
        } else if (turned[other] != wanted) {
          throw InputError("surface: it cannot be oriented (around triangle " + std::to_string(other) + ")");
        }
      }
    }
    const auto num_turned = static_cast<std::size_t>(
        std::count_if(queue.begin(), queue.end(), [&](Index t) { return turned[t] != 0; }));
    const bool majority_turned = 2 * num_turned > queue.size();
    for (Index t : queue)
      if ((turned[t] != 0) != majority_turned) {
        auto& corners = mesh.triangles[t];
        std::swap(corners[1], corners[2]);
        ++result.flipped_triangles;
      }
    ++count;
  }
  return component;
}

/// Drops the triangles that belong to no component.
void drop_loners(TriangleMesh& mesh, std::vector<int>& component, SolidBoundary& result) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < component.size(); ++t) {
    if (component[t] < 0) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    if (!mesh.face_groups.empty()) mesh.face_groups.of_face[kept] = mesh.face_groups.of_face[t];
    component[kept++] = component[t];
  }
  result.dropped_triangles += component.size() - kept;
  mesh.triangles.resize(kept);
  if (!mesh.face_groups.empty()) mesh.face_groups.of_face.resize(kept);
  component.resize(kept);
}

/// Closes every loop of boundary edges, those with one triangle, by a fan.
void close_holes(TriangleMesh& mesh, std::vector<int>& component, SolidBoundary& result) {
  std::vector<std::array<Index, 3>> rims;  // from, to, triangle
  for_each_edge(sorted_half_edges(mesh), [&](std::span<const HalfEdge> run) {
    if (run.size() == 1)
      rims.push_back(
          {run[0].forward ? run[0].low : run[0].high, run[0].forward ? run[0].high : run[0].low, run[0].triangle});
  });
  std::sort(rims.begin(), rims.end());
  std::vector<std::size_t> left(mesh.positions.size(), rims.size());  // each vertex's first unused edge
  for (std::size_t i = rims.size(); i-- > 0;) left[rims[i][0]] = i;
  for (std::size_t start = 0; start < rims.size(); ++start) {
    if (start < left[rims[start][0]]) continue;
    std::vector<std::size_t> loop;
    Vec3 mean = Vec3::Zero();
    // As many boundary edges leave a vertex as enter it, so a walk returns to its start.
    for (std::size_t at = start;;) {
      left[rims[at][0]] = at + 1;
      loop.push_back(at);
      mean += mesh.positions[rims[at][0]];
      const Index next = rims[at][1];
      if (next == rims[start][0]) break;
      at = left[next];
      if (at == rims.size() || rims[at][0] != next)
        throw InputError("surface: the rim of a hole does not close at vertex " + std::to_string(next));
    }
    const auto centre = static_cast<Index>(mesh.positions.size());
    mesh.positions.push_back(mean / static_cast<double>(loop.size()));
    for (std::size_t at : loop) {
      mesh.triangles.push_back({rims[at][1], rims[at][0], centre});
      component.push_back(component[rims[at][2]]);
      if (!mesh.face_groups.empty()) mesh.face_groups.of_face.push_back(kNoIndex);
    }
    ++result.closed_holes;
  }
}

/// Returns vertices - edges + triangles of each component; each fan at a vertex counts as a vertex of its own.
std::vector<int> euler_numbers(const TriangleMesh& mesh, std::span<const int> component, int count) {
  std::vector<int> euler(static_cast<std::size_t>(count), 0);
  // Corners at one vertex that share an edge belong to one fan.
  std::vector<Index> group(3 * mesh.triangles.size());
  std::iota(group.begin(), group.end(), 0);
  const auto root = [&](Index c) {
    while (group[c] != c) c = group[c] = group[group[c]];
    return c;
  };
  const auto corner = [&](Index t, Index v) {
    const auto& corners = mesh.triangles[t];
    return static_cast<Index>(3 * t + (corners[0] == v ? 0 : corners[1] == v ? 1 : 2));
  };
  const std::vector<HalfEdge> edges = sorted_half_edges(mesh);
  for_each_edge(edges, [&](std::span<const HalfEdge> run) {
    --euler[component[run[0].triangle]];
    for (const HalfEdge& edge : run.subspan(1))
      for (Index v : {edge.low, edge.high}) {
        const Index a = root(corner(run[0].triangle, v)), b = root(corner(edge.triangle, v));
        group[std::max(a, b)] = std::min(a, b);
      }
  });
  for (std::size_t c = 0; c < group.size(); ++c)
    if (group[c] == static_cast<Index>(c)) ++euler[component[c / 3]];
  for (int c : component) ++euler[c];
  return euler;
}

struct Component {
  double volume = 0;  ///< signed
  Eigen::AlignedBox3d box;
};

std::vector<Component> measured(const TriangleMesh& mesh, std::span<const int> component, int count) {
  std::vector<Component> result(static_cast<std::size_t>(count));
  const Vec3 origin = mesh.positions[mesh.triangles.front()[0]];
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Component& c = result[component[t]];
    std::array<Vec3, 3> p;
    for (std::size_t i = 0; i < 3; ++i) {
      p[i] = mesh.positions[mesh.triangles[t][i]] - origin;
      c.box.extend(p[i]);
    }
    c.volume += p[0].dot(p[1].cross(p[2])) / 6;
  }
  return result;
}

/// Finds out if one of many boxes contains a given box: a tree with the largest box of each branch at its root.
class BoxTree {
 public:
  explicit BoxTree(std::vector<Eigen::AlignedBox3d> boxes) : boxes_(std::move(boxes)), hulls_(boxes_.size()) {
    arrange(0, boxes_.size());
  }
  bool holds(const Eigen::AlignedBox3d& box) const { return holds(0, boxes_.size(), box); }

 private:
  /// A branch holds the boxes first .. last - 1: its root at `first`, and two branches of half of the others each.
  /// Returns the place where the second one begins.
  static std::size_t middle(std::size_t first, std::size_t last) { return first + 1 + (last - first - 1) / 2; }

  void arrange(std::size_t first, std::size_t last) {
    if (first == last) return;
    const auto at = [&](std::size_t i) { return boxes_.begin() + static_cast<std::ptrdiff_t>(i); };
    for (std::size_t i = first; i < last; ++i) hulls_[first].extend(boxes_[i]);
    std::iter_swap(at(first), std::max_element(at(first), at(last), [](const auto& a, const auto& b) {
      return a.diagonal().maxCoeff() < b.diagonal().maxCoeff();
    }));
    int axis = 0;
    hulls_[first].diagonal().maxCoeff(&axis);
    const std::size_t half = middle(first, last);
    std::nth_element(at(first + 1), at(half), at(last),
                     [&](const auto& a, const auto& b) { return a.min()[axis] < b.min()[axis]; });
    arrange(first + 1, half);
    arrange(half, last);
  }
  bool holds(std::size_t first, std::size_t last, const Eigen::AlignedBox3d& box) const {
    if (first == last || !hulls_[first].contains(box)) return false;
    const std::size_t half = middle(first, last);
    return boxes_[first].contains(box) || holds(first + 1, half, box) || holds(half, last, box);
  }

  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<Eigen::AlignedBox3d> hulls_;  ///< bounding box of the branch that begins at each place
};

/// Marks the walls of voids: components whose signed volume is opposite to the total and that lie inside the box of a
/// component of the total's sign.
std::vector<char> find_cavities(std::span<const Component> parts) {
  const double total =
      std::accumulate(parts.begin(), parts.end(), 0.0, [](double s, const Component& c) { return s + c.volume; });
  const auto with_whole = [&](const Component& part) { return part.volume * total > 0; };
  std::vector<Eigen::AlignedBox3d> outer;
  for (const Component& part : parts)
    if (with_whole(part)) outer.push_back(part.box);
  const BoxTree tree(std::move(outer));
  std::vector<char> cavity(parts.size(), 0);
  for (std::size_t c = 0; c < parts.size(); ++c) cavity[c] = !with_whole(parts[c]) && tree.holds(parts[c].box);
  return cavity;
}

}  // namespace

std::string to_string(const BettiNumbers& numbers) {
  const auto counted = [](int n, const char* one, const char* many) {
    return std::to_string(n) + ' ' + (n == 1 ? one : many);
  };
  return counted(numbers.components, "component", "components") + ", " + counted(numbers.handles, "handle", "handles") +
         ", " + counted(numbers.cavities, "cavity", "cavities");
}

SolidBoundary solid_boundary(const TriangleMesh& surface) {
  SolidBoundary result;
  std::vector<Index> names;
  TriangleMesh mesh = welded(surface, result.dropped_triangles, names);
  std::vector<int> component = orient(mesh, names, result);
  drop_loners(mesh, component, result);
  if (mesh.triangles.empty()) throw InputError("surface: it has no triangles that share an edge");
  close_holes(mesh, component, result);
  const int count = *std::max_element(component.begin(), component.end()) + 1;
  const std::vector<Component> parts = measured(mesh, component, count);
  const std::vector<char> cavity = find_cavities(parts);
  const std::vector<int> euler = euler_numbers(mesh, component, count);
  for (std::size_t c = 0; c < parts.size(); ++c) {
    ++(cavity[c] ? result.topology.cavities : result.topology.components);
    result.topology.handles += (2 - euler[c]) / 2;
    result.volume += cavity[c] ? -std::abs(parts[c].volume) : std::abs(parts[c].volume);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto c = static_cast<std::size_t>(component[t]);
    if ((parts[c].volume > 0) == (cavity[c] != 0)) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  }
  // A surface with a volume below kFlat area^(3/2) is flat up to rounding.
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3& a = mesh.positions[t[0]];
    area += (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a).norm() / 2;
  }
  constexpr double kFlat = 1e-6;
  if (!(result.volume > kFlat * area * std::sqrt(area))) throw InputError("surface: it encloses no volume");
  result.surface = std::move(mesh);
  return result;
}

}  // namespace subvol
