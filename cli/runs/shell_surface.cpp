// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/shell_surface.h"

#include "cli/runs/exit_status.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/text_scanner.h"
#include "subvol/mesh/features.h"
#include "subvol/shell/partial_surface.h"
#include "subvol/shell/region_faces.h"
#include "subvol/shell/shell_layers.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <cmath>

namespace subvol::cli {

using namespace internal;
namespace {

/// Parses X,Y,Z.
std::optional<Vec3> point_of(const std::string& text) {
  Vec3 point;
  std::size_t begin = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t end = axis < 2 ? text.find(',', begin) : text.size();
    if (end == std::string::npos) return std::nullopt;
    const auto number = parse_number(std::string_view(text).substr(begin, end - begin));
    if (!number || !std::isfinite(*number)) return std::nullopt;
    point[axis] = *number;
    begin = end + 1;
  }
  return point;
}

std::vector<char> patch_named(const PolygonMesh& surface, const std::string& name) {
  const FaceGroups& groups = surface.face_groups;
  std::string known;
  std::vector<char> is_in(surface.num_faces(), 0);
  bool found = false;
  for (std::size_t g = 0; g < groups.groups.size(); ++g) {
    const Group& group = groups.groups[g];
    known += (known.empty() ? "" : ", ") + std::to_string(group.number) + " (" + label_of(group) + ")";
    if (name != group.name && name != std::to_string(group.number)) continue;
    found = true;
    for (std::size_t f = 0; f < is_in.size(); ++f) is_in[f] |= groups.of_face[f] == static_cast<Index>(g);
  }
  if (found) return is_in;
  if (const std::optional<Vec3> point = point_of(name)) return patch_of_face(surface, closest_face(surface, *point));
  throw UsageError("--skip: the surface has no group " + in_quotes(name) + (known.empty() ? "" : "; it has " + known) +
                   "; a patch between sharp edges can be given by a point on it, as X,Y,Z");
}

double area_of(const PolygonMesh& surface, const std::vector<char>& is_in) {
  std::vector<Index> face;
  const TriangleMesh triangles = triangulate(surface, &face);
  double area = 0;
  for (std::size_t t = 0; t < triangles.triangles.size(); ++t)
    if (is_in[face[t]]) area += triangle_area(triangles, triangles.triangles[t]);
  return area;
}

/// Replaces numbers of the present surface by those that they had before.
void renumber(const std::vector<Index>& numbers, std::vector<Index>& before) {
  std::vector<Index> now;
  for (const Index n : numbers) now.push_back(before.empty() ? n : before[n]);
  before = std::move(now);
}

/// Leaves faces out of the surface.
void take_part(PartialSurface part, ShellSurface& result) {
  result.polygons = std::move(part.surface);
  result.tags = std::move(part.tags);
  result.border_planes = std::move(part.border_planes);
  renumber(part.vertex_numbers, result.vertex_numbers);
  renumber(part.face_numbers, result.face_numbers);
}

/// Leaves only the boundary of one region, or of all.
void select_region(const ShellSurfaceOptions& options, ShellSurface& result) {
  if (options.region.empty() && !has_inner_sheets(result.polygons)) return;
  const std::optional<RegionSurface> regions = find_regions(triangulate(result.polygons));
  if (!regions && options.region.empty()) return;  // the mending says what is wrong
  const int number = options.region.empty() ? kOutsideRegion
                                            : number_of_region(regions ? regions->regions : std::vector<Group>{},
                                                               options.region, "--region");
  if (number == kOutsideRegion && options.side != ShellSide::outward)
    throw InputError("sheets divide the inside of the surface into " + std::to_string(regions->regions.size()) +
                     " regions, and layers inward would cross them; give --region NAME to grow them in one");
  RegionFaces faces = faces_of_region(result.polygons, *regions, number);
  if (number == kOutsideRegion && faces.num_left_out > 0)
    result.note = std::to_string(faces.num_left_out) + " faces between its " + std::to_string(regions->regions.size()) +
                  " regions get no layers; with --region NAME, layers grow on the boundary of one region";
  PartialSurface part = without_faces(faces.surface, result.tags, faces.is_left_out);
  part.border_planes.clear();  // the boundary of a region has no rim
  take_part(std::move(part), result);
}

}  // namespace

ShellSurface prepared_surface(const TaggedPolygons& given, const ShellSurfaceOptions& options) {
  ShellSurface result{.polygons = given.polygons,
                      .tags = given.tags,
                      .border_planes = {},
                      .vertex_numbers = {},
                      .face_numbers = {},
                      .skipped = {},
                      .note = {},
                      .mended = {},
                      .repair_distance = options.repair_distance};
  select_region(options, result);
  if (!options.skipped.empty()) {
    std::vector<char> is_left_out(result.polygons.num_faces(), 0);
    for (const std::string& name : options.skipped) {
      const std::vector<char> patch = patch_named(result.polygons, name);
      for (std::size_t f = 0; f < patch.size(); ++f) is_left_out[f] |= patch[f];
      result.skipped.push_back(
          {name, static_cast<std::size_t>(std::count(patch.begin(), patch.end(), 1)), area_of(result.polygons, patch)});
    }
    take_part(without_faces(result.polygons, result.tags, is_left_out), result);
  }
  MendedSurface mended =
      mend_surface(result.polygons, result.tags, options.repair_distance, MendingGoal::layers, options.cancelled);
  result.is_cancelled = mended.is_cancelled;
  if (mended.is_mended()) {
    for (BorderPlane& plane : result.border_planes) {
      std::vector<Index> vertices;
      for (std::size_t v = 0; v < mended.vertex_numbers.size(); ++v)
        if (std::binary_search(plane.vertices.begin(), plane.vertices.end(), mended.vertex_numbers[v]))
          vertices.push_back(static_cast<Index>(v));
      plane.vertices = std::move(vertices);
    }
    renumber(mended.vertex_numbers, result.vertex_numbers);
    renumber(mended.face_numbers, result.face_numbers);
    result.polygons = std::move(mended.surface);
    result.tags = std::move(mended.tags);
  }
  mended.surface = {};
  result.mended = std::move(mended);
  return result;
}

void take_surface(const ShellSurface& surface, ShellOptions& options) {
  options.tags = merge_tags(surface.tags, options.tags);
  options.border_planes = surface.border_planes;
  options.vertex_numbers = surface.vertex_numbers;
  options.face_numbers = surface.face_numbers;
  if (options.vertex_thickness.empty() || surface.vertex_numbers.empty()) return;
  std::vector<double> thickness;
  for (const Index v : surface.vertex_numbers) thickness.push_back(options.vertex_thickness[v]);
  options.vertex_thickness = std::move(thickness);
}

std::optional<std::string> repair_warning(const ShellSurface& surface, double diagonal) {
  const std::string text = to_text(surface.mended, diagonal);
  return text.empty() ? std::nullopt : std::optional("the surface was " + text);
}

Json repair_json(const ShellSurface& surface, double diagonal) {
  const MendedSurface& mended = surface.mended;
  return {{"allowed_distance", surface.repair_distance},
          {"distance", mended.distance},
          {"distance_percent", diagonal > 0 ? 100 * mended.distance / diagonal : 0},
          {"merged_vertices", mended.merged_vertices},
          {"split_vertices", mended.split_vertices},
          {"dropped_faces", mended.dropped_faces},
          {"flipped_edges", mended.flipped_edges},
          {"moved_vertices", mended.moved_vertices}};
}

Json skipped_json(const ShellSurface& surface) {
  Json json = Json::array();
  for (const SkippedPatch& patch : surface.skipped)
    json.push_back({{"name", as_utf8(patch.name)}, {"faces", patch.faces}, {"area", patch.area}});
  return json;
}

double parse_repair(const std::string& option, const std::string& text, double diagonal) {
  const std::string number = text.ends_with('%') ? text.substr(0, text.size() - 1) : text;
  if (const auto value = parse_number(number); value && *value == 0) return 0;
  return parse_length(option, text, diagonal);
}

LayerPlan planned_layers(double thickness, double first_height, std::optional<int> layers,
                         std::optional<double> growth) {
  constexpr double kMostDifference = 0.01;  // of a growth that is given beside everything else
  if (!layers && !growth) throw UsageError("--first-height goes with --layers or --growth");
  const bool are_both_given = layers && growth;
  if (!layers) layers = number_of_layers(thickness, first_height, *growth);
  const double fitting = growth_of_layers(thickness, first_height, *layers);
  if (are_both_given && std::abs(fitting / *growth - 1) > kMostDifference)
    throw UsageError(formatted("--first-height %.6g, --layers %d and --growth %.6g do not make a thickness of %.6g",
                               first_height, *layers, *growth, thickness) +
                     formatted(": that takes a growth of %.6g; leave one of them out", fitting));
  return {*layers, fitting};
}

}  // namespace subvol::cli
