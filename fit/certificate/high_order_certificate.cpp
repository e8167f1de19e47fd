// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/high_order_certificate.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/fit/certificate/hex_boxes.h"
#include "subvol/fit/certificate/simplex_boxes.h"
#include "subvol/mesh/pyramids.h"

#include <Eigen/LU>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>

namespace subvol::internal {

namespace {

constexpr double kDoubleRoundoff = std::numeric_limits<double>::epsilon() / 2;

/// One cell: its functions, and its coefficients with signs applied, relative to its first vertex.
struct Cell {
  ShapeFunctions* shapes;
  int order;
  std::span<const LocalMode> modes;
  std::span<const Vec3> coefficients;
};

/// det J from the shape functions, and a bound on its rounding error.
struct EvaluatedMap {
  double value, margin;
};

EvaluatedMap evaluate(const Cell& cell, const Vec3& point) {
  cell.shapes->set_point(point);
  Mat3 jacobian = Mat3::Zero();
  Vec3 gradient, total = Vec3::Zero();
  for (std::size_t a = 0; a < cell.modes.size(); ++a) {
    cell.shapes->value(cell.modes[a], gradient);
    jacobian += cell.coefficients[a] * gradient.transpose();
    total += cell.coefficients[a].cwiseAbs();
  }
  // Gradient terms are below `size`, accurate to 500 roundings (the sine of 16 pi x); their sum adds one per mode.
  const double size = cell.shapes->kind() == CellKind::hex ? 8 : 8 * cell.order * cell.order;
  const Vec3 error = size * (static_cast<double>(cell.modes.size()) + 500) * kDoubleRoundoff * total;
  const Vec3 rows = jacobian.cwiseAbs().rowwise().sum() + 3 * error;
  const double margin = 3 * (error[0] * rows[1] * rows[2] + error[1] * rows[0] * rows[2]) +
                        3 * error[2] * rows[0] * rows[1] + 16 * kDoubleRoundoff * rows[0] * rows[1] * rows[2];
  return {jacobian.determinant(), 2 * margin};
}

/// Search for the sign of det J over one cell. The box with the lowest corner comes next if that is low; otherwise the
/// box kept last, which shares most work with its halves. A box is bisected in one direction at a time.
template <class Boxes>
class BoxSearch {
 public:
  using Box = typename Boxes::Box;

  BoxSearch(Boxes& boxes, const Cell& cell, const CertificateOptions& options)
      : boxes_(boxes),
        cell_(cell),
        options_(options),
        max_level_(Boxes::kLevelsPerDepth * std::min(options.max_depth, Boxes::max_depth())) {
    result_.lower_bound = kInfinity;
    result_.witness_determinant = kInfinity;
  }

  CellCertificate run() {
    look_at(boxes_.root(), -kInfinity);
    while (!refuted_ && !open_.empty()) {
      std::pop_heap(open_.begin(), open_.end());
      Open next = std::move(open_.back());
      open_.pop_back();
      if (next.box.level >= max_level_) {
        decided_ = false;
        continue;
      }
      auto children = boxes_.children(std::move(next.box), next.lowest);
      if (result_.boxes + static_cast<int>(children.size()) > options_.max_boxes) {
        decided_ = false;
        break;
      }
      for (Box& child : children) {
        look_at(std::move(child), next.lowest);
        if (refuted_) break;
      }
    }
    result_.validity = refuted_ ? CellValidity::invalid : decided_ ? CellValidity::valid : CellValidity::undecided;
    if (result_.validity != CellValidity::valid) result_.lower_bound = -kInfinity;
    if (result_.validity == CellValidity::valid) {
      result_.witness_determinant = 0;
    } else if (result_.witness_determinant == kInfinity) {
      result_.witness = boxes_.corner_point(boxes_.root(), 0);
      result_.witness_determinant = evaluate(cell_, result_.witness).value;
    }
    return result_;
  }

 private:
  struct Open {
    double lowest, urgency;
    std::size_t number;
    Box box;
    bool operator<(const Open& other) const {
      return urgency != other.urgency ? urgency < other.urgency : number < other.number;
    }
  };

  /// Decides a box or keeps it for later; looks for a witness at its corners.
  void look_at(Box box, double parent_lowest) {
    ++result_.boxes;
    if (boxes_.is_hopeless(box)) return keep(std::move(box), parent_lowest);
    double lowest;
    do {
      const double scale = boxes_.determinant_scale(box);
      // Bounds on a whole prism may be very close to det J; those on sub-boxes are far from it.
      const BoundOptions bounding{.single_first = box.level > 0, .corners_first = parent_lowest != -kInfinity};
      double bound = 0;
      int lowest_corner = 0;
      lowest = kInfinity;
      boxes_.with_matrices(box, [&](auto& matrices) {
        bound =
            scale * determinant_bound(matrices, boxes_.remainder(box), boxes_.frame(box), bounding, boxes_.near_l(box));
        if (bound > 0) return;
        for (int corner = 0; corner < boxes_.num_corners(); ++corner) {
          const double value = scale * matrices[boxes_.corner_matrix(box, corner)].determinant();
          if (value < lowest) lowest = value, lowest_corner = corner;
        }
      });
      if (bound > 0) {
        result_.lower_bound = std::min(result_.lower_bound, bound);
        return;
      }
      if (lowest <= 0) lowest = try_witness(boxes_.corner_point(box, lowest_corner));
    } while (lowest > 0 && boxes_.improve(box, lowest, box.level >= max_level_));
    if (lowest > 0 && boxes_.is_stuck(box)) {
      decided_ = false;
      return;
    }
    keep(std::move(box), lowest);
  }

  /// Returns det J there. The model alone cannot refute a cell; the cell's own functions can.
  double try_witness(const Vec3& point) {
    const EvaluatedMap exact = evaluate(cell_, point);
    if (exact.value < result_.witness_determinant) {
      result_.witness = point;
      result_.witness_determinant = exact.value;
      refuted_ = exact.value < -exact.margin;
    }
    return exact.value;
  }

  void keep(Box box, double lowest) {
    boxes_.choose_split(box);
    constexpr double kUrgentDeterminantShare = 0.1;  // share of the mean det J below which the lowest box comes first
    open_.push_back(
        {lowest, -std::min(lowest, kUrgentDeterminantShare * boxes_.mean_determinant()), num_kept_++, std::move(box)});
    std::push_heap(open_.begin(), open_.end());
  }

  Boxes& boxes_;
  const Cell& cell_;
  const CertificateOptions& options_;
  int max_level_;
  bool refuted_ = false, decided_ = true;
  std::vector<Open> open_;  // a heap
  std::size_t num_kept_ = 0;
  CellCertificate result_;
};

}  // namespace

struct HighOrderCertifier::Buffers {
  std::vector<Vec3> coefficients;
  std::map<std::pair<CellKind, int>, ShapeFunctions> shapes;  // by kind and order
  std::map<int, HexBoxes> hexes;                              // by order
  std::map<int, TetBoxes> tets;
  std::map<int, PrismBoxes> prisms;
};

HighOrderCertifier::HighOrderCertifier(const ElementSpace& space, const CertificateOptions& options)
    : space_(&space), options_(options), buffers_(std::make_unique<Buffers>()) {
  check_options(options);
  require_no_pyramids(space.kinds(), "certificate: pyramids cannot be curved");
}
HighOrderCertifier::~HighOrderCertifier() = default;
HighOrderCertifier::HighOrderCertifier(HighOrderCertifier&&) noexcept = default;

CellCertificate HighOrderCertifier::certify(std::span<const Vec3> coefficients, std::size_t c) {
  assert(coefficients.size() == space_->num_nodes());
  const std::size_t pattern = space_->pattern(c);
  const int order = space_->pattern_order(pattern);
  const CellKind kind = space_->kind(c);
  const auto nodes = space_->nodes(c);
  const auto signs = space_->signs(c);
  Cell cell{nullptr, order, space_->modes(c), {}};

  const Vec3 origin = coefficients[space_->vertices(c)[0]];
  buffers_->coefficients.resize(nodes.size());
  for (std::size_t a = 0; a < nodes.size(); ++a) {
    const bool is_vertex = static_cast<std::size_t>(nodes[a]) < space_->num_vertices();
    buffers_->coefficients[a] = is_vertex ? Vec3(coefficients[nodes[a]] - origin) : signs[a] * coefficients[nodes[a]];
  }
  cell.coefficients = buffers_->coefficients;
  const double size = Eigen::Map<const Eigen::VectorXd>(buffers_->coefficients.data()->data(),
                                                        3 * static_cast<Eigen::Index>(nodes.size()))
                          .lpNorm<1>();
  if (!(size >= 1e-50 && size <= 1e50)) {
    CellCertificate result;
    result.lower_bound = -kInfinity;
    return result;
  }
  cell.shapes = &buffers_->shapes.try_emplace({kind, order}, kind, space_->basis(), order).first->second;
  const auto search = [&](auto& all) {
    auto& boxes = all.try_emplace(order, space_->basis(), order).first->second;
    boxes.set_cell(cell.modes, cell.coefficients);
    return BoxSearch(boxes, cell, options_).run();
  };
  return kind == CellKind::hex     ? search(buffers_->hexes)
         : kind == CellKind::prism ? search(buffers_->prisms)
                                   : search(buffers_->tets);
}

CertificateSummary certify(const ElementSpace& space, std::span<const Vec3> coefficients,
                           const CertificateOptions& options) {
  check_options(options);
  if (coefficients.size() != space.num_nodes())
    throw InputError("certificate: " + std::to_string(coefficients.size()) + " coefficients for " +
                     std::to_string(space.num_nodes()) + " nodes");
  std::vector<CellValidity> validity(space.num_cells());
  ParallelErrors errors;
#pragma omp parallel
  {
    std::optional<HighOrderCertifier> certifier;
    errors.guard([&] { certifier.emplace(space, options); });
#pragma omp for schedule(dynamic, 4)
    for (std::size_t c = 0; c < validity.size(); ++c)
      errors.guard([&] { validity[c] = certifier->certify(coefficients, c).validity; });
  }
  errors.rethrow();
  return summarize(validity);
}

}  // namespace subvol::internal
