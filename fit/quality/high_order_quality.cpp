// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/quality/high_order_quality.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/fit/certificate/high_order_certificate.h"
#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/elements/pattern_table.h"
#include "subvol/fit/elements/quadrature.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace subvol::internal {
namespace {

constexpr std::size_t kPointsPerPatternTable = 512;  // so that tables of high orders stay small

/// Summary of a cell's samples.
struct SampledCell {
  double least = 1, mean = 0;
  std::size_t count = 0;
};

double scaled_jacobian(const Mat3& jacobian, const Mat3& ideal_inverse) {
  const Mat3 f = jacobian * ideal_inverse;
  const double lengths = f.col(0).norm() * f.col(1).norm() * f.col(2).norm();
  const double value = lengths > 0 ? f.determinant() / lengths : 0;
  return std::isfinite(value) && std::isfinite(lengths) ? std::clamp(value, -1.0, 1.0) : -1;
}

void sample_pattern(const HighOrderMesh& mesh, std::size_t pattern, std::span<const Index> cells, int n,
                    const CellReference& reference, std::vector<SampledCell>& samples) {
  const CellKind kind = mesh.space.pattern_kind(pattern);
  const Quadrature rule = make_quadrature(kind, QuadratureRule::trapezoidal, n);
  const std::vector<Vec3>& points = rule.points;
  const Mat3 inverse = ideal_inverse(kind);
  for (std::size_t begin = 0; begin < points.size(); begin += kPointsPerPatternTable) {
    const std::size_t size = std::min(kPointsPerPatternTable, points.size() - begin);
    const PatternTable table(mesh.space, pattern, std::span(points).subspan(begin, size),
                             PatternTable::Derivatives::first);
    const auto sample = [&](Index c, std::vector<Mat3>& jacobians) {
      jacobians.resize(size);
      table.jacobians(mesh, c, jacobians);
      SampledCell& sampled = samples[c];
      for (std::size_t q = 0; q < size; ++q) {
        const double value =
            scaled_jacobian(jacobians[q], reference ? Mat3(reference(c, points[begin + q]).inverse()) : inverse);
        sampled.least = std::min(sampled.least, value);
        sampled.mean += rule.weights[begin + q] * value;
      }
      sampled.count += size;
    };
    ParallelErrors errors;
#pragma omp parallel
    {
      std::vector<Mat3> jacobians;
#pragma omp for schedule(static)
      for (std::size_t i = 0; i < cells.size(); ++i) errors.guard([&] { sample(cells[i], jacobians); });
    }
    errors.rethrow();
  }
}

Vec3 mean_of_corners(const HighOrderMesh& mesh, Index c) {
  const auto vertices = mesh.space.vertices(c);
  Vec3 sum = Vec3::Zero();
  for (const Index v : vertices) sum += mesh.coefficients[v];
  return sum / static_cast<double>(vertices.size());
}

}  // namespace

QualityReport measure_quality(const HighOrderMesh& mesh, int samples_per_direction, const CellReference& reference) {
  if (samples_per_direction != 0 && samples_per_direction < 2)
    throw InputError("quality: samples_per_direction is " + std::to_string(samples_per_direction) +
                     ", expected 2 or more, or 0");
  std::vector<SampledCell> samples(mesh.space.num_cells());
  const auto cells = cells_by_pattern(mesh.space);
  for (std::size_t pattern = 0; pattern < cells.size(); ++pattern) {
    const int dense = std::max(5, 2 * mesh.space.pattern_order(pattern) + 3);
    sample_pattern(mesh, pattern, cells[pattern], samples_per_direction ? samples_per_direction : dense, reference,
                   samples);
  }
  QualityReport report;
  report.num_cells = samples.size();
  double sum = 0;
  for (std::size_t c = 0; c < samples.size(); ++c) {
    report.add_cell(samples[c].least);
    report.num_samples += samples[c].count;
    sum += static_cast<double>(samples[c].count) * samples[c].mean;
  }
  if (report.num_samples > 0) report.mean_scaled_jacobian = sum / static_cast<double>(report.num_samples);
  report.certificate = certify(mesh.space, mesh.coefficients);
  for (const Index c : report.certificate.invalid_cells) report.inverted_cells += report.cell_minima[c] > 0;
  report.keep_worst([&](Index c) { return mean_of_corners(mesh, c); });
  return report;
}

}  // namespace subvol::internal
