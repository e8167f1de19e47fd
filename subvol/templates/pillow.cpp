// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/pillow.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/base/sort_unique.h"
#include "subvol/mesh/face_groups.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/surface_topology.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/templates/template_edit.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

// With less than 1/6, no cell of a mesh of equal cubes can be inverted: each edge keeps more than half its length in
// its own direction.
constexpr double kPillowStepShare = 0.15;
constexpr double kPillowSamePlaneCosine = 0.99;  // above it, two faces count as one plane

std::vector<char> marked(const VolumeMesh& mesh, std::span<const Index> cells) {
  std::vector<char> in_set(mesh.num_cells(), cells.empty());
  for (Index c : cells) {
    if (c < 0 || static_cast<std::size_t>(c) >= mesh.num_cells())
      throw InputError("pillow: there is no cell " + std::to_string(c));
    if (in_set[c]) throw InputError("pillow: cell " + std::to_string(c) + " is given twice");
    in_set[c] = 1;
  }
  return in_set;
}

/// A face of the set's boundary, seen from outside.
struct SetFace {
  std::array<Index, 4> corners;
  std::size_t size, cell;
  std::span<const Index> vertices() const { return {corners.data(), size}; }
};

std::vector<SetFace> boundary_of_set(const VolumeMesh& mesh, const MeshTopology& topology,
                                     std::span<const char> in_set) {
  std::vector<SetFace> faces;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (!in_set[c]) continue;
    const CellTopology& local = cell_topology(mesh.kinds[c]);
    for (int f = 0; f < local.num_faces; ++f) {
      const auto& cells = topology.face_cells(topology.cell_faces(c)[f]);
      const Index other = cells[0] == static_cast<Index>(c) ? cells[1] : cells[0];
      if (other != kNoIndex && in_set[other]) continue;
      SetFace face{{}, static_cast<std::size_t>(local.face_sizes[f]), c};
      for (std::size_t i = 0; i < face.size; ++i) face.corners[i] = mesh.cell(c)[local.faces[f][i]];
      faces.push_back(face);
    }
  }
  return faces;
}

/// New vertex number of each old vertex on the faces, counted from `num_vertices` in the old order; kNoIndex for
/// vertices on none.
std::vector<Index> new_numbers(std::size_t num_vertices, std::span<const SetFace> faces) {
  std::vector<Index> number(num_vertices, kNoIndex);
  for (const SetFace& face : faces)
    for (Index v : face.vertices()) number[v] = 0;
  Index next = static_cast<Index>(num_vertices);
  for (Index& n : number)
    if (n != kNoIndex) n = next++;
  return number;
}

/// origins  numbers of the old vertices for the message.
void require_manifold(std::span<const SetFace> faces, std::span<const Index> number, std::span<const Index> origins) {
  std::vector<Index> names, offsets{0}, corners;
  const std::size_t num_vertices = number.size();
  for (std::size_t v = 0; v < num_vertices; ++v)
    if (number[v] != kNoIndex) names.push_back(origins[v]);
  for (const SetFace& face : faces) {
    for (Index v : face.vertices()) corners.push_back(number[v] - static_cast<Index>(num_vertices));
    offsets.push_back(static_cast<Index>(corners.size()));
  }
  try {
    build_surface(names.size(), offsets, corners, names);
  } catch (const InputError& error) {
    throw InputError(std::string("pillow: the boundary of the cells is no manifold: ") + error.what());
  }
}

/// Displacement of each vertex of the faces: against the sum of its distinct normals, in proportion to its shortest
/// edge in the set.
std::vector<Vec3> steps_inward(const VolumeMesh& mesh, std::span<const SetFace> faces, std::span<const char> in_set) {
  std::vector<double> shortest(mesh.num_vertices(), std::numeric_limits<double>::infinity());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (!in_set[c]) continue;
    const CellTopology& local = cell_topology(mesh.kinds[c]);
    for (int e = 0; e < local.num_edges; ++e) {
      const Index a = mesh.cell(c)[local.edges[e][0]], b = mesh.cell(c)[local.edges[e][1]];
      const double length = (mesh.positions[a] - mesh.positions[b]).norm();
      shortest[a] = std::min(shortest[a], length);
      shortest[b] = std::min(shortest[b], length);
    }
  }
  std::vector<std::vector<Vec3>> normals(mesh.num_vertices());
  for (const SetFace& face : faces) {
    const Vec3 n = normal_of_face(mesh.positions, face.vertices());
    for (Index v : face.vertices())
      if (std::none_of(normals[v].begin(), normals[v].end(),
                       [&](const Vec3& m) { return m.dot(n) > kPillowSamePlaneCosine; }))
        normals[v].push_back(n);
  }
  std::vector<Vec3> steps(mesh.num_vertices(), Vec3::Zero());
  for (std::size_t v = 0; v < steps.size(); ++v)
    for (const Vec3& n : normals[v]) steps[v] -= kPillowStepShare * shortest[v] * n;
  return steps;
}

/// Halves the steps of the vertices of inverted cells until no cell is inverted, or until nothing is left of a step.
void shorten_steps(VolumeMesh& mesh, std::span<const Index> number, std::span<const Vec3> steps) {
  constexpr int kMostPillowHalvings = 20;  // 1e-6 of a step is none
  std::vector<Index> old(mesh.num_vertices(), kNoIndex);
  for (std::size_t v = 0; v < number.size(); ++v)
    if (number[v] != kNoIndex) old[number[v]] = static_cast<Index>(v);
  std::vector<double> share(number.size(), 1.0);
  for (int round = 0; round < kMostPillowHalvings; ++round) {
    std::vector<char> shorten(number.size(), 0);
    bool any = false;
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      if (corners_positive(mesh, c)) continue;
      for (Index v : mesh.cell(c))
        if (old[v] != kNoIndex) shorten[old[v]] = 1, any = true;
    }
    if (!any) return;
    for (std::size_t v = 0; v < shorten.size(); ++v) {
      if (!shorten[v]) continue;
      share[v] /= 2;
      mesh.positions[number[v]] = mesh.positions[v] + share[v] * steps[v];
    }
  }
}

/// Throws InputError if a cell is inverted.
/// origins  numbers of all vertices for the message.
void require_upright(const VolumeMesh& mesh, std::span<const Index> origins) {
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (!corners_positive(mesh, c))
      throw InputError("pillow: no direction keeps all cells valid around vertex " +
                       std::to_string(origins[mesh.cell(c)[0]]));
}

/// Returns the faces of those connected parts of a boundary that are wanted.
std::vector<SetFace> chosen_parts(std::span<const SetFace> faces, std::size_t num_vertices, int reference,
                                  const PillowChoice& takes) {
  DisjointSets vertices(num_vertices);
  for (const SetFace& face : faces)
    for (const Index v : face.vertices()) vertices.join(v, face.corners[0]);
  std::map<Index, std::vector<std::array<Index, 4>>> parts;
  const auto corners = [](const SetFace& face) {
    std::array<Index, 4> all = face.corners;
    for (std::size_t i = face.size; i < all.size(); ++i) all[i] = kNoIndex;
    return all;
  };
  for (const SetFace& face : faces) parts[vertices.of(face.corners[0])].push_back(corners(face));
  std::map<Index, bool> is_wanted;
  for (const auto& [first, members] : parts) is_wanted[first] = takes(reference, members);
  std::vector<SetFace> chosen;
  for (const SetFace& face : faces)
    if (is_wanted[vertices.of(face.corners[0])]) chosen.push_back(face);
  return chosen;
}

using EdgeKey = std::array<Index, 2>;
EdgeKey edge_key(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

template <class Key>
bool has_key(const std::vector<Key>& sorted, const Key& key) {
  return std::binary_search(sorted.begin(), sorted.end(), key);
}

/// Keys of the faces that get a layer and of their edges, sorted.
struct LayerKeys {
  std::vector<FaceKey> faces;
  std::vector<EdgeKey> edges;

  explicit LayerKeys(std::span<const SetFace> layer) {
    for (const SetFace& face : layer) {
      faces.push_back(face_key(face.vertices()));
      for (std::size_t i = 0; i < face.size; ++i)
        edges.push_back(edge_key(face.corners[i], face.corners[(i + 1) % face.size]));
    }
    sort_unique(faces);
    sort_unique(edges);
  }
};

/// Moves the groups of faces inside a set to the set's new vertices. If such a face ends at the layer, the side faces
/// of the layer's cells go on from its edge to the old one, and are in the group as well.
void carry_inner_groups(const VolumeMesh& mesh, std::span<const char> in_set, const LayerKeys& layer,
                        std::span<const Index> number, VolumeFaceGroups& groups) {
  std::map<FaceKey, std::vector<Index>> inner;  // corners of the set's faces without a layer
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (!in_set[c]) continue;
    const CellTopology& local = cell_topology(mesh.kinds[c]);
    for (int f = 0; f < local.num_faces; ++f) {
      std::vector<Index> corners;
      for (int i = 0; i < local.face_sizes[f]; ++i) corners.push_back(mesh.cell(c)[local.faces[f][i]]);
      const bool moves = std::ranges::any_of(corners, [&](Index v) { return number[v] != kNoIndex; });
      if (const FaceKey key = face_key(corners); moves && !has_key(layer.faces, key)) inner[key] = std::move(corners);
    }
  }
  const std::size_t given = groups.faces.size();
  for (std::size_t i = 0; i < given; ++i) {
    const auto found = inner.find(groups.faces[i].face);
    if (found == inner.end()) continue;
    const Index group = groups.faces[i].group;
    std::vector<Index> moved = found->second;
    for (Index& v : moved)
      if (number[v] != kNoIndex) v = number[v];
    groups.faces[i].face = face_key(moved);
    for (std::size_t k = 0; k < moved.size(); ++k) {
      const Index a = found->second[k], b = found->second[(k + 1) % moved.size()];
      if (has_key(layer.edges, edge_key(a, b)))
        groups.faces.push_back({face_key(std::array{a, b, number[b], number[a]}), group});
    }
  }
  normalize(groups);
}

/// Moves the creases inside a set to the set's new vertices. A crease that ends at the layer goes on through it.
void carry_inner_creases(const VolumeMesh& mesh, std::span<const char> in_set, const LayerKeys& layer,
                         std::span<const Index> number, VolumeMesh& result) {
  std::vector<EdgeKey> edges;  // of the set's cells
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (!in_set[c]) continue;
    const CellTopology& local = cell_topology(mesh.kinds[c]);
    for (int e = 0; e < local.num_edges; ++e)
      edges.push_back(edge_key(mesh.cell(c)[local.edges[e][0]], mesh.cell(c)[local.edges[e][1]]));
  }
  sort_unique(edges);
  bool changed = false;
  std::vector<CreaseEdge> through;
  for (CreaseEdge& crease : result.tags.creases) {
    const EdgeKey key = edge_key(crease.v0, crease.v1);
    if (has_key(layer.edges, key) || !has_key(edges, key)) continue;
    for (Index* const v : {&crease.v0, &crease.v1}) {
      if (number[*v] == kNoIndex) continue;
      through.push_back({*v, number[*v], crease.sharpness});
      *v = number[*v];
      changed = true;
    }
  }
  if (!changed) return;
  result.tags.creases.insert(result.tags.creases.end(), through.begin(), through.end());
  normalize_tags(result.tags);
  drop_lost_tags(result);
}

/// Puts a layer inside some faces of the boundary of a set.
/// origins  number in the caller's input of each vertex; those of the new ones are appended.
VolumeMesh pillowed(const VolumeMesh& mesh, std::span<const SetFace> faces, std::span<const char> in_set,
                    InvertedCells inverted, std::vector<Index>& origins) {
  const std::vector<Index> number = new_numbers(mesh.num_vertices(), faces);
  require_manifold(faces, number, origins);
  for (std::size_t v = 0; v < number.size(); ++v)
    if (number[v] != kNoIndex) origins.push_back(origins[v]);
  const std::vector<Vec3> steps = steps_inward(mesh, faces, in_set);

  VolumeMesh result = mesh;
  for (std::size_t v = 0; v < number.size(); ++v)
    if (number[v] != kNoIndex) result.positions.push_back(mesh.positions[v] + steps[v]);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (std::size_t i = mesh.cell_offsets[c]; in_set[c] && i < mesh.cell_offsets[c + 1]; ++i)
      if (const Index n = number[mesh.cell_vertices[i]]; n != kNoIndex) result.cell_vertices[i] = n;
  std::vector<Index> corners;
  for (const SetFace& face : faces) {
    corners.clear();
    for (Index v : face.vertices()) corners.push_back(number[v]);
    corners.insert(corners.end(), face.vertices().begin(), face.vertices().end());
    result.add_cell(face.size == 4 ? CellKind::hex : CellKind::prism, corners);
    if (!mesh.references.empty()) result.references.push_back(mesh.references[face.cell]);
  }
  shorten_steps(result, number, steps);
  if (inverted == InvertedCells::refused) require_upright(result, origins);
  const LayerKeys layer(faces);
  if (!mesh.face_groups.empty()) carry_inner_groups(mesh, in_set, layer, number, result.face_groups);
  if (!mesh.tags.creases.empty()) carry_inner_creases(mesh, in_set, layer, number, result);
  return result;
}

std::vector<Index> own_numbers(const VolumeMesh& mesh) {
  std::vector<Index> numbers(mesh.num_vertices());
  std::iota(numbers.begin(), numbers.end(), Index{0});
  return numbers;
}

}  // namespace

VolumeMesh pillow(const VolumeMesh& mesh, std::span<const Index> cells, InvertedCells inverted) {
  require_valid(mesh, "pillow", inverted);
  const std::vector<char> in_set = marked(mesh, cells);
  std::vector<Index> origins = own_numbers(mesh);
  return pillowed(mesh, boundary_of_set(mesh, MeshTopology(mesh), in_set), in_set, inverted, origins);
}

VolumeMesh pillow_regions(const VolumeMesh& mesh, const PillowChoice& takes) {
  require_valid(mesh, "pillow");
  VolumeMesh result = mesh;
  std::vector<Index> origins = own_numbers(mesh);
  for (const int reference : region_references(mesh)) {
    std::vector<char> in_set;
    for (std::size_t c = 0; c < result.num_cells(); ++c)
      in_set.push_back(mesh.references.empty() || result.references[c] == reference);
    std::vector<SetFace> faces = boundary_of_set(result, MeshTopology(result), in_set);
    if (takes) faces = chosen_parts(faces, result.num_vertices(), reference, takes);
    if (!faces.empty()) result = pillowed(result, faces, in_set, InvertedCells::refused, origins);
  }
  return result;
}

}  // namespace subvol
