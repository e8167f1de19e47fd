// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/optimize_curved.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/fits/cell_lift.h"
#include "subvol/fit/fits/sheet_projectors.h"
#include "subvol/fit/high_order_patch.h"
#include "subvol/fit/optimize_driver.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/stages/quality_patches.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/stages/untangle.h"
#include "subvol/mesh/pyramids.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

/// Largest number of rounds of untangling, and of rounds without a gain; steps of the minimization of the mean.
constexpr int kMostUntanglingRounds = 40, kUntanglingPatience = 8, kMeanDistortionSteps = 20;
/// Shares of the work at the ends of its parts, for the progress.
constexpr double kShareOfCurvedUntangling = 0.5, kShareOfMeanDistortion = 0.7;

CurvedOptimizeOptions checked(const CurvedOptimizeOptions& options) {
  const auto in_range = [](const char* name, double value, double low, double high) {
    require_in_range("CurvedOptimizeOptions", name, value, low, high);
  };
  in_range("quality", options.quality, 0, kMostQuality);
  check_control("CurvedOptimizeOptions", options.control);
  return options;
}

/// The map between a mesh and a box of diagonal 1 around the origin.
struct UnitBox {
  Vec3 center;
  double diagonal;

  explicit UnitBox(const HighOrderMesh& mesh) {
    Eigen::AlignedBox3d box;
    for (std::size_t v = 0; v < mesh.space.num_vertices(); ++v) box.extend(mesh.coefficients[v]);
    center = box.center();
    diagonal = box.diagonal().norm();
    if (!(diagonal > 0)) throw InputError("mesh: all vertices are at one point");
  }
  HighOrderMesh to_unit(HighOrderMesh mesh) const { return changed(std::move(mesh), 1 / diagonal, -center / diagonal); }
  HighOrderMesh from_unit(HighOrderMesh mesh) const { return changed(std::move(mesh), diagonal, center); }

 private:
  static HighOrderMesh changed(HighOrderMesh mesh, double scale, const Vec3& shift) {
    mesh.coefficients = moved(std::move(mesh.coefficients), mesh.space.num_vertices(), scale, shift);
    return mesh;
  }
};

class CurvedOptimizer {
 public:
  CurvedOptimizer(const HighOrderMesh& mesh, const VolumeMesh& labels, const CurvedOptimizeOptions& options);
  CurvedOptimizeResult run(const HighOrderMesh& original);

 private:
  /// A minimization over some of the nodes.
  struct Part {
    std::unique_ptr<const ElementSpace> space;  ///< of its cells; the problem refers to it
    FitProblem problem;
    std::vector<Index> unknowns;  ///< nodes of the mesh
    std::vector<Vec3> x;
  };

  std::unique_ptr<HighOrderEnergy> volume_energy(const ElementSpace& space, std::span<const Index> cells) const;
  Part make_part(const ElementSpace& space, std::span<const Index> cells, std::span<const Index> nodes,
                 std::span<const Index> unknowns) const;
  Part whole() const;
  Part around(std::span<const Index> cells) const;
  void take(const Part& part);
  StageRecord record(std::string name, const Part& part) const;
  bool run_stage(const std::string& name, Part part, int steps);

  void find_sizes();
  QualityReport measure() const { return measure_quality(mesh_); }
  bool untangle_cells();
  bool improve();
  Again lift_by(const char* name, double& setting, const LiftValues& values);
  void finish();

  CurvedOptimizeOptions options_;
  UnitBox box_;
  HighOrderMesh mesh_;
  VolumeMesh labels_;             ///< with the vertices' present positions
  std::vector<Mat3> projectors_;  ///< of each node
  std::vector<Vec3> ideal_boxes_;
  double emphasis_ = 0, hinge_ = 0;
  QualityReport quality_;  ///< of the present state, from `improve` on
  FitReport report_;
  StageRunner runner_;
};

CurvedOptimizer::CurvedOptimizer(const HighOrderMesh& mesh, const VolumeMesh& labels,
                                 const CurvedOptimizeOptions& options)
    : options_(checked(options)),
      box_(mesh),
      mesh_(box_.to_unit(mesh)),
      labels_(labels),
      projectors_(sheet_projectors(mesh_, labels, options.fixed_boundary)),
      runner_(options.control, SolverKind::newton, options.tuning) {}

/// Sizes of cells that are inverted or poor say nothing; the sizes around them do.
void CurvedOptimizer::find_sizes() {
  const auto vertices = std::span(mesh_.coefficients).first(mesh_.space.num_vertices());
  labels_.positions.assign(vertices.begin(), vertices.end());
  double volume = 0;
  for (const RegionQuality& region : measure_regions(mesh_, {}, nullptr).regions) volume += region.volume;
  std::vector<std::uint8_t> trusted;
  for (const double least : quality_.cell_minima) trusted.push_back(least > options_.tuning.optimize.trusted_jacobian);
  constexpr double kLeastVolume = 1e-9;  // of a mesh that is turned inside out
  ideal_boxes_ = interpolated_boxes(labels_, vertices, std::max(volume, kLeastVolume), trusted);
}

std::unique_ptr<HighOrderEnergy> CurvedOptimizer::volume_energy(const ElementSpace& space,
                                                                std::span<const Index> cells) const {
  std::vector<int> points;
  std::vector<Vec3> boxes;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    points.push_back(std::max(kLeastDistortionPoints, points_for_order(space.pattern_order(space.pattern(i)))));
    boxes.push_back(ideal_boxes_[cells[i]]);
  }
  auto volume = std::make_unique<HighOrderEnergy>(space, boxes, points);
  volume->set_tuning(options_.tuning.curved);
  volume->count_as_part(mesh_.space.num_cells());
  volume->set_hinge(hinge_, std::min(1.0, options_.quality + options_.tuning.curved.hinge_above_quality));
  return volume;
}

/// cells, nodes  numbers in the mesh of the cells and nodes of `space`.  unknowns: nodes of the mesh that may move.
CurvedOptimizer::Part CurvedOptimizer::make_part(const ElementSpace& space, std::span<const Index> cells,
                                                 std::span<const Index> nodes, std::span<const Index> unknowns) const {
  std::vector<Index> moving;  // ascending, as the unknowns are
  std::vector<Vec3> x, fixed = mesh_.coefficients;
  std::vector<Mat3> projectors;
  for (const Index node : unknowns) {
    if (projectors_[node].isZero()) continue;
    moving.push_back(node);
    x.push_back(mesh_.coefficients[node]);
    projectors.push_back(projectors_[node]);
    fixed[node].setZero();
  }
  auto own_space = std::make_unique<const ElementSpace>(space);
  std::unique_ptr<HighOrderEnergy> volume = volume_energy(*own_space, cells);
  if (emphasis_ > 0) {
    std::vector<Vec3> coefficients;
    for (const Index node : nodes) coefficients.push_back(mesh_.coefficients[node]);
    volume->emphasize_poor(coefficients, emphasis_);
  }
  FitProblem problem(select(identity_map(fixed.size()), nodes, moving), SparseMap{moving.size(), {0}, {}, {}},
                     std::move(volume), nullptr, 1);
  for (const Index node : nodes) problem.fixed_nodes.push_back(fixed[node]);
  problem.projectors = std::move(projectors);
  return {std::move(own_space), std::move(problem), std::move(moving), std::move(x)};
}

CurvedOptimizer::Part CurvedOptimizer::whole() const {
  std::vector<Index> cells(mesh_.space.num_cells()), nodes(mesh_.space.num_nodes());
  std::iota(cells.begin(), cells.end(), Index{0});
  std::iota(nodes.begin(), nodes.end(), Index{0});
  return make_part(mesh_.space, cells, nodes, nodes);
}

/// A large mesh moves only around the first of the cells, as many as keep the part small.
CurvedOptimizer::Part CurvedOptimizer::around(std::span<const Index> cells) const {
  const auto most =
      static_cast<std::size_t>(options_.tuning.quality.most_patch_share * static_cast<double>(mesh_.space.num_cells()));
  for (std::size_t count = cells.size(); count > 0; count /= 2)
    if (auto patch = high_order_patch(labels_, mesh_.space, cells.first(count), kHighOrderRings, most))
      return make_part(patch->space, patch->cells, patch->nodes, patch->unknowns);
  return whole();
}

void CurvedOptimizer::take(const Part& part) {
  for (std::size_t i = 0; i < part.unknowns.size(); ++i) mesh_.coefficients[part.unknowns[i]] = part.x[i];
}

StageRecord CurvedOptimizer::record(std::string name, const Part& part) const {
  StageRecord result;
  result.name = std::move(name);
  result.order = mesh_.space.max_order();
  result.cells = part.space->num_cells();
  return result;
}

bool CurvedOptimizer::run_stage(const std::string& name, Part part, int steps) {
  const Stage stage{.lambda = 1, .tangential_weight = 0, .max_iterations = steps};
  const bool going = runner_.run(part.problem, stage, record(name, part), part.x, report_);
  take(part);
  return going;
}

/// Untangles the mesh as a whole, since a few steps untangle most of it, and then what is left with its surroundings
/// alone: in the mean over all cells, a few hardly count.
bool CurvedOptimizer::untangle_cells() {
  // Steps, for the progress, and the number of parts that are untangled with their surroundings alone.
  constexpr int kExpectedCurvedUntanglingSteps = 60, kMostUntangledParts = 4;
  runner_.work().begin_part(kShareOfCurvedUntangling, kExpectedCurvedUntanglingSteps);
  const std::vector<Index>& left = quality_.certificate.not_certified;
  const auto untangle_part = [&](Part part, const char* name) {
    dynamic_cast<HighOrderEnergy&>(*part.problem.volume).set_most_own_emphasis(0);
    const UntangleOptions options{
        .max_rounds = kMostUntanglingRounds, .patience = kUntanglingPatience, .tuning = options_.tuning.optimize};
    const bool going =
        untangle(part.problem, part.space->num_cells(), options, runner_, record(name, part), part.x, report_).going;
    take(part);
    quality_ = measure();
    return going;
  };
  bool going = untangle_part(whole(), "untangle");
  for (int n = 0; n < kMostUntangledParts && going && !left.empty(); ++n)
    going = untangle_part(around(left), "untangle what is left");
  return going;
}

/// Repeats the minimization around poor cells with higher and higher values of a setting, each kept if the least scaled
/// Jacobian rises.
Again CurvedOptimizer::lift_by(const char* name, double& setting, const LiftValues& values) {
  const auto is_poor = [&] { return quality_.min_scaled_jacobian < options_.quality; };
  return lift(setting, values, options_.tuning.curved.most_failed_lifts, is_poor, [&](double value) {
    const std::vector<Index> poor = poor_cells(quality_.cell_minima, options_.quality);
    std::vector<Vec3> before = mesh_.coefficients;
    const double setting_before = std::exchange(setting, value);
    const std::size_t stages_before = report_.stages.size();
    const bool going = run_stage(formatted("%s %g", name, value), around(poor), options_.tuning.curved.lift_steps);
    QualityReport now = measure();
    if (now.min_scaled_jacobian > quality_.min_scaled_jacobian &&
        now.certificate.not_certified.size() <= quality_.certificate.not_certified.size()) {
      quality_ = std::move(now);
      return going ? Again::kept : Again::ended;
    }
    mesh_.coefficients = std::move(before);
    report_.undo_stages(stages_before, report_.stages.size());
    setting = setting_before;
    return going ? Again::undone : Again::ended;
  });
}

/// Minimizes the mean distortion and then lifts the poorest cells. Returns false if the work must end.
bool CurvedOptimizer::improve() {
  constexpr int kExpectedLiftSteps = 40, kMostLiftRounds = 3;  // of lifts, each from a new state
  find_sizes();
  runner_.work().begin_part(kShareOfMeanDistortion, kMeanDistortionSteps);
  const bool going = run_stage("mean distortion", whole(), kMeanDistortionSteps);
  quality_ = measure();
  if (!going || options_.quality == 0) return going;
  runner_.work().begin_part(1, kExpectedLiftSteps);
  for (int round = 0; round < kMostLiftRounds; ++round) {
    const std::pair before(emphasis_, hinge_);
    if (lift_by("emphasis on poor shape", emphasis_, kEmphases) == Again::ended) return false;
    if (lift_by("hinge of weight", hinge_, kHinges) == Again::ended) return false;
    if (std::pair(emphasis_, hinge_) == before) break;
  }
  return true;
}

void CurvedOptimizer::finish() {
  const std::size_t left = quality_.certificate.not_certified.size();
  report_.stop_reason = left > 0 ? StopReason::stalled : StopReason::converged;
  report_.explanation =
      left > 0 ? formatted("%zu cells could not be made valid", left)
               : formatted("all cells are valid; least scaled Jacobian %.4g", quality_.min_scaled_jacobian);
}

CurvedOptimizeResult CurvedOptimizer::run(const HighOrderMesh& original) {
  const QualityReport start = measure();
  quality_ = start;
  const bool was_valid = start.certificate.not_certified.empty();
  bool going = true;
  if (!was_valid) {
    find_sizes();
    going = untangle_cells();
  }
  if (going && quality_.certificate.not_certified.empty()) going = improve();
  const double gain = quality_.min_scaled_jacobian - start.min_scaled_jacobian;
  const bool is_better =
      !was_valid || (quality_.certificate.not_certified.empty() &&
                     (gain > kLeastJacobianGain ||
                      (gain > -kLeastJacobianGain &&
                       quality_.mean_scaled_jacobian > start.mean_scaled_jacobian + kLeastJacobianGain)));
  if (!is_better) {
    report_.undo_stages(0, report_.stages.size());
    quality_ = start;
  }
  if (going) finish();
  report_.seconds = {{"total", runner_.seconds()}};
  return {is_better ? box_.from_unit(std::move(mesh_)) : original, std::move(quality_.certificate.not_certified),
          std::move(report_)};
}

}  // namespace

CurvedOptimizeResult optimize_curved(const HighOrderMesh& mesh, const VolumeMesh& labels,
                                     const CurvedOptimizeOptions& options) {
  require_no_pyramids(mesh.space.kinds(), "mesh: pyramids cannot be curved");
  if (!std::ranges::all_of(mesh.coefficients, [](const Vec3& x) { return x.allFinite(); }))
    throw InputError("mesh: coefficients must be finite");
  const VolumeMesh cells = mesh.straight_sided();
  if (labels.kinds != cells.kinds || labels.cell_vertices != cells.cell_vertices)
    throw InputError("optimize_curved: the labels belong to other cells");
  return CurvedOptimizer(mesh, labels, options).run(mesh);
}

}  // namespace subvol
