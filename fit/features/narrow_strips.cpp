// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/narrow_strips.h"

#include "subvol/base/sort_unique.h"
#include "subvol/fit/features/patch_fans.h"
#include "subvol/fit/features/polyline.h"
#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// Largest distance between the curves of a strip, in units of h. Between curves farther apart, there is a row of the
/// grid.
constexpr double kMostWidth = 0.95;
/// Spacing of the samples at which it is measured, in units of h.
constexpr double kSpacing = 0.25;
/// Largest area of the region of a strip, in units of its curves' mean length times their mean distance: elsewhere the
/// two curves run beside each other by chance.
constexpr double kMostArea = 1.5;
/// Range of the angles that a cell may have at both borders of a row, in degrees. It is somewhat wider than that of
/// `add_pads`, since a poor cell is better than a lost edge.
constexpr double kLeastRowAngle = 40, kMostRowAngle = 150;

std::vector<double> areas_of_regions(const TriangleMesh& target, const SignedFeatures& features) {
  std::vector<double> areas(features.num_regions, 0.0);
  for (std::size_t t = 0; t < target.triangles.size(); ++t)
    areas[features.regions[t]] += triangle_area(target, target.triangles[t]);
  return areas;
}

/// Two curves side by side, and the region between them.
struct Strip {
  Index lost, followed, region;
  double width;  ///< largest distance of one of the curves from the other
  double area;   ///< mean length of the curves times their mean distance
  bool same_direction;
};

bool is_in_parts(const FeatureRouting& routing, Index curve) {
  return std::ranges::binary_search(routing.parts, curve, {}, &FollowedPart::curve);
}

bool is_lost(const FeatureRouting& routing, Index curve) {
  return std::ranges::any_of(routing.unfollowed, [&](const UnfollowedCurve& u) { return u.curve == curve; });
}

/// How a curve runs along another one.
struct Beside {
  double most = 0, mean = 0;  ///< distances of its samples
  double along = 0;           ///< > 0 if both have the same direction
};

Beside beside(const FeatureCurve& curve, const FeatureCurve& other, double spacing) {
  const ClosestPoint tree = polyline_tree(other.points);
  const std::vector<Vec3> samples = sampled_polyline(curve.points, spacing);
  Beside result;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const ClosestPoint::Hit hit = tree.closest(samples[i]);
    result.most = std::max(result.most, hit.distance);
    result.mean += hit.distance / static_cast<double>(samples.size());
    const std::size_t from = i + 1 < samples.size() ? i : i - 1;
    const auto segment = static_cast<std::size_t>(hit.triangle);
    result.along += (samples[from + 1] - samples[from]).dot(other.points[segment + 1] - other.points[segment]);
  }
  return result;
}

/// A row of faces beside a path.
struct Row {
  std::vector<Index> faces;   ///< of the surface, along the path
  std::vector<Index> border;  ///< the vertices opposite those of the path
};

/// The boundary of a patched mesh as rows see it.
class Rows {
 public:
  explicit Rows(const PatchedMesh& patched)
      : fans_(patched), edge_of_(fans_.topology.num_edges(), kNoIndex), on_path_(patched.mesh.num_vertices(), 0) {
    for (std::size_t e = 0; e < fans_.boundary.edges.size(); ++e)
      edge_of_[fans_.boundary.edges[e]] = static_cast<Index>(e);
    for (const CreasePath& path : patched.paths)
      for (const Index v : path.vertices) on_path_[v] = 1;
    for (const PlacedCorner& corner : patched.corners) on_path_[corner.vertex] = 1;
  }

  /// Returns the faces on one side of a path.
  std::vector<Index> faces_beside(std::span<const Index> path, bool left) const {
    std::vector<Index> faces;
    for (std::size_t i = 0; i + 1 < path.size(); ++i)
      faces.push_back(fans_.surface().corner_faces[half_edge(path[i], path[i + 1], left)]);
    return faces;
  }

  /// Returns the row on one side of a path if its faces are different quads each of which shares an edge with the next.
  std::optional<Row> row_beside(std::span<const Index> path, bool left) const {
    const SurfaceTopology& surface = fans_.surface();
    Row row;
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const Index h = half_edge(path[i], path[i + 1], left), face = surface.corner_faces[h];
      if (surface.face_size(face) != 4) return std::nullopt;
      // From path[i] to path[i + 1] on the left, backward on the right.
      const Index end = vertex(surface.next(surface.next(h))), begin = vertex(surface.prev(h));
      const Index at_first = left ? begin : end, at_second = left ? end : begin;
      if (row.border.empty()) row.border.push_back(at_first);
      if (row.border.back() != at_first) return std::nullopt;
      row.border.push_back(at_second);
      row.faces.push_back(face);
    }
    const bool closed = path.front() == path.back();
    if (closed != (row.border.front() == row.border.back())) return std::nullopt;
    std::vector<Index> once(row.border.begin(), row.border.end() - (closed ? 1 : 0));
    std::ranges::sort(once);
    if (std::ranges::adjacent_find(once) != once.end()) return std::nullopt;
    return row;
  }

  bool is_on_path(Index v) const { return on_path_[v] != 0; }
  /// Returns the path along the edge between two vertices; kNoIndex: none.
  Index path_at(Index v, Index w) const { return fans_.path_of_edge[edge_of_[fans_.topology.find_edge(v, w)]]; }

  /// Returns the mean number of cells around the edges of a path.
  double mean_cells(std::span<const Index> path) const {
    double sum = 0;
    for (std::size_t i = 0; i + 1 < path.size(); ++i)
      sum += fans_.topology.num_edge_cells(fans_.topology.find_edge(path[i], path[i + 1]));
    return sum / static_cast<double>(path.size() - 1);
  }

 private:
  Index vertex(Index corner) const { return fans_.boundary.vertices[fans_.surface().corner_vertices[corner]]; }

  /// Returns the corner from v to w, whose face is on the left, or that from w to v.
  Index half_edge(Index v, Index w, bool left) const {
    const Index h = fans_.surface().edge_corners[edge_of_[fans_.topology.find_edge(v, w)]];
    return (vertex(h) == v) == left ? h : fans_.surface().twins[h];
  }

  PatchFans fans_;
  std::vector<Index> edge_of_;         ///< of the surface, by edge of the mesh; kNoIndex: inside
  std::vector<std::uint8_t> on_path_;  ///< by vertex: on a path, or a placed corner
};

/// Finds the strips of a target.
class StripFinder {
 public:
  StripFinder(const TriangleMesh& target, const SignedFeatures& features, double h)
      : features_(features), curves_(features.curves.curves), h_(h), areas_(areas_of_regions(target, features)) {}

  /// Returns the narrow strips between curves that are lost and others that are followed, the narrowest first.
  std::vector<Strip> strips(const FeatureRouting& routing) const {
    std::vector<Strip> found;
    for (const UnfollowedCurve& lost : routing.unfollowed) {
      if (!may_be_followed(lost)) continue;
      for (const CreasePath& path : routing.paths)
        if (is_followed(path.curve, routing))
          if (const auto strip = strip_between(lost.curve, path.curve)) found.push_back(*strip);
    }
    std::vector<double> covered(areas_.size(), 0.0);
    for (const Strip& strip : found) covered[strip.region] += strip.area;
    std::erase_if(found, [&](const Strip& strip) { return areas_[strip.region] > kMostArea * covered[strip.region]; });
    std::ranges::stable_sort(found, {}, &Strip::width);
    return found;
  }

 private:
  /// Returns true for a curve that one path follows from end to end.
  bool is_followed(Index c, const FeatureRouting& routing) const {
    return !std::ranges::binary_search(routing.joined, c) && !is_in_parts(routing, c);
  }

  bool may_be_followed(const UnfollowedCurve& lost) const {
    const FeatureCurve& curve = curves_[lost.curve];
    return lost.reason != NotFollowed::excluded && lost.reason != NotFollowed::too_acute &&
           !(curve.closed() && features_.curves.is_corner(curve.vertices.front())) && curve.length() >= h_;
  }

  std::optional<Strip> strip_between(Index lost, Index followed) const {
    const FeatureCurve &c = curves_[lost], &n = curves_[followed];
    Index region = kNoIndex;
    for (const Index r : {features_.sides[lost].left, features_.sides[lost].right})
      if (r != kNoIndex && features_.sides[followed].has(r) && (region == kNoIndex || areas_[r] < areas_[region]))
        region = r;
    if (region == kNoIndex || c.closed() != n.closed()) return std::nullopt;
    const Beside of_lost = beside(c, n, kSpacing * h_);
    if (of_lost.most > kMostWidth * h_) return std::nullopt;
    const Beside of_followed = beside(n, c, kSpacing * h_);
    if (of_followed.most > kMostWidth * h_) return std::nullopt;
    return Strip{lost,
                 followed,
                 region,
                 std::max(of_lost.most, of_followed.most),
                 0.5 * (c.length() * of_lost.mean + n.length() * of_followed.mean),
                 of_lost.along > 0};
  }

  const SignedFeatures& features_;
  const std::vector<FeatureCurve>& curves_;
  double h_;
  std::vector<double> areas_;
};

/// Makes rows for strips.
class StripFollower {
 public:
  StripFollower(PatchedMesh& patched, FeatureRouting& routing, PatchGroups& groups, const SignedFeatures& features,
                const StripFinder& finder)
      : patched_(patched),
        routing_(routing),
        groups_(groups),
        features_(features),
        curves_(features.curves.curves),
        finder_(finder) {}

  NarrowStrips run() {
    for (const Strip& strip : finder_.strips(routing_))
      if (is_lost(routing_, strip.lost) && !is_in_parts(routing_, strip.lost) && follow(strip)) ++result_.num_followed;
    return std::move(result_);
  }

 private:
  /// The curves of a strip at a path and at the other border of the row beside it.
  struct Placement {
    Strip strip;
    Index at_path, at_border;
    bool row_left;  ///< the row is on the left of the path
  };

  /// One end of a row: vertices of the path and of the border, and the corners of their curves.
  struct End {
    Index v, w;
    Index corner_at_path, corner_at_border;
  };

  /// Tries both placements, first that whose angles are nearer to 90 degrees. Returns false, and changes nothing, if
  /// none suits.
  bool follow(const Strip& strip) {
    const auto path = std::ranges::find(patched_.paths, strip.followed, &CreasePath::curve);
    if (path == patched_.paths.end()) return false;
    const bool region_left = features_.sides[strip.followed].left == strip.region;
    std::array<Placement, 2> placements{Placement{strip, strip.followed, strip.lost, region_left},
                                        Placement{strip, strip.lost, strip.followed, !region_left}};
    const Rows rows(patched_);
    const double cells = rows.mean_cells(path->vertices);
    const auto fault = [&](const Placement& p) {
      return std::max(std::abs(features_.angles[p.at_path] - 90),
                      std::abs(features_.angles[p.at_border] / (cells + 1) - 90));
    };
    std::ranges::stable_sort(placements, {}, fault);
    return follow(placements[0], rows) || follow(placements[1], rows);
  }

  /// Uses the row that is there, or makes one by a pad. rows: of the mesh as it is.
  bool follow(const Placement& placement, const Rows& rows) {
    const CreasePath path = path_of_followed(placement, patched_);
    if (const auto row = free_row(placement, path, rows, patched_)) return enter(placement, path, *row, rows, patched_);
    const auto patches_of = [&](bool left) {
      std::set<Index> patches;
      for (const Index f : rows.faces_beside(path.vertices, left)) patches.insert(patched_.patches.of_face[f]);
      return std::vector<Index>(patches.begin(), patches.end());
    };
    PatchedMesh padded = patched_;
    std::optional<Pad> pad =
        pad_without(padded, features_, patches_of(!placement.row_left), patches_of(placement.row_left));
    if (!pad) return false;
    const Rows padded_rows(padded);
    const CreasePath moved = path_of_followed(placement, padded);
    const auto row = free_row(placement, moved, padded_rows, padded);
    if (!row || !enter(placement, moved, *row, padded_rows, padded)) return false;
    patched_ = std::move(padded);
    result_.pads.push_back(*std::move(pad));
    return true;
  }

  static CreasePath& path_of_followed(const Placement& placement, PatchedMesh& patched) {
    return *std::ranges::find(patched.paths, placement.strip.followed, &CreasePath::curve);
  }

  End end_of(const Placement& placement, const CreasePath& path, const Row& row, bool front) const {
    const auto corner = [&](Index curve) {  // the path has the direction of the curve that it followed before
      const bool first = curve == placement.strip.followed || placement.strip.same_direction ? front : !front;
      return first ? curves_[curve].vertices.front() : curves_[curve].vertices.back();
    };
    return {front ? path.vertices.front() : path.vertices.back(), front ? row.border.front() : row.border.back(),
            corner(placement.at_path), corner(placement.at_border)};
  }

  /// Returns the row for a placement if it is one that no path runs into.
  std::optional<Row> free_row(const Placement& placement, const CreasePath& path, const Rows& rows,
                              const PatchedMesh& patched) const {
    std::optional<Row> row = rows.row_beside(path.vertices, placement.row_left);
    return row && is_free(placement, path, *row, rows, patched) ? std::move(row) : std::nullopt;
  }

  /// Returns true if no path runs into the row or along its other border, except at its ends.
  bool is_free(const Placement& placement, const CreasePath& path, const Row& row, const Rows& rows,
               const PatchedMesh& patched) const {
    const bool closed = path.vertices.front() == path.vertices.back();
    for (std::size_t i = 0; i < row.border.size(); ++i) {
      const bool at_end = !closed && (i == 0 || i + 1 == row.border.size());
      if (at_end ? !is_free(end_of(placement, path, row, i == 0), rows, patched)
                 : rows.is_on_path(row.border[i]) || rows.path_at(path.vertices[i], row.border[i]) != kNoIndex)
        return false;
    }
    return true;
  }

  /// Returns true if a curve lies between the two corners of an end.
  bool joins_corners(const FeatureCurve& curve, const End& end) const {
    return std::minmax(curve.vertices.front(), curve.vertices.back()) ==
           std::minmax(end.corner_at_path, end.corner_at_border);
  }

  bool is_free(const End& end, const Rows& rows, const PatchedMesh& patched) const {
    const auto vertex_of = [&](Index corner) {
      const auto placed = std::ranges::find(patched.corners, corner, &PlacedCorner::corner);
      return placed == patched.corners.end() ? kNoIndex : placed->vertex;
    };
    if (end.corner_at_path == end.corner_at_border) return false;  // the strip tapers to a point
    const Index of_path = vertex_of(end.corner_at_path), of_border = vertex_of(end.corner_at_border);
    if (of_path != kNoIndex && of_path != end.v) return false;
    if (of_border == end.w) return true;  // where a strip that ended there before has put it
    if (of_border != kNoIndex && of_border != end.v) return false;
    const Index beside = rows.path_at(end.v, end.w);
    return beside == kNoIndex ? !rows.is_on_path(end.w) : can_be_cut_back(patched.paths[beside], end);
  }

  /// Returns true if a path ends with the edge from the end's border to the path's vertex, and its curve at the corner
  /// of the border.
  bool can_be_cut_back(const CreasePath& path, const End& end) const {
    const std::vector<Index>& vertices = path.vertices;
    if (vertices.size() < 3) return false;
    return (vertices[0] == end.v && vertices[1] == end.w &&
            curves_[path.curve].vertices.front() == end.corner_at_border) ||
           (vertices.back() == end.v && vertices[vertices.size() - 2] == end.w &&
            curves_[path.curve].vertices.back() == end.corner_at_border);
  }

  /// Enters a strip into the mesh, the routing and the groups. Returns false, and changes nothing, if its angles do not
  /// suit or a patch would lose its last face.
  bool enter(const Placement& placement, const CreasePath& path, const Row& row, const Rows& rows,
             PatchedMesh& patched) {
    const auto suits = [&](Index curve, std::span<const Index> vertices) {
      const double angle = features_.angles[curve] / rows.mean_cells(vertices);
      return angle >= kLeastRowAngle && angle <= kMostRowAngle;
    };
    if (!suits(placement.at_path, path.vertices) || !suits(placement.at_border, row.border)) return false;
    std::vector<std::size_t> left(patched.patches.count, 0);
    for (const Index p : patched.patches.of_face) ++left[p];
    for (const Index f : row.faces)
      if (--left[patched.patches.of_face[f]] == 0) return false;
    enter_group(placement.strip.region);
    for (const Index f : row.faces) patched.patches.of_face[f] = static_cast<Index>(patched.patches.count);
    ++patched.patches.count;
    if (!patched.rules.empty()) patched.rules.push_back(PadRule::never);
    if (!patched.shared.empty()) patched.shared.push_back(0);
    if (path.vertices.front() != path.vertices.back())
      for (const bool front : {true, false}) finish_end(end_of(placement, path, row, front), rows, patched);
    enter_paths(placement, path, row, patched);
    return true;
  }

  /// Adds a patch of the strip's region to the groups.
  void enter_group(Index region) {
    const Index group = groups_.of_region[region];
    const bool is_alone = std::ranges::count(groups_.of_region, group) == 1;
    if (!is_alone) groups_.of_region[region] = static_cast<Index>(groups_.count++);
    groups_.of_patch.push_back(groups_.of_region[region]);
  }

  /// Places the corners of an end, and cuts a path back that runs along it; the curve between the corners follows it.
  void finish_end(const End& end, const Rows& rows, PatchedMesh& patched) {
    const Index beside = rows.path_at(end.v, end.w);
    std::vector<PlacedCorner>& corners = patched.corners;
    std::erase(corners, PlacedCorner{end.corner_at_border, end.v});
    for (const PlacedCorner& corner :
         {PlacedCorner{end.corner_at_path, end.v}, PlacedCorner{end.corner_at_border, end.w}})
      if (std::ranges::find(corners, corner) == corners.end()) corners.push_back(corner);
    std::ranges::sort(corners, {}, [](const PlacedCorner& p) { return std::pair(p.vertex, p.corner); });
    if (beside == kNoIndex || !can_be_cut_back(patched.paths[beside], end)) return;
    std::vector<Index>& vertices = patched.paths[beside].vertices;
    vertices.erase(vertices.front() == end.v ? vertices.begin() : vertices.end() - 1);
    const auto between = std::ranges::find_if(routing_.unfollowed, [&](const UnfollowedCurve& lost) {
      return lost.reason == NotFollowed::shorter_than_cell && joins_corners(curves_[lost.curve], end);
    });
    if (between == routing_.unfollowed.end()) return;
    const bool from_path = curves_[between->curve].vertices.front() == end.corner_at_path;
    patched.paths.push_back({between->curve, from_path ? std::vector{end.v, end.w} : std::vector{end.w, end.v}});
    routing_.unfollowed.erase(between);
  }

  void enter_paths(const Placement& placement, const CreasePath& path, const Row& row, PatchedMesh& patched) {
    const Strip& strip = placement.strip;
    const bool on_lost = placement.at_path == strip.lost;
    path_of_followed(placement, patched).vertices = on_lost ? row.border : path.vertices;
    std::vector<Index> of_lost = on_lost ? path.vertices : row.border;
    if (!strip.same_direction) std::ranges::reverse(of_lost);
    patched.paths.push_back({strip.lost, std::move(of_lost)});
    std::ranges::stable_sort(patched.paths, {}, &CreasePath::curve);
    std::erase_if(routing_.unfollowed, [&](const UnfollowedCurve& lost) { return lost.curve == strip.lost; });
  }

  PatchedMesh& patched_;
  FeatureRouting& routing_;
  PatchGroups& groups_;
  const SignedFeatures& features_;
  const std::vector<FeatureCurve>& curves_;
  const StripFinder& finder_;
  NarrowStrips result_;
};

}  // namespace

std::vector<Index> strips_in_parts(const FeatureRouting& routing, const TriangleMesh& target,
                                   const SignedFeatures& features, double h) {
  std::vector<Index> curves;
  if (routing.parts.empty()) return curves;
  for (const Strip& strip : StripFinder(target, features, h).strips(routing))
    if (is_in_parts(routing, strip.lost)) curves.push_back(strip.lost);
  sort_unique(curves);
  return curves;
}

NarrowStrips follow_narrow_strips(PatchedMesh& patched, FeatureRouting& routing, PatchGroups& groups,
                                  const TriangleMesh& target, const SignedFeatures& features, double h) {
  if (routing.unfollowed.empty() || routing.paths.empty()) return {};
  const StripFinder finder(target, features, h);
  return StripFollower(patched, routing, groups, features, finder).run();
}

}  // namespace subvol::internal
