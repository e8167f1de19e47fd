// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/simplex_boxes.h"

#include "fit/element_rule.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>

namespace subvol {

SimplexBoxes::SimplexBoxes(CellKind kind, Basis basis, int order)
    : kind_(kind), simplex_(SimplexModels::get(kind, basis, order)), line_(LineModels::get(basis, order)),
      num_layers_(kind == CellKind::tet ? 1 : order + 1), w_controls_(kind == CellKind::tet ? 1 : line_.degree() + 1),
      lower_(simplex_.index().dimension(), simplex_.index().degree() - 1) {
  const SimplexIndex& index = simplex_.index();
  reduced_.assign(index.size(), {-1, -1, -1, -1});
  for (int n = 0; n < lower_.size(); ++n) {
    std::array<int, 4> raised{};
    for (int c = 0; c <= index.dimension(); ++c) {
      SimplexIndex::Exponents e = lower_.exponents(n);
      ++e[c];
      raised[c] = index.find(e);
      reduced_[raised[c]][c] = n;
    }
    raised_.push_back(raised);
  }
  matrices_.resize(kind == CellKind::tet ? lower_.size() : index.size() * w_controls_);
}

void SimplexBoxes::set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients) {
  modes_ = modes;
  coefficients_ = coefficients;
  slots_.clear();
  for (const LocalMode& mode : modes) slots_.push_back(simplex_.slot(mode));
}

bool SimplexBoxes::is_stuck(const Box& box) {
  if (box.halvings < simplex_.most_halvings() || box.lasting.maxCoeff() == 0) return false;
  const Mat3 mean = matrices(box).mean();
  mean_.resize(kWide);
  for (int row = 0; row < 3; ++row)
    for (int d = 0; d < 3; ++d) std::fill_n(mean_.entries(row, d), kWide, mean(row, d));
  return mean.determinant() > 0 && determinant_bound(mean_, box.lasting * sides(box).cwiseAbs()) == 0;
}

SimplexBoxes::Box SimplexBoxes::root() const {
  Box box;
  const auto vertices = canonical_vertices(kind_);
  std::copy_n(vertices.begin(), simplex_.index().dimension() + 1, box.vertices.begin());
  take_models(box);
  return box;
}

void SimplexBoxes::take_models(Box& box) const {
  const bool prism = kind_ == CellKind::prism;
  const std::size_t size = simplex_.index().size();
  box.models = simplex_.part(box.part, box.vertices);
  box.lasting.setZero();
  box.control.assign(3 * num_layers_ * size, 0);
  for (std::size_t a = 0; a < modes_.size(); ++a) {
    const SimplexModels::Function& f = (*box.models)[slots_[a]];
    const std::size_t layer = prism ? modes_[a].k : 0;
    const double across = f.gradient_error * (prism ? line_.bounds()[layer] : 1);
    const double along = prism ? f.error * line_.slope_bounds()[layer] : across;
    box.lasting += coefficients_[a].cwiseAbs() * Eigen::RowVector3d(across, across, along);
    const double* b = f.coefficients.data();
    for (std::size_t row = 0; row < 3; ++row) {
      double* out = box.control.data() + (row * num_layers_ + layer) * size;
      const double x = coefficients_[a][row];
      for (std::size_t n = 0; n < size; ++n) out[n] += x * b[n];
    }
  }
}

std::array<SimplexBoxes::Box, 2> SimplexBoxes::children(const Box& box) const {
  const SimplexIndex& index = simplex_.index();
  const Mat3 ideal = ideal_matrix(kind_);
  int a = 0, b = 1;
  double longest = 0;
  for (int i = 0; i <= index.dimension(); ++i)
    for (int j = i + 1; j <= index.dimension(); ++j) {
      const double length = (ideal * (box.vertices[j] - box.vertices[i])).norm();
      if (length > longest * (1 + 1e-9)) longest = length, a = i, b = j;
    }
  std::array<Box, 2> result{box, box};
  for (Box& child : result) ++child.level;
  if (kind_ == CellKind::prism && box.w_level < LineModels::kMaxLevel && std::ldexp(1.0, -box.w_level) > longest) {
    for (int half = 0; half < 2; ++half) {
      ++result[half].w_level;
      result[half].w_index = 2 * box.w_index + half;
    }
    return result;
  }
  result[0].vertices[b] = result[1].vertices[a] = 0.5 * (box.vertices[a] + box.vertices[b]);
  const int halvings = box.halvings + 1;
  const bool modelled = halvings <= simplex_.most_halvings() && halvings % simplex_.halvings_between() == 0;
  for (std::uint32_t half = 0; half < 2; ++half) {
    result[half].halvings = halvings;
    if (halvings <= simplex_.most_halvings()) result[half].part = 2 * box.part + half;
    if (modelled) take_models(result[half]);
  }
  if (!modelled) halve_control(box, a, b, result);
  return result;
}

void SimplexBoxes::halve_control(const Box& box, int a, int b, std::array<Box, 2>& halves) const {
  // Where the other exponents are the same, the coefficients are those of a polynomial along the side from a to b.
  const SimplexIndex& index = simplex_.index();
  std::array<double, 32> line;
  std::array<int, 32> at;
  const std::size_t size = index.size();
  for (int first = 0; first < index.size(); ++first) {
    SimplexIndex::Exponents e = index.exponents(first);
    if (e[b] != 0) continue;
    const int degree = e[a];
    for (int o = 0; o <= degree; ++o) {
      at[o] = index.find(e);
      --e[a];
      ++e[b];
    }
    for (std::size_t layer = 0; layer < 3u * num_layers_; ++layer) {
      const double* in = box.control.data() + layer * size;
      double* low = halves[0].control.data() + layer * size;
      double* high = halves[1].control.data() + layer * size;
      for (int o = 0; o <= degree; ++o) line[o] = in[at[o]];
      for (int step = 0; step <= degree; ++step) {
        low[at[step]] = line[0];
        high[at[degree - step]] = line[degree - step];
        for (int o = 0; o < degree - step; ++o) line[o] = 0.5 * (line[o] + line[o + 1]);
      }
    }
  }
}

Vec3 SimplexBoxes::corner_point(const Box& box, int corner) const {
  if (kind_ == CellKind::tet) return box.vertices[corner];
  return box.vertices[corner % 3] + std::ldexp(box.w_index + corner / 3, -box.w_level) * Vec3::UnitZ();
}

std::size_t SimplexBoxes::corner_matrix(int corner) const {
  SimplexIndex::Exponents e{};
  const SimplexIndex& index = kind_ == CellKind::tet ? lower_ : simplex_.index();
  e[kind_ == CellKind::tet ? corner : corner % 3] = static_cast<std::int8_t>(index.degree());
  const int layer = kind_ == CellKind::tet ? 0 : corner / 3 * (w_controls_ - 1);
  return static_cast<std::size_t>(layer * index.size() + index.find(e));
}

const ControlMatrices& SimplexBoxes::matrices(const Box& box) {
  const SimplexIndex& index = simplex_.index();
  const int size = index.size(), degree = index.degree();
  if (kind_ == CellKind::tet) {
    for (int row = 0; row < 3; ++row) {
      const double* x = box.control.data() + row * size;
      for (int d = 0; d < 3; ++d) {
        double* out = matrices_.entries(row, d);
        for (int n = 0; n < lower_.size(); ++n) out[n] = degree * (x[raised_[n][d + 1]] - x[raised_[n][0]]);
      }
    }
    return matrices_;
  }
  const double* table = line_.coefficients(line_.level(box.w_level), box.w_index);
  const int q = w_controls_ - 1;
  contracted_.resize(static_cast<std::size_t>(w_controls_) * size);
  for (int row = 0; row < 3; ++row) {
    std::fill(contracted_.begin(), contracted_.end(), 0.0);
    for (int k = 0; k < num_layers_; ++k) {
      const double* x = box.control.data() + (row * num_layers_ + k) * size;
      for (int o = 0; o <= q; ++o) {
        const double weight = table[k * LineModels::kStride + o];
        for (int n = 0; n < size; ++n) contracted_[o * size + n] += weight * x[n];
      }
    }
    for (int o = 0; o <= q; ++o) {
      const double* x = contracted_.data() + o * size;
      for (int d = 0; d < 2; ++d) {
        double* out = matrices_.entries(row, d) + o * size;
        for (int n = 0; n < size; ++n) {
          double sum = 0;
          for (int c = 0; c < 3; ++c) {
            const int from = reduced_[n][c];
            if (from >= 0) sum += index.exponents(n)[c] * (x[raised_[from][d + 1]] - x[raised_[from][0]]);
          }
          out[n] = sum;
        }
      }
      double* out = matrices_.entries(row, 2) + o * size;
      for (int n = 0; n < size; ++n) {
        const double before = o > 0 ? o * (x[n] - x[n - size]) : 0, after = o < q ? (q - o) * (x[n + size] - x[n]) : 0;
        out[n] = before + after;
      }
    }
  }
  return matrices_;
}

Mat3 SimplexBoxes::sides(const Box& box) const {
  Mat3 result;
  for (int d = 0; d < 3; ++d) result.col(d) = box.vertices[d + 1] - box.vertices[0];
  if (kind_ == CellKind::prism) result.col(2) = std::ldexp(1.0, -box.w_level) * Vec3::UnitZ();
  return result;
}

double SimplexBoxes::determinant_scale(const Box& box) const { return 1 / sides(box).determinant(); }

Mat3 SimplexBoxes::remainder(const Box& box) const {
  const bool prism = kind_ == CellKind::prism;
  const LineModels::Level& level = line_.level(box.w_level);
  Mat3 modelling = Mat3::Zero();
  Vec3 size = Vec3::Zero();
  for (std::size_t a = 0; a < modes_.size(); ++a) {
    const SimplexModels::Function& f = (*box.models)[slots_[a]];
    const Vec3 x = coefficients_[a].cwiseAbs();
    if (!prism) {
      modelling += f.gradient_error * x * Eigen::RowVector3d::Ones();
      size += f.largest_coefficient * x;
      continue;
    }
    const int k = modes_[a].k;
    const double n = line_.bounds()[k], error = level.error[k], slope_error = level.slope_error[k];
    const double across = f.gradient_bound * error + f.gradient_error * (n + error);
    const double along = f.value_bound * slope_error + f.error * (line_.slope_bounds()[k] + slope_error);
    modelling += x * Eigen::RowVector3d(across, across, along);
    size += f.largest_coefficient * level.largest_coefficient[k] * x;
  }
  // Sums over modes and along w, tables, the shift, halvings of `degree` averages each, differences, the 16 asked for.
  const int degree = simplex_.index().degree();
  const double roundings =
      static_cast<double>(modes_.size()) + 64 + num_layers_ + 4 + 1 + degree * box.level + degree + 8 + 16;
  const double factor = 2 * std::max(degree, w_controls_ - 1) * roundings * std::numeric_limits<double>::epsilon() / 2;
  return (1 + 1e-10) * (modelling * sides(box).cwiseAbs() + factor * size * Eigen::RowVector3d::Ones());
}

}  // namespace subvol
