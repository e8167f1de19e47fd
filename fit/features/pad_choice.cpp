// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/angle.h"
#include "subvol/fit/features/pads.h"
#include "subvol/fit/features/patch_fans.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

// Angles in degrees, found on twelve CAD parts.
/// Above it, no pad may end at a path: it would leave one cell an angle that is nearly flat, or a fold.
constexpr double kFlattestBorder = 150;
/// Angles of one cell at an edge, and of one face at a corner, outside which a pad is wanted. 0.93 sin(140) = 0.6 is
/// about the scaled Jacobian that fits reach; 42 keeps three cells at edges of 126 degrees.
constexpr double kMostAngle = 140, kLeastCellAngle = 42, kLeastFaceAngle = 40;
/// Weight of an edge between two sets of patches for each of them, against an edge inside one.
constexpr double kBorderWeight = 0.5;
/// Distance, as a share of the diagonal of all curves, at which the directions of curves at a corner are measured:
/// short enough to see the corner, long enough not to see the triangles of a rounding.
constexpr double kDirectionReach = 0.01;

/// Sets of patches on which no pad may end between.
class PatchSets {
 public:
  explicit PatchSets(std::size_t patches) : sets_(patches) {}
  /// Returns the least patch of a patch's set.
  Index of(Index patch) const { return sets_.of(patch); }
  void unite(Index a, Index b) { sets_.join(a, b); }
  std::vector<Index> members(Index set) const {
    std::vector<Index> patches;
    for (std::size_t p = 0; p < sets_.size(); ++p)
      if (of(static_cast<Index>(p)) == set) patches.push_back(static_cast<Index>(p));
    return patches;
  }

 private:
  mutable DisjointSets sets_;  ///< a search shortens the ways to the least members
};

/// How much the sets of patches of one mesh want a pad.
class PadScores {
 public:
  PadScores(const PatchedMesh& patched, const SignedFeatures& features, const PatchSets& sets, double reach)
      : patched_(patched),
        features_(features),
        sets_(sets),
        reach_(reach),
        fans_(patched),
        scores_(patched.patches.count, 0.0) {
    for (std::size_t e = 0; e < fans_.path_of_edge.size(); ++e) score_edge(static_cast<Index>(e));
    std::vector<PatchFans::Place> fan;
    for (std::size_t v = 0; v < fans_.boundary.vertices.size(); ++v) {
      fans_.fan_at(static_cast<Index>(v), fan);
      score_vertex(fans_.boundary.vertices[v], fan);
    }
  }

  const PatchFans& fans() const { return fans_; }
  double of(Index set) const { return scores_[set]; }

  /// Returns the sets that want a pad, those that want it most first.
  std::vector<Index> wanted() const {
    std::vector<Index> sets;
    for (std::size_t s = 0; s < scores_.size(); ++s)
      if (scores_[s] > 0) sets.push_back(static_cast<Index>(s));
    std::ranges::stable_sort(sets, [&](Index a, Index b) { return scores_[a] > scores_[b]; });
    return sets;
  }

 private:
  Index set_of_face(Index face) const { return sets_.of(patched_.patches.of_face[face]); }

  double angle_at(Index edge) const {
    const Index path = fans_.path_of_edge[edge];
    if (path != kNoIndex) return features_.angles[patched_.paths[path].curve];
    const auto& ends = fans_.topology.edge(fans_.boundary.edges[edge]);
    const auto at = std::ranges::lower_bound(patched_.angles, ends, {}, &EdgeAngle::ends);
    return at != patched_.angles.end() && at->ends == ends ? at->angle : 180;
  }

  void score_edge(Index edge) {
    const double angle = angle_at(edge) / fans_.topology.num_edge_cells(fans_.boundary.edges[edge]);
    if (angle >= kLeastCellAngle && angle <= kMostAngle) return;
    const auto faces = fans_.faces_at(edge);
    const Index a = set_of_face(faces[0]), b = set_of_face(faces[1]);
    scores_[a] += a == b ? 1 : kBorderWeight;
    if (a != b) scores_[b] += kBorderWeight;
  }

  /// Looks at each sector of faces between two paths at a vertex.
  void score_vertex(Index vertex, std::span<const PatchFans::Place> fan) {
    std::vector<std::size_t> cuts;
    for (std::size_t i = 0; i < fan.size(); ++i)
      if (fans_.path_of_edge[fan[i].edge] != kNoIndex) cuts.push_back(i);
    const bool at_corner = std::ranges::binary_search(patched_.corners, vertex, {}, &PlacedCorner::vertex);
    if (cuts.size() < 2 || (!at_corner && cuts.size() > 2)) return;
    for (std::size_t j = 0; j < cuts.size(); ++j) {
      const std::size_t from = cuts[j], to = cuts[(j + 1) % cuts.size()];
      const std::size_t faces = (to + fan.size() - from - 1) % fan.size() + 1;
      const double angle = (at_corner ? sector_angle(vertex, fan, from, faces) : 180) / static_cast<double>(faces);
      if (angle < kLeastFaceAngle || angle > kMostAngle) want_others(fan, cuts, set_of_face(fan[from].face));
    }
  }

  void want_others(std::span<const PatchFans::Place> fan, std::span<const std::size_t> cuts, Index set) {
    std::set<Index> others;
    for (std::size_t cut : cuts) others.insert(set_of_face(fan[cut].face));
    others.erase(set);
    for (Index other : others) scores_[other] += 1.0 / static_cast<double>(others.size());
  }

  /// Returns the angle of the target's surface between two paths at a corner.
  double sector_angle(Index vertex, std::span<const PatchFans::Place> fan, std::size_t from, std::size_t faces) const {
    const auto& end = fan[(from + faces) % fan.size()];
    const double angle = angle_degrees_between(direction(vertex, fan[from]), direction(vertex, end));
    if (faces == 1) return angle;
    // The fitted faces say on which side of the two directions the surface lies.
    double fitted = 0;
    for (std::size_t i = 0; i < faces; ++i) fitted += fitted_angle(vertex, fan, (from + i) % fan.size());
    return fitted > 180 && std::abs(fitted - angle) > std::abs(360 - angle - fitted) ? 360 - angle : angle;
  }

  double fitted_angle(Index vertex, std::span<const PatchFans::Place> fan, std::size_t at) const {
    const Vec3& origin = patched_.fitted[vertex];
    const Vec3 a = patched_.fitted[fans_.other_end(fan[at].corner)] - origin;
    const Vec3 b = patched_.fitted[fans_.other_end(fan[(at + 1) % fan.size()].corner)] - origin;
    return angle_degrees_between(a, b);  // 0 for the sides of pads, whose vertices coincide there
  }

  /// Direction in which the curve of a path leaves the corner at a vertex.
  Vec3 direction(Index vertex, const PatchFans::Place& place) const {
    const CreasePath& path = patched_.paths[fans_.path_of_edge[place.edge]];
    const FeatureCurve& curve = features_.curves.curves[path.curve];
    const Index next = fans_.other_end(place.corner);
    if (path.vertices.front() == vertex && path.vertices[1] == next) return direction_at_end(curve, true, reach_);
    if (path.vertices.back() == vertex && path.vertices[path.vertices.size() - 2] == next)
      return direction_at_end(curve, false, reach_);
    return (patched_.fitted[next] - patched_.fitted[vertex]).normalized();
  }

  const PatchedMesh& patched_;
  const SignedFeatures& features_;
  const PatchSets& sets_;
  double reach_;
  PatchFans fans_;
  std::vector<double> scores_;  ///< by set
};

double diagonal_of(const FeatureCurves& curves) {
  Vec3 low = Vec3::Constant(kInfinity), high = -low;
  for (const FeatureCurve& curve : curves.curves)
    for (const Vec3& p : curve.points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  return curves.empty() ? 0 : (high - low).norm();
}

class PadChoice {
 public:
  PadChoice(PatchedMesh& patched, const SignedFeatures& features)
      : patched_(patched),
        features_(features),
        sets_(patched.patches.count),
        done_(patched.patches.count, 0),
        reach_(kDirectionReach * diagonal_of(features.curves)) {}

  PadReport run() {
    unite_over_flat_paths();
    for (const auto& [a, b] : patched_.united) sets_.unite(a, b);
    apply_rules();
    while (add_one()) continue;
    return std::move(report_);
  }

  /// Puts a single pad under some patches and those that it needs. Returns nothing if that is not possible.
  std::optional<Pad> run_on(std::span<const Index> patches) {
    unite_over_flat_paths();
    for (const auto& [a, b] : patched_.united) sets_.unite(a, b);
    const PadScores scores(patched_, features_, sets_, reach_);
    std::vector<std::uint8_t> is_padded(patched_.patches.count, 0);
    for (const Index p : patches) add_set(sets_.of(p), is_padded);
    if (has_never(is_padded) || grow_until_allowed(scores, is_padded) || make(is_padded)) return std::nullopt;
    return report_.pads.back();
  }

  /// Puts a single pad under all patches. Returns nothing if that is not possible.
  std::optional<PadReport> run_on_all() {
    const std::vector<std::uint8_t> all(patched_.patches.count, 1);
    if (has_never(all) || make(all)) return std::nullopt;
    return std::move(report_);
  }

 private:
  void unite_over_flat_paths() {
    const PatchFans fans(patched_);
    for (std::size_t e = 0; e < fans.path_of_edge.size(); ++e) {
      const Index path = fans.path_of_edge[e];
      if (path == kNoIndex || features_.angles[patched_.paths[path].curve] <= kFlattestBorder) continue;
      const auto faces = fans.faces_at(static_cast<Index>(e));
      sets_.unite(patched_.patches.of_face[faces[0]], patched_.patches.of_face[faces[1]]);
    }
  }

  /// Takes sets that are padded never, or not for their own sake, for done.
  void apply_rules() {
    if (patched_.rules.empty()) return;
    std::ranges::fill(done_, 1);
    for (const PadRule rule : {PadRule::free, PadRule::never})
      for (std::size_t p = 0; p < patched_.rules.size(); ++p)
        if (patched_.rules[p] == rule) done_[sets_.of(static_cast<Index>(p))] = rule == PadRule::never;
  }

  bool has_shared(Index set) const {
    return std::ranges::any_of(sets_.members(set), [&](Index p) { return patched_.shared[p] != 0; });
  }

  bool has_never(std::span<const std::uint8_t> is_padded) const {
    for (std::size_t p = 0; p < patched_.rules.size(); ++p)
      if (is_padded[p] && patched_.rules[p] == PadRule::never) return true;
    return false;
  }

  /// Makes the pad that is wanted most. Returns false if none is wanted or possible.
  bool add_one() {
    const PadScores scores(patched_, features_, sets_, reach_);
    report_.missed.clear();
    for (Index set : scores.wanted()) {
      if (done_[set]) continue;
      std::vector<std::uint8_t> is_padded(patched_.patches.count, 0);
      add_set(set, is_padded);
      auto refusal = grow_until_allowed(scores, is_padded);
      if (!refusal) refusal = make(is_padded);
      if (!refusal) return true;
      report_.missed.push_back({sets_.members(set), *refusal});
    }
    return false;
  }

  void add_set(Index set, std::vector<std::uint8_t>& is_padded) const {
    for (Index p : sets_.members(set)) is_padded[p] = 1;
  }

  /// Adds neighbors at vertices that do not allow the pad.
  std::optional<PadRefusal> grow_until_allowed(const PadScores& scores, std::vector<std::uint8_t>& is_padded) const {
    std::optional<PadRefusal> refusal;
    while ((refusal = topological_refusal(scores.fans(), patched_, is_padded))) {
      const Index neighbor = neighbor_to_add(scores, refusal->vertex, is_padded);
      if (neighbor == kNoIndex) return refusal;
      if (!patched_.grows_to_shared && has_shared(neighbor)) return refusal;
      add_set(neighbor, is_padded);
      if (has_never(is_padded)) return refusal;
    }
    return std::nullopt;
  }

  /// Returns the set at a vertex that is wanted most: of a shared patch if that is the problem; otherwise, if the pad
  /// does not touch itself there, next to a padded face.
  Index neighbor_to_add(const PadScores& scores, Index vertex, std::span<const std::uint8_t> is_padded) const {
    const PatchFans& fans = scores.fans();
    std::vector<PatchFans::Place> fan;
    const auto surface_vertex =
        std::ranges::lower_bound(fans.boundary.vertices, vertex) - fans.boundary.vertices.begin();
    fans.fan_at(static_cast<Index>(surface_vertex), fan);
    const std::optional<PadProblem> problem = fan_state(fans, patched_, fan, is_padded).problem();
    const bool only_shared = problem == PadProblem::moves_shared;
    const bool anywhere = only_shared || problem == PadProblem::touches_itself;
    const auto padded = [&](std::size_t i) {
      return is_padded[patched_.patches.of_face[fan[i % fan.size()].face]] != 0;
    };
    Index best = kNoIndex;
    for (std::size_t i = 0; i < fan.size(); ++i) {
      if (padded(i) || !(anywhere || padded(i + 1) || padded(i + fan.size() - 1))) continue;
      if (only_shared && !patched_.shared[patched_.patches.of_face[fan[i].face]]) continue;
      const Index set = sets_.of(patched_.patches.of_face[fan[i].face]);
      if (best == kNoIndex || scores.of(set) > scores.of(best)) best = set;
    }
    return best;
  }

  std::optional<PadRefusal> make(std::span<const std::uint8_t> is_padded) {
    Pad made;
    for (std::size_t p = 0; p < is_padded.size(); ++p)
      if (is_padded[p]) made.patches.push_back(static_cast<Index>(p));
    const std::size_t before = patched_.mesh.num_cells();
    if (const auto refusal = pad(patched_, made.patches)) return refusal;
    made.cells = patched_.mesh.num_cells() - before;
    for (Index p : made.patches) done_[sets_.of(p)] = 1;
    report_.pads.push_back(std::move(made));
    return std::nullopt;
  }

  PatchedMesh& patched_;
  const SignedFeatures& features_;
  PatchSets sets_;
  std::vector<std::uint8_t> done_;  ///< by set
  double reach_;
  PadReport report_;
};

/// Returns how many reasons for pads there are on all patches together.
double reasons_left(const PatchedMesh& patched, const SignedFeatures& features) {
  const PatchSets sets(static_cast<std::size_t>(patched.patches.count));
  const PadScores scores(patched, features, sets, kDirectionReach * diagonal_of(features.curves));
  double sum = 0;
  for (Index p = 0; p < static_cast<Index>(patched.patches.count); ++p) sum += scores.of(p);
  return sum;
}

}  // namespace

PadReport add_pads(PatchedMesh& patched, const SignedFeatures& features) {
  for (const CreasePath& path : patched.paths)
    if (path.curve < 0 ||
        static_cast<std::size_t>(path.curve) >= std::min(features.angles.size(), features.curves.curves.size()))
      throw InputError("add_pads: there is no curve " + std::to_string(path.curve));
  PatchedMesh all = patched;
  PadReport report = PadChoice(patched, features).run();
  if (report.missed.empty() || !patched.grows_to_shared) return report;
  std::optional<PadReport> report_of_all = PadChoice(all, features).run_on_all();
  if (!report_of_all || reasons_left(all, features) >= reasons_left(patched, features)) return report;
  patched = std::move(all);
  return *std::move(report_of_all);
}

std::optional<Pad> pad_without(PatchedMesh& patched, const SignedFeatures& features, std::span<const Index> patches,
                               std::span<const Index> never) {
  std::vector<PadRule> rules = patched.rules;
  if (rules.empty()) patched.rules.assign(patched.patches.count, PadRule::free);
  for (const Index p : never) patched.rules[p] = PadRule::never;
  std::optional<Pad> made = PadChoice(patched, features).run_on(patches);
  patched.rules = std::move(rules);
  return made;
}

}  // namespace subvol::internal
