// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/automatic_driver.h"
#include "subvol/fit/automatic_state.h"
#include "subvol/fit/features/edge_layout.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/flat_facets.h"
#include "subvol/fit/fits/local_cells.h"
#include "subvol/fit/target/feature_size.h"
#include "subvol/fit/target/surface_diagnosis.h"
#include "subvol/templates/auto_template.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace subvol::internal {

/// The base of the automatic fit of one solid: the sharp edges and small features of its target, its templates, the fit
/// of one mesh with the edges that it follows, and its measures. All coordinates are normalized.
///
/// Functions that return a bool return false if the fit must end.
class AutomaticSolidDriver : protected AutomaticDriver {
 protected:
  /// original: must outlive this; if edges are followed, its triangles agree about what is inside.
  AutomaticSolidDriver(const TriangleMesh& original, EdgeChoice follows, const AutomaticFitOptions& options)
      : AutomaticDriver(options, original), original_(original), follows_(follows) {}
  ~AutomaticSolidDriver() = default;

  /// Finds the sharp edges that are to be followed, and borders of groups.
  void find_edges();
  /// Finds the features that are so small that a distance within the tolerance may be too large there. Those that are
  /// smaller than the mean distance that is aimed at are faults of the surface.
  void find_features();
  /// Makes a template of the target. Returns nothing if there is none (`no_template_` then says so), or if the fit must
  /// end.
  std::optional<AutoTemplate> make_template(AutoTemplateOptions options);
  /// Makes a pillowed template of at most so many cells; if there is none, the smallest that was found. Returns nothing
  /// as `make_template`.
  std::optional<AutoTemplate> make_template_of_at_most(std::size_t cells);
  /// Returns the boundary of the target's solid, which is found once.
  const SolidBoundary& solid();
  /// Brings a grid near the target and lays out the edges on it. Returns false if the fit must end.
  bool fit_smoothly(VolumeMesh grid, AutomaticAttempt::Kind kind);
  /// Routes the edges on the grid that was brought near the target.
  void lay_out(RoutingOptions routing);
  /// Makes the present mesh, with the tags that its subdivision surface needs, a cage.
  void begin_cage() override;
  /// Fits the present mesh. portion: of the attempt's remaining work. Returns false if the fit must end.
  bool fit_level(int level, const QualitySchedule& schedule, const char* what, double portion = 1) override;
  /// Makes flat faces of the present mesh exactly so, measures it and keeps it if it is the best. Returns false if the
  /// fit must end.
  bool judge(AutomaticFitTrial trial) override;
  /// Returns how poor each cell of the present mesh, or of its cage, is, 0 for good ones.
  /// may_meet: false if the boundary is known not to meet itself.
  std::vector<double> faults_of_cells(bool may_meet) const;
  /// Returns the cells at which the best trial, which follows no edges, is not as good as aimed at: first those whose
  /// faces meet others, then the poor ones, the worst first, then those too far from the target.
  std::vector<Fault> faults_of_best() const;

  const TriangleMesh& original_;
  EdgeChoice follows_;
  Edges edges_;
  FeatureSizes features_;                      ///< of the target, in normalized coordinates
  std::vector<double> sizes_;                  ///< of the present mesh's cells (`SizedMesh`)
  TrialStart start_, best_start_;              ///< of the present trial, and of the best one
  std::optional<EdgeLayout> layout_;           ///< of mesh_, or of its cage; none: it follows no edges
  std::optional<SurfaceDiagnosis> diagnosis_;  ///< of the target; none: no attempt has been without a template

 private:
  /// Records in a trial the largest misses of the target's small features by a surface, in the target's unit and
  /// coordinates.
  void measure_features(const ClosestPoint& surface, AutomaticFitTrial& trial) const;
  /// Returns how well edges of the present mesh follow those of the target; nothing if there are none to follow.
  std::optional<CreaseDistance> distance_of_edges() const;
  /// Returns the curves that the present mesh does not follow: all of them if it follows none.
  std::vector<UnfollowedCurve> unfollowed_curves() const;

  std::optional<SolidBoundary> solid_;  ///< of original_, once it was needed
  FlatFacets facets_;                   ///< of `target_.mesh`, if edges are followed
  LevelLayout level_layout_;            ///< of mesh_, from layout_
};

}  // namespace subvol::internal
