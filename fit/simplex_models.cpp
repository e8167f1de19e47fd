// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/simplex_models.h"

#include "fit/chebyshev.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <mutex>

namespace subvol {

namespace {

constexpr long double kPi = std::numbers::pi_v<long double>, kSqrt2 = std::numbers::sqrt2_v<long double>;
using Coefficients = std::vector<long double>;

/// psi_i and its derivative inside (0, 1/2].
void kernel_below_half(Basis basis, int i, long double x, long double& value, long double& slope) {
  if (basis == Basis::fourier) {
    value = kSqrt2 * std::sin(i * kPi * x) / (i * kPi) / (x * (1 - x));
    slope = (kSqrt2 * std::cos(i * kPi * x) - value * (1 - 2 * x)) / (x * (1 - x));
    return;
  }
  // psi_i = 2 sqrt(2i+1) / (i (i+1)) P_i'(1 - 2x); P_{n+1}' = P_{n-1}' + (2n+1) P_n, and so for P''.
  const long double t = 1 - 2 * x;
  long double p0 = 1, p1 = t, d0 = 0, d1 = 1, s0 = 0, s1 = 0;
  for (int n = 1; n < i; ++n) {
    const long double p = ((2 * n + 1) * t * p1 - n * p0) / (n + 1), d = d0 + (2 * n + 1) * p1,
                      s = s0 + (2 * n + 1) * d1;
    p0 = p1, p1 = p, d0 = d1, d1 = d, s0 = s1, s1 = s;
  }
  const long double factor = 2 * std::sqrt(2 * i + 1.0L) / (i * (i + 1));
  value = factor * d1;
  slope = -2 * factor * s1;
}

void kernel(Basis basis, int i, long double x, long double& value, long double& slope) {
  kernel_below_half(basis, i, std::min(x, 1 - x), value, slope);
  if (x > 0.5L) value *= mode_parity(i), slope *= -mode_parity(i);
}

/// A polynomial in Bernstein form, and how far it is from what it stands for.
struct Model {
  int degree;
  Coefficients b;
  double value_bound, gradient_bound, error, gradient_error;
};

/// psi_i over [0, 1] by a polynomial of a degree.
///
/// |psi_i^(n)| <= 2 sqrt2 (i pi)^n / (n + 1) for fourier: psi_i = phi_i / x + phi_i / (1 - x), each a mean of cosines.
Model kernel_model(Basis basis, int i, int degree) {
  const bool exact = basis == Basis::legendre;
  assert(!exact || degree >= i - 1);
  const double frequency = i * std::numbers::pi;
  Model model{degree, Coefficients(degree + 1, 0.0L), exact ? std::sqrt(2 * i + 1.0) : 2 * std::numbers::sqrt2,
              exact ? 2.0 * i * i * std::sqrt(2 * i + 1.0) : std::numbers::sqrt2 * frequency, 0, 0};
  model.value_bound *= 1 + 1e-14;
  model.gradient_bound *= 1 + 1e-14;
  long double middle, slope;
  kernel(basis, i, 0.5L, middle, slope);
  model.gradient_error = exact ? 0 : model.gradient_bound;
  if (degree > 0) {
    const int num_nodes = exact ? std::max(degree, 1) : degree + 16 + i;
    Coefficients expanded(degree), slopes(degree, 0.0L);
    const double log_bound = exact ? -std::numeric_limits<double>::infinity()
                                   : 1.5 * std::numbers::ln2 + (num_nodes + 1) * std::log(frequency);
    const double remainder = ChebyshevExpansion(num_nodes).expand(
        [&](long double x) {
          long double value, at;
          kernel(basis, i, x, value, at);
          return at;
        },
        0.5L, 0.5L, log_bound, degree, expanded.data());
    if (exact || remainder < model.gradient_bound) {
      if (!exact) model.gradient_error = remainder;
      const auto to_bernstein = chebyshev_to_bernstein(degree - 1);
      for (int k = 0; k < degree; ++k)
        for (int o = 0; o < degree; ++o) slopes[o] += expanded[k] * to_bernstein[k][o];
      for (int o = 0; o < degree; ++o) model.b[o + 1] = model.b[o] + slopes[o] / degree;
    }
  }
  long double at_middle = 0, binomial = 1;
  for (int o = 0; o <= degree; ++o) {
    at_middle += std::ldexp(binomial * model.b[o], -degree);
    binomial = binomial * (degree - o) / (o + 1);
  }
  for (long double& b : model.b) b += middle - at_middle;
  model.error = 0.5 * model.gradient_error;
  return model;
}

long double multinomial(const SimplexIndex::Exponents& e) {
  long double result = 1;
  int n = 0;
  for (const int exponent : e)
    for (int k = 1; k <= exponent; ++k) result = result * ++n / k;
  return result;
}

Coefficients product(int dimension, int degree_a, const Coefficients& a, int degree_b, const Coefficients& b) {
  const SimplexIndex index_a(dimension, degree_a), index_b(dimension, degree_b), index(dimension, degree_a + degree_b);
  Coefficients weighted_b(b), result(index.size(), 0.0L);
  for (int n = 0; n < index_b.size(); ++n) weighted_b[n] *= multinomial(index_b.exponents(n));
  for (int m = 0; m < index_a.size(); ++m) {
    if (a[m] == 0) continue;
    const long double weight = a[m] * multinomial(index_a.exponents(m));
    for (int n = 0; n < index_b.size(); ++n) {
      SimplexIndex::Exponents sum = index_a.exponents(m);
      for (int c = 0; c < 4; ++c) sum[c] = static_cast<std::int8_t>(sum[c] + index_b.exponents(n)[c]);
      result[index.find(sum)] += weight * weighted_b[n];
    }
  }
  for (int n = 0; n < index.size(); ++n) result[n] /= multinomial(index.exponents(n));
  return result;
}

Model product(int dimension, const Model& f, const Model& g) {
  const double fp = f.value_bound + f.error, gp = g.value_bound + g.error;
  return {f.degree + g.degree,
          product(dimension, f.degree, f.b, g.degree, g.b),
          f.value_bound * g.value_bound,
          f.gradient_bound * g.value_bound + f.value_bound * g.gradient_bound,
          f.value_bound * g.error + f.error * gp,
          f.gradient_bound * g.error + f.gradient_error * gp + g.gradient_bound * f.error + g.gradient_error * fp};
}

/// A model over [0, 1] of an argument affine on the simplex: `ends` are its values at the vertices, 0, 1/2 or 1.
Model composed(int dimension, const Model& line, const std::array<double, 4>& ends) {
  const SimplexIndex index(dimension, line.degree);
  Model result = line;
  result.b.assign(index.size(), 0.0L);
  for (int n = 0; n < index.size(); ++n) {
    // The blossom of the argument's values: halves first, then zeros and ones only select.
    int ones = 0, halves = 0;
    for (int c = 0; c <= dimension; ++c) {
      if (ends[c] == 1) ones += index.exponents(n)[c];
      if (ends[c] == 0.5) halves += index.exponents(n)[c];
    }
    Coefficients b = line.b;
    for (int step = 0; step < halves; ++step) {
      for (std::size_t o = 0; o + 1 < b.size(); ++o) b[o] = 0.5L * (b[o] + b[o + 1]);
      b.pop_back();
    }
    result.b[n] = b[ones];
  }
  return result;
}

Model barycentric(int dimension, int vertex) {
  const SimplexIndex index(dimension, 1);
  Model result{1, Coefficients(index.size(), 0.0L), 1, 1, 0, 0};
  SimplexIndex::Exponents e{};
  e[vertex] = 1;
  result.b[index.find(e)] = 1;
  return result;
}

/// V_vertex,j
Model vertex_function(int dimension, Basis basis, int vertex, int j, int degree) {
  const Model l = barycentric(dimension, vertex);
  if (j == 0) return l;
  std::array<double, 4> ends{};
  ends[vertex] = 1;
  return product(dimension, l, composed(dimension, kernel_model(basis, j, degree), ends));
}

/// E_ab,i
Model edge_function(int dimension, Basis basis, int a, int b, int i, int degree) {
  Model both = product(dimension, barycentric(dimension, a), barycentric(dimension, b));
  both.value_bound = 0.25;
  both.gradient_bound = 1;
  std::array<double, 4> ends{0.5, 0.5, 0.5, 0.5};
  ends[a] = 0;
  ends[b] = 1;
  return product(dimension, both, composed(dimension, kernel_model(basis, i, degree), ends));
}

int model_degree(CellKind kind, Basis basis, int order) {
  if (basis == Basis::legendre || order == 1) return std::max(order, kind == CellKind::tet ? 3 : 2);
  return order <= 2 ? 10 : order <= 4 ? 14 : 18;
}

}  // namespace

SimplexIndex::SimplexIndex(int dimension, int degree)
    : dimension_(dimension), degree_(degree), numbers_((degree + 1) * (degree + 1) * (degree + 1), -1) {
  const int deepest = dimension == 3 ? degree : 0;
  for (int e3 = 0; e3 <= deepest; ++e3)
    for (int e2 = 0; e2 + e3 <= degree; ++e2)
      for (int e1 = 0; e1 + e2 + e3 <= degree; ++e1) {
        const auto narrow = [](int e) { return static_cast<std::int8_t>(e); };
        numbers_[(e3 * (degree + 1) + e2) * (degree + 1) + e1] = size();
        exponents_.push_back({narrow(degree - e1 - e2 - e3), narrow(e1), narrow(e2), narrow(e3)});
      }
}

int SimplexIndex::find(const Exponents& e) const {
  return numbers_[(e[3] * (degree_ + 1) + e[2]) * (degree_ + 1) + e[1]];
}

const SimplexModels& SimplexModels::get(CellKind kind, Basis basis, int order) {
  assert(kind != CellKind::hex && order >= 1 && order <= kMaxOrder);
  static std::array<std::array<std::array<std::unique_ptr<const SimplexModels>, kMaxOrder + 1>, 2>, 2> models;
  static std::array<std::array<std::array<std::once_flag, kMaxOrder + 1>, 2>, 2> made;
  const auto k = static_cast<std::size_t>(kind), b = static_cast<std::size_t>(basis);
  std::call_once(made[k][b][order], [&] { models[k][b][order].reset(new SimplexModels(kind, basis, order)); });
  return *models[k][b][order];
}

SimplexModels::SimplexModels(CellKind kind, Basis basis, int order)
    : kind_(kind), index_(kind == CellKind::tet ? 3 : 2, model_degree(kind, basis, order)) {
  const int dimension = index_.dimension(), degree = index_.degree(), n = order - 1;
  const bool exact = basis == Basis::legendre;
  const auto keep = [&](LocalMode mode, const Model& model) {
    const int missing = degree - model.degree;
    assert(missing >= 0);
    const Coefficients ones(SimplexIndex(dimension, missing).size(), 1.0L);
    const Coefficients raised = product(dimension, model.degree, model.b, missing, ones);
    Function f{model.value_bound, model.gradient_bound, model.error, model.gradient_error, 0, {}};
    for (const long double b : raised) {
      f.coefficients.push_back(static_cast<double>(b));
      f.largest_coefficient = std::max(f.largest_coefficient, std::abs(f.coefficients.back()));
    }
    functions_.emplace(mode, std::move(f));
  };
  for (int v = 0; v <= dimension; ++v) {
    LocalMode mode;
    mode.vertex = static_cast<std::int8_t>(v);
    keep(mode, barycentric(dimension, v));
  }
  const CellTopology& topology = cell_topology(kind);
  const int num_edges = dimension == 3 ? 6 : 3;
  for (int e = 0; e < num_edges; ++e) {
    const int a = topology.edges[e][0], b = topology.edges[e][1];
    for (int i = 1; i <= n; ++i) {
      LocalMode mode;
      mode.edge = static_cast<std::int8_t>(e);
      mode.i = static_cast<std::uint8_t>(i);
      keep(mode, edge_function(dimension, basis, a, b, i, exact ? i - 1 : degree - 2));
      for (int v = 0; v <= dimension; ++v) {
        if (v == a || v == b) continue;
        for (int j = 1; i + j <= n; ++j) {
          mode.vertex = static_cast<std::int8_t>(v);
          mode.j = static_cast<std::uint8_t>(j);
          mode.k = 0;
          const int by_edge = exact ? i - 1 : (degree - 3) * i / (i + j);
          keep(mode, product(dimension, edge_function(dimension, basis, a, b, i, by_edge),
                             vertex_function(dimension, basis, v, j, exact ? j - 1 : degree - 3 - by_edge)));
          if (dimension < 3 || e != 0 || v != 2) continue;
          for (int k = 1; i + j + k <= n; ++k) {
            mode.k = static_cast<std::uint8_t>(k);
            const int edge_part = exact ? i - 1 : (degree - 4) * i / (i + j + k);
            const int vertex_part = exact ? j - 1 : (degree - 4) * j / (i + j + k);
            const Model face = product(dimension, edge_function(dimension, basis, a, b, i, edge_part),
                                       vertex_function(dimension, basis, v, j, vertex_part));
            keep(mode, product(dimension, face,
                               vertex_function(dimension, basis, 3, k,
                                               exact ? k - 1 : degree - 4 - edge_part - vertex_part)));
          }
        }
      }
    }
  }
}

const SimplexModels::Function& SimplexModels::function(LocalMode mode) const {
  if (kind_ == CellKind::prism) mode.k = 0;
  return functions_.at(mode);
}

}  // namespace subvol
