// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/quality/quality.h"

#include "subvol/base/error.h"
#include "subvol/fit/certificate/bernstein.h"
#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/elements/quadrature.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <string>

namespace subvol {

using namespace internal;

namespace {

using bernstein::Vector;

/// Summary of a cell's samples; the mean over the cell has the trapezoidal rule's weights.
template <class T>
struct Sampled {
  T least, mean;
};

/// Weights of the samples in the mean over a cell, in their order.
std::vector<double> sample_weights(CellKind kind, int n) {
  return make_quadrature(kind, QuadratureRule::trapezoidal, n).weights;
}

template <class T>
Vector<T> blend(const Vector<T>& p, const Vector<T>& q, double t) {
  return {T((1 - t) * p[0] + t * q[0]), T((1 - t) * p[1] + t * q[1]), T((1 - t) * p[2] + t * q[2])};
}

/// Returns v / |v|, or 0 for 0.
template <class T>
Vector<T> direction(const Vector<T>& v) {
  const T length_squared = bernstein::dot(v, v);
  const T scale = 1.0 / square_root(larger(length_squared, T(length_squared * 0 + std::numeric_limits<double>::min())));
  return {T(v[0] * scale), T(v[1] * scale), T(v[2] * scale)};
}

/// F e2 and F e3 from derivatives along the canonical axes, with A^-1 of the equilateral triangle and regular
/// tetrahedron.
template <class T>
Vector<T> second_column(const Vector<T>& xu, const Vector<T>& xv) {
  const double f = 1 / std::sqrt(3.0);
  Vector<T> result;
  for (int a = 0; a < 3; ++a) result[a] = f * (2.0 * xv[a] - xu[a]);
  return result;
}
template <class T>
Vector<T> third_column_of_tet(const Vector<T>& xu, const Vector<T>& xv, const Vector<T>& xw) {
  const double f = 1 / std::sqrt(6.0);
  Vector<T> result;
  for (int a = 0; a < 3; ++a) result[a] = f * (3.0 * xw[a] - xu[a] - xv[a]);
  return result;
}

template <class T>
T triple(const Vector<T>& a, const Vector<T>& b, const Vector<T>& c) {
  return bernstein::dot(a, bernstein::cross(b, c));
}

/// Directions of dx/d(axis) on an n x n grid over the two other axes; the lower of these varies more slowly.
template <class T>
void edge_directions(const std::array<Vector<T>, 8>& x, int axis, int n, std::vector<Vector<T>>& out) {
  std::array<Vector<T>, 4> edge;
  for (int m = 0; m < 4; ++m) {
    const auto corner = [&](int end) {
      int ijk[3];
      ijk[axis] = end;
      ijk[axis == 0 ? 1 : 0] = m / 2;
      ijk[axis == 2 ? 1 : 2] = m % 2;
      return x[bernstein::hex_corner(ijk[0], ijk[1], ijk[2])];
    };
    edge[m] = bernstein::difference(corner(1), corner(0));
  }
  out.clear();
  for (int p = 0; p < n; ++p) {
    const double s = p / (n - 1.0);
    const Vector<T> low = blend(edge[0], edge[2], s), high = blend(edge[1], edge[3], s);
    for (int q = 0; q < n; ++q) out.push_back(direction(blend(low, high, q / (n - 1.0))));
  }
}

/// Samples hexes, and holds the buffers of one thread.
template <class T>
struct HexSampler {
  std::array<std::vector<Vector<T>>, 3> directions;

  Sampled<T> run(const std::array<Vector<T>, 8>& x, int n, std::span<const double> weights) {
    for (int axis = 0; axis < 3; ++axis) edge_directions(x, axis, n, directions[axis]);
    const auto& [du, dv, dw] = directions;
    Sampled<T> result;
    bool first = true;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        for (int k = 0; k < n; ++k, first = false) {
          const double weight = weights[(i * n + j) * n + k];
          const T value = triple(du[n * j + k], dv[n * i + k], dw[n * i + j]);
          result.least = first ? value : smaller(value, result.least);
          result.mean = first ? T(weight * value) : T(result.mean + weight * value);
        }
    return result;
  }
};

using Point = Vector<double>;

Point to_point(const Vec3& p) { return {p[0], p[1], p[2]}; }

Sampled<double> sample_prism(std::span<const Vec3> corners, int n, std::span<const double> weights) {
  std::array<Point, 6> x;
  for (int v = 0; v < 6; ++v) x[v] = to_point(corners[v]);
  Sampled<double> result{1, 0};
  std::size_t q = 0;
  for (int k = 0; k < n; ++k) {
    const double w = k / (n - 1.0);
    const Point xu = blend(bernstein::difference(x[1], x[0]), bernstein::difference(x[4], x[3]), w);
    const Point xv = blend(bernstein::difference(x[2], x[0]), bernstein::difference(x[5], x[3]), w);
    const Point normal = bernstein::cross(direction(xu), direction(second_column(xu, xv)));
    for (int j = 0; j < n; ++j)
      for (int i = 0; i + j < n; ++i) {
        const double u = i / (n - 1.0), v = j / (n - 1.0);
        Point up;
        for (int a = 0; a < 3; ++a)
          up[a] = (1 - u - v) * (x[3][a] - x[0][a]) + u * (x[4][a] - x[1][a]) + v * (x[5][a] - x[2][a]);
        const double value = bernstein::dot(normal, direction(up));
        result.least = smaller(value, result.least);
        result.mean += weights[q++] * value;
      }
  }
  return result;
}

double tet_value(std::span<const Vec3> corners) {
  const Point xu = to_point(corners[1] - corners[0]), xv = to_point(corners[2] - corners[0]),
              xw = to_point(corners[3] - corners[0]);
  return triple(direction(xu), direction(second_column(xu, xv)), direction(third_column_of_tet(xu, xv, xw)));
}

/// J is the same along each ray from the base to the apex.
Sampled<double> sample_pyramid(std::span<const Vec3> corners, int n, std::span<const double> weights) {
  const double f = std::sqrt(2.0);
  std::array<Point, 5> x;
  for (int v = 0; v < 5; ++v) x[v] = to_point(corners[v]);
  const Point low_u = bernstein::difference(x[1], x[0]), high_u = bernstein::difference(x[2], x[3]),
              low_v = bernstein::difference(x[3], x[0]), high_v = bernstein::difference(x[2], x[1]);
  Sampled<double> result{1, 0};
  std::size_t q = 0;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double s = i / (n - 1.0), t = j / (n - 1.0);
      const Point xu = blend(low_u, high_u, t), xv = blend(low_v, high_v, s);
      const Point base = blend(blend(x[0], x[1], s), blend(x[3], x[2], s), t);
      Point up;
      for (int a = 0; a < 3; ++a) up[a] = f * (x[4][a] - base[a] + (s - 0.5) * xu[a] + (t - 0.5) * xv[a]);
      const double value = triple(direction(xu), direction(xv), direction(up));
      result.least = smaller(value, result.least);
      result.mean += weights[q++] * value;
    }
  return result;
}

std::size_t num_samples(CellKind kind, std::size_t n) {
  switch (kind) {
    case CellKind::tet: return n * (n + 1) * (n + 2) / 6;
    case CellKind::prism: return n * n * (n + 1) / 2;
    case CellKind::pyramid: return n * n;
    case CellKind::hex: break;
  }
  return n * n * n;
}

Sampled<double> sample_cell(CellKind kind, std::span<const Vec3> corners, int n, std::span<const double> weights) {
  if (kind == CellKind::prism) return sample_prism(corners, n, weights);
  if (kind == CellKind::pyramid) return sample_pyramid(corners, n, weights);
  if (kind == CellKind::tet) {
    const double value = tet_value(corners);
    return {value, value};
  }
  std::array<Point, 8> x;
  for (int v = 0; v < 8; ++v) x[v] = to_point(corners[v]);
  return HexSampler<double>{}.run(x, n, weights);
}

/// The points of a rule with the gradients of the shape functions in canonical coordinates; unused rows are 0.
struct SamplePoints {
  using Gradients = Eigen::Matrix<double, kMaxCellVertices, 3>;
  std::vector<Vec3> points;
  std::vector<double> weights;
  std::vector<Gradients> gradients;

  SamplePoints(CellKind kind, int n) {
    const ElementRule rule = make_element_rule(kind, n);
    points = rule.points;
    weights = rule.weights;
    gradients.assign(points.size(), Gradients::Zero());
    const Mat3 ideal = ideal_matrix(kind);
    for (std::size_t q = 0; q < points.size(); ++q)
      for (const ElementRule::Entry& entry : rule.point(q))
        gradients[q].row(entry.vertex) = Eigen::Map<const Vec3>(entry.gradient.data()).transpose() * ideal;
  }
};

/// Samples one cell against its reference.
Sampled<double> sample_cell(std::span<const Vec3> corners, const SamplePoints& at, const CellReference& reference,
                            Index cell) {
  Eigen::Matrix<double, 3, kMaxCellVertices> x = Eigen::Matrix<double, 3, kMaxCellVertices>::Zero();
  for (std::size_t v = 0; v < corners.size(); ++v) x.col(static_cast<Index>(v)) = corners[v] - corners[0];
  Sampled<double> result{1, 0};
  for (std::size_t q = 0; q < at.points.size(); ++q) {
    const Mat3 jacobian = x * at.gradients[q];
    const Mat3 f = jacobian * reference(cell, at.points[q]).inverse();
    const double squared = f.col(0).squaredNorm() * f.col(1).squaredNorm() * f.col(2).squaredNorm();
    const double value = squared > 0 ? f.determinant() / std::sqrt(squared) : 0;
    result.least = std::min(result.least, value);
    result.mean += at.weights[q] * value;
  }
  return result;
}

/// Samples every cell. If a mean is not a number, comparisons have lost the lowest value too.
std::vector<Sampled<double>> sample_cells(const VolumeMesh& mesh, int n, const CellReference& reference) {
  std::vector<Sampled<double>> result(mesh.num_cells());
  const auto keep = [&](std::size_t c, double least, double mean) {
    const bool finite = std::isfinite(mean);
    result[c] = {finite ? std::clamp(least, -1.0, 1.0) : -1, finite ? mean : -1};
  };
  if (reference) {
    const SamplePoints points[] = {
        {CellKind::tet, n}, {CellKind::prism, n}, {CellKind::hex, n}, {CellKind::pyramid, n}};
#pragma omp parallel for schedule(static)
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const auto corners = gather_cell(mesh.positions, mesh, c);
      const SamplePoints& at = points[static_cast<std::size_t>(mesh.kinds[c])];
      const Sampled<double> s =
          sample_cell({corners.data(), mesh.cell(c).size()}, at, reference, static_cast<Index>(c));
      keep(c, s.least, s.mean);
    }
    return result;
  }
  const std::vector<double> of_prism = sample_weights(CellKind::prism, n), of_hex = sample_weights(CellKind::hex, n),
                            of_pyramid = sample_weights(CellKind::pyramid, n);
  const auto hexes = [&](std::size_t first) {
    thread_local HexSampler<Lanes> sampler;
    const Sampled<Lanes> s = sampler.run(gather_hexes(mesh.positions, mesh.cell(first).data()), n, of_hex);
    for (int lane = 0; lane < kSimdLanes; ++lane) keep(first + lane, s.least[lane], s.mean[lane]);
  };
  for_each_cell_block(mesh, hexes, [&](std::size_t c) {
    const auto corners = gather_cell(mesh.positions, mesh, c);
    const Sampled<double> s = sample_cell(mesh.kinds[c], {corners.data(), mesh.cell(c).size()}, n,
                                          mesh.kinds[c] == CellKind::prism     ? of_prism
                                          : mesh.kinds[c] == CellKind::pyramid ? of_pyramid
                                                                               : of_hex);
    keep(c, s.least, s.mean);
  });
  return result;
}

Vec3 mean_of_corners(const VolumeMesh& mesh, Index c) {
  Vec3 sum = Vec3::Zero();
  for (const Index v : mesh.cell(c)) sum += mesh.positions[v];
  return sum / static_cast<double>(mesh.cell(c).size());
}

}  // namespace

void QualityReport::add_cell(double least) {
  cell_minima.push_back(least);
  min_scaled_jacobian = std::min(min_scaled_jacobian, least);
  ++histogram[std::min(static_cast<int>((least + 1) * kNumHistogramBins / 2), kNumHistogramBins - 1)];
  inverted_cells += least <= 0;
}

void QualityReport::keep_worst(const std::function<Vec3(Index)>& center) {
  std::vector<Index> order(cell_minima.size());
  for (std::size_t c = 0; c < order.size(); ++c) order[c] = static_cast<Index>(c);
  const std::size_t count = std::min<std::size_t>(10, order.size());
  std::partial_sort(order.begin(), order.begin() + count, order.end(), [&](Index a, Index b) {
    return cell_minima[a] != cell_minima[b] ? cell_minima[a] < cell_minima[b] : a < b;
  });
  worst_cells.clear();
  for (std::size_t i = 0; i < count; ++i) worst_cells.push_back({order[i], center(order[i]), cell_minima[order[i]]});
}

QualityReport measure_quality(const VolumeMesh& mesh, int samples_per_direction, const CellReference& reference) {
  const int n = samples_per_direction;
  if (n < 2) throw InputError("quality: samples_per_direction is " + std::to_string(n) + ", expected 2 or more");
  QualityReport report;
  report.num_cells = mesh.num_cells();
  const std::vector<Sampled<double>> samples = sample_cells(mesh, n, reference);
  double sum = 0;
  for (std::size_t c = 0; c < samples.size(); ++c) {
    report.add_cell(samples[c].least);
    const std::size_t count = num_samples(mesh.kinds[c], n);
    report.num_samples += count;
    sum += static_cast<double>(count) * samples[c].mean;
  }
  if (report.num_samples > 0) report.mean_scaled_jacobian = sum / static_cast<double>(report.num_samples);
  report.certificate = certify(mesh);
  for (const Index c : report.certificate.invalid_cells) report.inverted_cells += report.cell_minima[c] > 0;
  report.keep_worst([&](Index c) { return mean_of_corners(mesh, c); });
  return report;
}

}  // namespace subvol
