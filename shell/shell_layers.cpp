// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/shell_layers.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/mending/visible_normals.h"
#include "subvol/mesh/features.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

namespace subvol {

using namespace internal;
namespace {

void require_faces(const PolygonMesh& surface, const SurfaceNames& names) {
  if (surface.num_faces() == 0) throw InputError("the surface has no faces");
  const auto face_name = [&](std::size_t f) {
    return "face " + std::to_string(names.faces.empty() ? static_cast<Index>(f) : names.faces[f]);
  };
  std::vector<char> used(surface.positions.size(), 0);
  std::vector<Index> flat;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (!surface.positions[v].allFinite()) throw InputError("vertex " + std::to_string(v) + " is not finite");
  for (std::size_t f = 0; f < surface.num_faces(); ++f) {
    const auto face = surface.face(f);
    for (std::size_t k = 0; k < face.size(); ++k) {
      if (face[k] < 0 || static_cast<std::size_t>(face[k]) >= used.size())
        throw InputError(face_name(f) + " names vertex " + std::to_string(face[k]) + " of " +
                         std::to_string(used.size()));
      if (std::find(face.begin(), face.begin() + k, face[k]) != face.begin() + k)
        throw InputError(face_name(f) + " names vertex " + std::to_string(face[k]) + " twice");
      used[face[k]] = 1;
    }
    if (face.size() != 3 && face.size() != 4)
      throw InputError(face_name(f) + " has " + std::to_string(face.size()) +
                       " corners; only triangles and quads can be extruded");
    Vec3 area = Vec3::Zero();
    for (std::size_t k = 0; k < face.size(); ++k) area += corner_normal(surface, f, k);
    if (!(area.norm() > 1e-12)) flat.push_back(static_cast<Index>(f));
  }
  if (!flat.empty()) {
    SurfaceFaults faults;
    faults.flat = std::move(flat);
    throw InputError(to_text(faults, surface, names));
  }
  const auto unused = std::find(used.begin(), used.end(), 0);
  if (unused != used.end()) throw InputError("vertex " + std::to_string(unused - used.begin()) + " belongs to no face");
}

/// Adds the cell of a face in one layer.
void add_cell(VolumeMesh& mesh, const ShellLayers& layers, std::span<const Index> face, int layer) {
  std::array<Index, kMaxCellVertices> corners;
  for (std::size_t k = 0; k < face.size(); ++k) {
    corners[k] = layers.vertex(layer, face[k]);
    corners[face.size() + k] = layers.vertex(layer + 1, face[k]);
  }
  mesh.add_cell(face.size() == 3 ? CellKind::prism : CellKind::hex, {corners.data(), 2 * face.size()});
}

// Vertices, faces and cells have 32-bit numbers, and there are about three faces per cell.
void require_numberable(const PolygonMesh& surface, int inside, int outside) {
  const double most = static_cast<double>(std::numeric_limits<Index>::max()) / 3.5;
  const double cells = (static_cast<double>(inside) + outside) * static_cast<double>(surface.num_faces());
  if (cells > most)
    throw InputError("so many layers would make " + std::to_string(cells) + " cells; at most " + std::to_string(most) +
                     " can be numbered");
}

}  // namespace

std::vector<double> layer_shares(int num_layers, double growth) {
  if (num_layers < 0) throw InputError("layer_shares: num_layers must not be negative");
  if (!(growth > 0) || !std::isfinite(growth)) throw InputError("layer_shares: growth must be positive");
  std::vector<double> shares{0};
  for (int k = 0; k < num_layers; ++k) shares.push_back(shares.back() + std::pow(growth, k));
  if (!std::isfinite(shares.back()))
    throw InputError("layer_shares: " + std::to_string(num_layers) + " layers that grow by " + std::to_string(growth) +
                     " are thicker than any number");
  for (double& share : shares) share /= num_layers > 0 ? shares.back() : 1;
  return shares;
}

double growth_of_layers(double thickness, double first_height, int num_layers) {
  // Ratios of successive layers that are looked for; others are of no use.
  constexpr double kLeastLayerGrowth = 0.01, kMostLayerGrowth = 100;
  const auto text = [](double x) { return formatted("%.6g", x); };
  if (!(thickness > 0) || !(first_height > 0) || !std::isfinite(thickness) || num_layers < 1)
    throw InputError("shell: thickness, first height and number of layers must be positive");
  const auto sum = [&](double growth) {
    double total = 0, height = first_height;
    for (int k = 0; k < num_layers && total <= 2 * thickness; ++k, height *= growth) total += height;
    return total;
  };
  if (num_layers == 1) {
    if (std::abs(first_height - thickness) <= 1e-9 * thickness) return 1;
    throw InputError("shell: one layer is as thick as the shell, " + text(thickness) + ", but its height is to be " +
                     text(first_height) + "; ask for more layers, or for a growth");
  }
  double low = kLeastLayerGrowth, high = kMostLayerGrowth;
  if (!(sum(low) <= thickness))
    throw InputError("shell: a first layer " + text(first_height) + " high leaves no room for " +
                     std::to_string(num_layers - 1) + " more within a thickness of " + text(thickness));
  if (!(sum(high) >= thickness))
    throw InputError("shell: " + std::to_string(num_layers) + " layers, the first " + text(first_height) +
                     " high, do not reach a thickness of " + text(thickness) +
                     " even if each is 100 times as thick as "
                     "the one before; ask for more layers");
  for (int i = 0; i < 200 && low < high; ++i) {
    const double growth = std::sqrt(low * high);
    (sum(growth) < thickness ? low : high) = growth;
  }
  return std::sqrt(low * high);
}

int number_of_layers(double thickness, double first_height, double growth) {
  constexpr int kMostLayers = 1000;  // more are a mistake in the arguments
  if (!(thickness > 0) || !(first_height > 0) || !(growth > 0) || !std::isfinite(thickness))
    throw InputError("shell: thickness, first height and growth must be positive");
  if (first_height > thickness)
    throw InputError(
        formatted("shell: the first layer, %.6g high, is thicker than the shell, %.6g", first_height, thickness));
  double total = 0, height = first_height;
  for (int k = 1; k <= kMostLayers; ++k, height *= growth) {
    const double before = total;
    total += height;
    if (total < thickness) continue;
    return k > 1 && thickness - before < total - thickness ? k - 1 : k;
  }
  throw InputError(
      formatted("shell: layers that begin with a height of %.6g and grow by %.6g reach %.6g at most, not "
                "the thickness of %.6g",
                first_height, growth, total, thickness));
}

void require_visible_layers(const char* owner, const PolygonMesh& surface, double thickness, int num_layers,
                            double growth) {
  // This share of the largest coordinate is some hundred units of its last digit.
  constexpr double kLeastVisibleThicknessShare = 1e-13;
  double largest = 0;
  for (const Vec3& p : surface.positions) largest = std::max(largest, p.lpNorm<Eigen::Infinity>());
  const double least = kLeastVisibleThicknessShare * largest;
  const double first = layer_shares(num_layers, growth)[1] * thickness;
  const double thinnest = first * std::min(1.0, std::pow(growth, num_layers - 1));
  const std::string expected = formatted(" vanishes beside the surface; expected at least %.3g", least);
  if (thickness < least) throw InputError(formatted("%s: thickness %.6g", owner, thickness) + expected);
  if (thinnest < least)
    throw InputError(formatted("%s: growth %.6g makes the thinnest of %d layers %.3g thick, which", owner, growth,
                               num_layers, thinnest) +
                     expected);
}

ShellLayers make_layers(PolygonMesh surface, int inside, int outside, double growth, const SurfaceNames& names) {
  require_faces(surface, names);
  require_numberable(surface, inside, outside);
  ShellLayers layers;
  layers.topology = build_surface(surface.positions.size(), {surface.face_offsets.begin(), surface.face_offsets.end()},
                                  surface.face_vertices, names.vertices, SurfaceKind::maybe_open, surface.positions);
  layers.surface = std::move(surface);
  layers.inside = inside;
  layers.outside = outside;
  layers.inside_shares = layer_shares(inside, growth);
  layers.outside_shares = layer_shares(outside, growth);
  return layers;
}

VolumeMesh stack_cells(const ShellLayers& layers) {
  VolumeMesh mesh;
  for (int sheet = 0; sheet < layers.num_sheets(); ++sheet)
    mesh.positions.insert(mesh.positions.end(), layers.surface.positions.begin(), layers.surface.positions.end());
  for (int layer = 0; layer + 1 < layers.num_sheets(); ++layer)
    for (std::size_t f = 0; f < layers.surface.num_faces(); ++f) {
      add_cell(mesh, layers, layers.surface.face(f), layer);
      mesh.references.push_back(layer + 1);
    }
  return mesh;
}

FeatureTags surface_features(const PolygonMesh& surface, double angle_degrees) {
  // One layer of zero thickness: its first sheet is the surface, and its walls without area count as flat.
  const ShellLayers layers = make_layers(surface, 0, 1, 1);
  FeatureTags tags = features_by_angle(stack_cells(layers), angle_degrees);
  const auto num_columns = static_cast<Index>(layers.num_columns());
  std::erase_if(tags.creases, [&](const CreaseEdge& c) { return std::max(c.v0, c.v1) >= num_columns; });
  std::erase_if(tags.corners, [&](const CornerVertex& c) { return c.vertex >= num_columns; });
  return tags;
}

FeatureTags shell_tags(const ShellLayers& layers, const FeatureTags& tags) {
  const SurfaceTopology& topology = layers.topology;
  FeatureTags border;
  std::set<std::pair<Index, Index>> edges;
  for (const Index h : topology.edge_corners) {
    const Index a = topology.corner_vertices[h], b = topology.corner_vertices[topology.next(h)];
    edges.insert(std::minmax(a, b));
    if (topology.twins[h] == kNoIndex) border.creases.push_back({std::min(a, b), std::max(a, b)});
  }
  for (const CreaseEdge& crease : tags.creases)
    if (!edges.count({crease.v0, crease.v1}))
      throw InputError("shell: crease " + std::to_string(crease.v0) + "-" + std::to_string(crease.v1) +
                       " is no edge of the surface");
  for (const CornerVertex& corner : tags.corners)
    if (corner.vertex < 0 || static_cast<std::size_t>(corner.vertex) >= layers.num_columns())
      throw InputError("shell: corner " + std::to_string(corner.vertex) + " is no vertex of the surface");
  const FeatureTags all = merge_tags(tags, border);
  FeatureTags result;
  for (const int sheet : {0, layers.num_sheets() - 1}) {
    for (const CreaseEdge& c : all.creases)
      result.creases.push_back({layers.vertex(sheet, c.v0), layers.vertex(sheet, c.v1), c.sharpness});
    for (const CornerVertex& c : all.corners) result.corners.push_back({layers.vertex(sheet, c.vertex), c.sharpness});
  }
  return result;
}

std::vector<Vec3> straight_columns(const ShellLayers& layers, std::span<const Vec3> directions,
                                   std::span<const double> thickness) {
  std::vector<Vec3> positions;
  positions.reserve(layers.num_sheets() * layers.num_columns());
  for (int sheet = 0; sheet < layers.num_sheets(); ++sheet)
    for (std::size_t v = 0; v < layers.num_columns(); ++v) {
      const Index strand = layers.strand(layers.vertex(sheet, static_cast<Index>(v)));
      const double height = strand == kNoIndex ? 0 : layers.height(sheet) * thickness[strand];
      positions.push_back(layers.surface.positions[v] + height * directions[v]);
    }
  return positions;
}

CellReference shell_reference(const ShellLayers& layers, std::vector<double> thickness) {
  return [&layers, thickness = std::move(thickness)](Index cell, const Vec3& point) {
    const std::size_t num_faces = layers.surface.num_faces();
    const int layer = static_cast<int>(cell / num_faces);
    const auto face = layers.surface.face(cell % num_faces);
    const double* side = thickness.data() + (layer < layers.inside ? 0 : layers.num_columns());
    const double share = layers.height(layer + 1) - layers.height(layer), u = point[0], v = point[1];
    const auto x = [&](int k) -> const Vec3& { return layers.surface.positions[face[k]]; };
    const auto t = [&](int k) { return side[face[k]]; };
    Mat3 reference;
    double height;
    if (face.size() == 3) {
      reference.col(0) = x(1) - x(0);
      reference.col(1) = x(2) - x(0);
      height = (1 - u - v) * t(0) + u * t(1) + v * t(2);
    } else {
      reference.col(0) = (1 - v) * (x(1) - x(0)) + v * (x(2) - x(3));
      reference.col(1) = (1 - u) * (x(3) - x(0)) + u * (x(2) - x(1));
      height = (1 - v) * ((1 - u) * t(0) + u * t(1)) + v * ((1 - u) * t(3) + u * t(2));
    }
    reference.col(2) = share * height * reference.col(0).cross(reference.col(1)).normalized();
    return reference;
  };
}

VolumeFaceGroups shell_groups(const ShellLayers& layers) {
  const FaceGroups& own = layers.surface.face_groups;
  VolumeFaceGroups result{own.groups, {}};
  const auto is_taken = [&](const std::string& name) {
    return std::any_of(result.groups.begin(), result.groups.end(),
                       [&](const Group& group) { return group.name == name; });
  };
  const auto add_group = [&](const std::string& name) {
    std::string free = is_taken(name) ? "shell " + name : name;
    for (int n = 2; is_taken(free); ++n) free = "shell " + name + " " + std::to_string(n);
    result.groups.push_back({free, free_number(result.groups), 2});
    return static_cast<Index>(result.groups.size() - 1);
  };
  std::array<Index, 4> corners;
  const auto add_sheet = [&](int sheet, const auto& group_of_face) {
    for (std::size_t f = 0; f < layers.surface.num_faces(); ++f) {
      const auto face = layers.surface.face(f);
      for (std::size_t k = 0; k < face.size(); ++k) corners[k] = layers.vertex(sheet, face[k]);
      result.faces.push_back({face_key({corners.data(), face.size()}), group_of_face(f)});
    }
  };
  Index wall = kNoIndex;
  add_sheet(layers.inside, [&](std::size_t f) {
    if (!own.empty() && own.of_face[f] != kNoIndex) return own.of_face[f];
    if (wall == kNoIndex) wall = add_group("wall");
    return wall;
  });
  if (layers.inside > 0) add_sheet(0, [inner = add_group("inner")](std::size_t) { return inner; });
  if (layers.outside > 0)
    add_sheet(layers.num_sheets() - 1, [outer = add_group("outer")](std::size_t) { return outer; });
  Index rim = kNoIndex;
  const SurfaceTopology& topology = layers.topology;
  for (std::size_t h = 0; h < topology.twins.size(); ++h) {
    if (topology.twins[h] != kNoIndex) continue;
    if (rim == kNoIndex) rim = add_group("rim");
    const Index from = topology.corner_vertices[h], to = topology.corner_vertices[topology.next(static_cast<Index>(h))];
    for (int layer = 0; layer + 1 < layers.num_sheets(); ++layer) {
      corners = {layers.vertex(layer, from), layers.vertex(layer, to), layers.vertex(layer + 1, to),
                 layers.vertex(layer + 1, from)};
      result.faces.push_back({face_key(corners), rim});
    }
  }
  normalize(result);
  return result;
}

PolygonMesh sheet_surface(const ShellLayers& layers, const VolumeMesh& cells, int sheet) {
  PolygonMesh surface = layers.surface;
  for (std::size_t v = 0; v < layers.num_columns(); ++v)
    surface.positions[v] = cells.positions[layers.vertex(sheet, static_cast<Index>(v))];
  return surface;
}

PolygonMesh sheet_polygons(const ShellLayers& layers, std::span<const int> sheets) {
  PolygonMesh polygons;
  const auto end_face = [&] { polygons.face_offsets.push_back(polygons.face_vertices.size()); };
  for (const int sheet : sheets)
    for (std::size_t f = 0; f < layers.surface.num_faces(); ++f) {
      for (const Index v : layers.surface.face(f)) polygons.face_vertices.push_back(layers.vertex(sheet, v));
      end_face();
    }
  const SurfaceTopology& topology = layers.topology;
  for (std::size_t h = 0; h < topology.twins.size(); ++h) {
    if (topology.twins[h] != kNoIndex) continue;
    const Index from = topology.corner_vertices[h], to = topology.corner_vertices[topology.next(static_cast<Index>(h))];
    for (int layer = 0; layer + 1 < layers.num_sheets(); ++layer) {
      for (const Index v : {layers.vertex(layer, from), layers.vertex(layer, to), layers.vertex(layer + 1, to),
                            layers.vertex(layer + 1, from)})
        polygons.face_vertices.push_back(v);
      end_face();
    }
  }
  return polygons;
}

}  // namespace subvol
