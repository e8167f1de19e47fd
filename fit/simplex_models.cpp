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

/// sin(z) / z and its derivative, z >= 0.
void sinc(long double z, long double& value, long double& slope) {
  if (z > 1) {
    value = std::sin(z) / z;
    slope = (std::cos(z) - value) / z;
    return;
  }
  value = 1;
  slope = 0;
  long double term = 1;  // (-1)^n z^(2n-1) / (2n+1)!, times z once more for the value
  for (int n = 1; n <= 12; ++n) {
    term *= n == 1 ? -z / 6 : -z * z / (2 * n * (2 * n + 1));
    value += term * z;
    slope += 2 * n * term;
  }
}

/// psi_i and its derivative in [0, 1/2].
void kernel_below_half(Basis basis, int i, long double x, long double& value, long double& slope) {
  if (basis == Basis::fourier) {  // sqrt2 sinc(i pi x) / (1 - x)
    sinc(i * kPi * x, value, slope);
    slope = kSqrt2 * (slope * i * kPi + value / (1 - x)) / (1 - x);
    value *= kSqrt2 / (1 - x);
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

/// psi_i over [low, high] by a polynomial of a degree, in the Bernstein polynomials of that interval.
///
/// |psi_i^(n)| <= 2 sqrt2 (i pi)^n / (n + 1) for fourier: psi_i = phi_i / x + phi_i / (1 - x), each a mean of cosines.
Model kernel_model(Basis basis, int i, long double low, long double high, int degree) {
  const bool exact = basis == Basis::legendre;
  assert(!exact || degree >= i - 1);
  const double frequency = i * std::numbers::pi;
  const long double middle = 0.5L * (low + high), radius = 0.5L * (high - low);
  Model model{degree, Coefficients(degree + 1, 0.0L), exact ? std::sqrt(2 * i + 1.0) : 2 * std::numbers::sqrt2,
              exact ? 2.0 * i * i * std::sqrt(2 * i + 1.0) : std::numbers::sqrt2 * frequency, 0, 0};
  model.value_bound *= 1 + 1e-14;
  model.gradient_bound *= 1 + 1e-14;
  long double at_middle, slope;
  kernel(basis, i, middle, at_middle, slope);
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
        middle, radius, log_bound, degree, expanded.data());
    if (exact || remainder < model.gradient_bound) {
      if (!exact) model.gradient_error = remainder;
      const auto to_bernstein = chebyshev_to_bernstein(degree - 1);
      for (int k = 0; k < degree; ++k)
        for (int o = 0; o < degree; ++o) slopes[o] += expanded[k] * to_bernstein[k][o];
      for (int o = 0; o < degree; ++o) model.b[o + 1] = model.b[o] + 2 * radius * slopes[o] / degree;
    }
  }
  long double model_at_middle = 0, binomial = 1;
  for (int o = 0; o <= degree; ++o) {
    model_at_middle += std::ldexp(binomial * model.b[o], -degree);
    binomial = binomial * (degree - o) / (o + 1);
  }
  for (long double& b : model.b) b += at_middle - model_at_middle;
  model.error = static_cast<double>(radius) * model.gradient_error;
  return model;
}

std::vector<long double> multinomials(const SimplexIndex& index) {
  std::vector<long double> result;
  for (int m = 0; m < index.size(); ++m) {
    long double& value = result.emplace_back(1.0L);
    int n = 0;
    for (const int exponent : index.exponents(m))
      for (int k = 1; k <= exponent; ++k) value = value * ++n / k;
  }
  return result;
}

/// Bernstein polynomials of all degrees up to one over simplices of a dimension, and what their products need.
class Bernstein {
 public:
  Bernstein(int dimension, int degree) : dimension_(dimension) {
    for (int d = 0; d <= degree; ++d) {
      indices_.emplace_back(dimension, d);
      multinomials_.push_back(multinomials(indices_.back()));
    }
  }
  int dimension() const { return dimension_; }
  const SimplexIndex& index(int degree) const { return indices_[degree]; }

  Coefficients product(int degree_a, const Coefficients& a, int degree_b, const Coefficients& b) const {
    const SimplexIndex &index_a = indices_[degree_a], &index_b = indices_[degree_b],
                       &index = indices_[degree_a + degree_b];
    Coefficients weighted_b(b), result(index.size(), 0.0L);
    std::vector<int> address_b(index_b.size());
    for (int n = 0; n < index_b.size(); ++n) {
      weighted_b[n] *= multinomials_[degree_b][n];
      address_b[n] = index.address(index_b.exponents(n));
    }
    for (int m = 0; m < index_a.size(); ++m) {
      if (a[m] == 0) continue;
      const long double weight = a[m] * multinomials_[degree_a][m];
      const int address = index.address(index_a.exponents(m));
      for (int n = 0; n < index_b.size(); ++n) result[index.at(address + address_b[n])] += weight * weighted_b[n];
    }
    for (int n = 0; n < index.size(); ++n) result[n] /= multinomials_[degree_a + degree_b][n];
    return result;
  }

  Model product(const Model& f, const Model& g) const {
    const double fp = f.value_bound + f.error, gp = g.value_bound + g.error;
    return {f.degree + g.degree,
            product(f.degree, f.b, g.degree, g.b),
            f.value_bound * g.value_bound,
            f.gradient_bound * g.value_bound + f.value_bound * g.gradient_bound,
            f.value_bound * g.error + f.error * gp,
            f.gradient_bound * g.error + f.gradient_error * gp + g.gradient_bound * f.error + g.gradient_error * fp};
  }

 private:
  int dimension_;
  std::vector<SimplexIndex> indices_;                     // by degree
  std::vector<std::vector<long double>> multinomials_;
};

/// Values of an affine function at the vertices of a part.
using Ends = std::array<long double, 4>;

/// Models of the factors of functions over one part of a simplex.
class Factors {
 public:
  /// vertices: of the part, in barycentric coordinates of the whole.
  Factors(const Bernstein& bernstein, Basis basis, const std::array<Ends, 4>& barycentric)
      : bernstein_(bernstein), basis_(basis), barycentric_(barycentric) {}

  /// l_vertex
  Model barycentric(int vertex) const { return affine(barycentric_[vertex]); }

  /// V_vertex,j
  Model at_vertex(int vertex, int j, int degree) const {
    const Model l = barycentric(vertex);
    return j == 0 ? l : bernstein_.product(l, kernel(j, barycentric_[vertex], degree));
  }

  /// E_ab,i
  Model at_edge(int a, int b, int i, int degree) const {
    Model both = bernstein_.product(barycentric(a), barycentric(b));
    both.value_bound = 0.25;
    both.gradient_bound = 1;
    Ends argument{};
    for (std::size_t c = 0; c < 4; ++c) argument[c] = 0.5L * (1 + barycentric_[b][c] - barycentric_[a][c]);
    return bernstein_.product(both, kernel(i, argument, degree));
  }

 private:
  Model affine(const Ends& ends) const {
    const SimplexIndex& index = bernstein_.index(1);
    Model result{1, Coefficients(index.size(), 0.0L), 1, 1, 0, 0};
    for (int c = 0; c <= bernstein_.dimension(); ++c) {
      SimplexIndex::Exponents e{};
      e[c] = 1;
      result.b[index.find(e)] = ends[c];
    }
    return result;
  }

  /// psi_i of an affine argument, by the blossom of its model at the argument's values.
  Model kernel(int i, const Ends& argument, int degree) const {
    const auto last = argument.begin() + bernstein_.dimension() + 1;
    const long double low = *std::min_element(argument.begin(), last), high = *std::max_element(argument.begin(), last);
    Model result = kernel_model(basis_, i, low, high, degree);
    const SimplexIndex& index = bernstein_.index(degree);
    const Coefficients line = std::move(result.b);
    result.b.assign(index.size(), 0.0L);
    Coefficients b;
    for (int n = 0; n < index.size(); ++n) {
      b = line;
      for (int c = 0; c <= bernstein_.dimension(); ++c) {
        const long double t = high > low ? (argument[c] - low) / (high - low) : 0.0L;
        for (int step = 0; step < index.exponents(n)[c]; ++step) {
          for (std::size_t o = 0; o + 1 < b.size(); ++o) b[o] += t * (b[o + 1] - b[o]);
          b.pop_back();
        }
      }
      result.b[n] = b[0];
    }
    return result;
  }

  const Bernstein& bernstein_;
  Basis basis_;
  const std::array<Ends, 4>& barycentric_;
};

constexpr std::size_t kMostStoredBytes = 300'000'000;  // of coefficients, per kind, basis and order

/// Times that all sides are halved before models are made: as often as the border of validity asks for at low orders,
/// as often as is bearable where making them takes a quarter of a second.
int most_depth(CellKind kind, Basis basis, int order) {
  if (basis == Basis::legendre || order == 1) return 0;
  if (kind == CellKind::prism) return order <= 4 ? 8 : 4;
  return order <= 4 ? 6 : order <= 8 ? 2 : 1;
}

/// Shares degrees among kernels psi_f of the frequencies given (0: none) so that none is left with a much larger error:
/// each goes to the one with the largest (f pi r / 2)^n / n!, n = degree + 1, r a usual radius of a part.
std::array<int, 3> shared_degrees(const std::array<int, 3>& frequencies, int total) {
  constexpr double kRadius = 0.25;
  std::array<int, 3> degrees{};
  std::array<double, 3> errors{};
  for (std::size_t f = 0; f < 3; ++f) errors[f] = frequencies[f] * std::numbers::pi * kRadius / 2;
  for (; total > 0; --total) {
    const auto f = static_cast<std::size_t>(std::max_element(errors.begin(), errors.end()) - errors.begin());
    ++degrees[f];
    errors[f] *= frequencies[f] * std::numbers::pi * kRadius / 2 / (degrees[f] + 1);
  }
  return degrees;
}

int model_degree(CellKind kind, Basis basis, int order) {
  if (basis == Basis::legendre || order == 1) return std::max(order, kind == CellKind::tet ? 3 : 2);
  return order <= 2 ? 8 : order <= 4 ? 14 : 18;
}

}  // namespace

SimplexIndex::SimplexIndex(int dimension, int degree)
    : dimension_(dimension), degree_(degree), numbers_((degree + 1) * (degree + 1) * (degree + 1), -1) {
  const int deepest = dimension == 3 ? degree : 0;
  for (int e3 = 0; e3 <= deepest; ++e3)
    for (int e2 = 0; e2 + e3 <= degree; ++e2)
      for (int e1 = 0; e1 + e2 + e3 <= degree; ++e1) {
        const auto narrow = [](int e) { return static_cast<std::int8_t>(e); };
        exponents_.push_back({narrow(degree - e1 - e2 - e3), narrow(e1), narrow(e2), narrow(e3)});
        numbers_[address(exponents_.back())] = size() - 1;
      }
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
    : kind_(kind), basis_(basis), index_(kind == CellKind::tet ? 3 : 2, model_degree(kind, basis, order)),
      most_halvings_(most_depth(kind, basis, order) * halvings_between()) {
  const int num_vertices = index_.dimension() + 1, num_edges = kind == CellKind::tet ? 6 : 3, n = order - 1;
  const auto add = [&](int edge, int i, int vertex, int j, int k) {
    LocalMode mode;
    mode.edge = static_cast<std::int8_t>(edge);
    mode.vertex = static_cast<std::int8_t>(vertex);
    mode.i = static_cast<std::uint8_t>(i);
    mode.j = static_cast<std::uint8_t>(j);
    mode.k = static_cast<std::uint8_t>(k);
    slots_.emplace(mode, modes_.size());
    modes_.push_back(mode);
  };
  for (int v = 0; v < num_vertices; ++v) add(-1, 0, v, 0, 0);
  for (int e = 0; e < num_edges; ++e) {
    const auto [a, b] = cell_topology(kind).edges[e];
    for (int i = 1; i <= n; ++i) {
      add(e, i, -1, 0, 0);
      for (int v = 0; v < num_vertices; ++v)
        for (int j = 1; v != a && v != b && i + j <= n; ++j) {
          add(e, i, v, j, 0);
          const bool interior = kind == CellKind::tet && e == 0 && v == 2;
          for (int k = 1; interior && i + j + k <= n; ++k) add(e, i, v, j, k);
        }
    }
  }
}

std::shared_ptr<const SimplexModels::Part> SimplexModels::part(std::uint32_t number,
                                                               std::span<const Vec3> vertices) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = stored_.find(number); found != stored_.end()) return found->second;
  }
  auto made = std::make_shared<const Part>(make_part(vertices));
  const std::lock_guard lock(mutex_);
  if ((stored_.size() + 1) * modes_.size() * index_.size() * sizeof(double) <= kMostStoredBytes)
    stored_.emplace(number, made);
  return made;
}

SimplexModels::Part SimplexModels::make_part(std::span<const Vec3> vertices) const {
  const int degree = index_.degree();
  const Bernstein bernstein(index_.dimension(), degree);
  std::array<Ends, 4> barycentric{};
  for (int c = 0; c <= index_.dimension(); ++c) {
    const Vec3& x = vertices[c];
    barycentric[0][c] = 1.0L - x[0] - x[1] - x[2];
    for (int v = 1; v <= index_.dimension(); ++v) barycentric[v][c] = x[v - 1];
  }
  const Factors factors(bernstein, basis_, barycentric);
  const bool exact = basis_ == Basis::legendre;
  Part part;
  for (const LocalMode& mode : modes_) {
    const int i = mode.i, j = mode.j, k = mode.k;
    Model model;
    if (mode.edge < 0) {
      model = factors.barycentric(mode.vertex);
    } else {
      const auto [by_edge, by_vertex, by_last] =
          exact ? std::array{i - 1, j - 1, k - 1} : shared_degrees({i, j, k}, degree - 2 - (j > 0) - (k > 0));
      const auto [a, b] = cell_topology(kind_).edges[mode.edge];
      model = factors.at_edge(a, b, i, by_edge);
      if (j > 0)
        model = bernstein.product(model, factors.at_vertex(mode.vertex, j, by_vertex));
      if (k > 0) model = bernstein.product(model, factors.at_vertex(3, k, by_last));
    }
    const int missing = degree - model.degree;
    assert(missing >= 0);
    const Coefficients ones(bernstein.index(missing).size(), 1.0L);
    Function f{model.value_bound, model.gradient_bound, model.error, model.gradient_error, 0, {}};
    for (const long double b : bernstein.product(model.degree, model.b, missing, ones)) {
      f.coefficients.push_back(static_cast<double>(b));
      f.largest_coefficient = std::max(f.largest_coefficient, std::abs(f.coefficients.back()));
    }
    part.push_back(std::move(f));
  }
  return part;
}

std::size_t SimplexModels::slot(LocalMode mode) const {
  if (kind_ == CellKind::prism) mode.k = 0;
  return slots_.at(mode);
}

}  // namespace subvol
