// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/simplex_models.h"

#include "fit/wide.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <mutex>

namespace subvol {

namespace {

constexpr long double kPi = std::numbers::pi_v<long double>, kSqrt2 = std::numbers::sqrt2_v<long double>;

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

/// What the terms of a sum of products of Chebyshev polynomials add to value and gradient at most, by their total
/// degree. What no polynomial stands for counts as of a degree beyond all that are kept.
///
/// |T_k'(t)| <= k^2 for the gradient, and |T_k'(t)| sqrt(1 - t^2) <= k for the damped one.
struct Sizes {
  std::vector<double> value{1}, gradient{0}, damped{0};

  Sizes operator*(const Sizes& other) const {
    Sizes result;
    result.value.assign(value.size() + other.value.size() - 1, 0);
    result.gradient = result.damped = result.value;
    for (std::size_t k = 0; k < value.size(); ++k)
      for (std::size_t l = 0; l < other.value.size(); ++l) {
        result.value[k + l] += value[k] * other.value[l];
        result.gradient[k + l] += gradient[k] * other.value[l] + value[k] * other.gradient[l];
        result.damped[k + l] += damped[k] * other.value[l] + value[k] * other.damped[l];
      }
    return result;
  }
  static double beyond(const std::vector<double>& sizes, int degree) {
    double sum = 0;
    for (std::size_t k = degree + 1; k < sizes.size(); ++k) sum += sizes[k];
    return sum * (1 + 1e-12);
  }
};

/// psi_i over an interval: sum_k coefficients_k T_k, and the sizes of its terms and of its error.
struct KernelExpansion {
  std::vector<double> coefficients;
  Sizes sizes;
};

/// |psi_i^(n)| <= 2 sqrt2 (i pi)^n / (n + 1) for fourier: psi_i = phi_i / x + phi_i / (1 - x), each a mean of cosines.
KernelExpansion expand_kernel(Basis basis, int i, long double low, long double high,
                              const ChebyshevExpansion& expansion) {
  const int num_slopes = expansion.num_nodes();
  const long double middle = 0.5L * (low + high), radius = 0.5L * (high - low);
  const bool exact = basis == Basis::legendre;
  const double log_bound = exact ? -std::numeric_limits<double>::infinity()
                                 : 1.5 * std::numbers::ln2 + (num_slopes + 1) * std::log(i * std::numbers::pi);
  std::vector<long double> slopes(num_slopes + 2, 0.0L);
  const auto slope_at = [&](long double x) {
    long double value, slope;
    kernel(basis, i, x, value, slope);
    return slope;
  };
  const double remainder = expansion.expand(slope_at, middle, radius, log_bound, num_slopes, slopes.data());
  // The integral of sum s_k T_k: terms radius (s_{k-1} - s_{k+1}) / 2k, of which s_0 counts twice.
  slopes[0] *= 2;
  const int last = exact ? i - 1 : num_slopes;
  long double at_middle, slope, model_at_middle = 0;
  kernel(basis, i, middle, at_middle, slope);
  KernelExpansion result;
  result.coefficients.assign(last + 1, 0);
  result.sizes.value.assign(last + 1, 0);
  result.sizes.gradient = result.sizes.damped = result.sizes.value;
  for (int k = 1; k <= last; ++k) {
    const long double c = radius * (slopes[k - 1] - slopes[k + 1]) / (2 * k);
    result.coefficients[k] = static_cast<double>(c);
    if (k % 2 == 0) model_at_middle += k % 4 == 0 ? c : -c;
    result.sizes.value[k] = static_cast<double>(std::abs(c));
    result.sizes.gradient[k] = static_cast<double>(std::abs(c) * k * k / radius);
    result.sizes.damped[k] = static_cast<double>(std::abs(c) * k / radius);
  }
  result.coefficients[0] = static_cast<double>(at_middle - model_at_middle);
  result.sizes.value[0] = std::abs(result.coefficients[0]);
  if (!exact) {
    result.sizes.value.push_back(static_cast<double>(radius) * remainder);
    result.sizes.gradient.push_back(remainder);
    result.sizes.damped.push_back(remainder);
  }
  return result;
}

/// Bounds of |psi_i| and |psi_i'| over [0, 1].
double kernel_bound(Basis basis, int i) {
  return (1 + 1e-14) * (basis == Basis::legendre ? std::sqrt(2 * i + 1.0) : 2 * std::numbers::sqrt2);
}
double kernel_slope_bound(Basis basis, int i) {
  return (1 + 1e-14) * (basis == Basis::legendre ? 2.0 * i * i * std::sqrt(2 * i + 1.0)
                                                 : std::numbers::sqrt2 * i * std::numbers::pi);
}

/// Values of an affine function at the vertices of a part.
using Ends = std::array<double, 4>;

/// A product of kernels: polynomials, its own cut behind all total degrees from 0 on, and what they leave out.
struct KernelProduct {
  std::vector<SimplexPolynomial> cut;  // at degree n, of that degree
  Sizes sizes;
  double bound = 1, slope_bound = 0;   // of the product itself
};

constexpr std::size_t kMostStoredBytes = 300'000'000;  // of coefficients, per kind, basis and order

/// Times that all sides are halved before the last models are made, at most: parts are numbered in 32 bits.
int most_depth(Basis basis, int order) { return basis == Basis::legendre || order == 1 ? 0 : 10; }

/// A degree more than needed brings control points much closer to the map. Fourier: those with which most cells of
/// fitted meshes are decided at once up to order 4, over parts of half the size above (measured).
int model_degree(Basis basis, int order) {
  return basis == Basis::legendre || order == 1 ? std::max(order + 1, 3) : std::min((5 * order + 2) / 2, order + 13);
}

int num_nodes(Basis basis, int order) {
  return basis == Basis::legendre ? order : model_degree(basis, order) + order + 4;
}

}  // namespace

/// The kernels' expansions over one part.
class SimplexModels::Kernels {
 public:
  /// barycentric: of the whole simplex, at the part's vertices.
  Kernels(const SimplexModels& models, const std::array<Ends, 4>& barycentric)
      : models_(models), dimension_(models.index_.dimension()), most_(std::max(0, models.index_.degree() - 2)) {
    for (int v = 0; v <= dimension_; ++v) at_vertices_.push_back(argument(barycentric[v]));
    for (const auto& [a, b] : cell_topology(models.kind_).edges) {
      if (static_cast<int>(at_edges_.size()) == (dimension_ == 3 ? 6 : 3)) break;
      Ends along{};
      for (std::size_t c = 0; c < 4; ++c) along[c] = 0.5 * (1 + barycentric[b][c] - barycentric[a][c]);
      at_edges_.push_back(argument(along));
    }
    one_.cut.assign(1, SimplexPolynomial(dimension_, 1));
    for (int n = 1; n <= most_; ++n) one_.cut.push_back(one_.cut.back().raised());
  }

  /// The kernels of a mode, cut behind one total degree.
  KernelProduct product(const LocalMode& mode, int degree) {
    const KernelProduct* rest = &one_;
    if (mode.k > 0) rest = &at_vertex(3, mode.k, one_, last_[mode.k]);
    if (mode.j > 0) rest = &at_vertex(mode.vertex, mode.j, *rest, pairs_[{mode.vertex, mode.j, mode.k}]);
    return times(at_edges_[mode.edge], mode.i, *rest, degree, degree);
  }

 private:
  struct Argument {
    std::pair<double, double> interval;
    std::vector<SimplexPolynomial> chebyshev;  // T_k of it
  };

  Argument argument(const Ends& ends) const {
    const auto last = ends.begin() + dimension_ + 1;
    const double low = *std::min_element(ends.begin(), last), high = *std::max_element(ends.begin(), last);
    Ends scaled{};
    for (int c = 0; c <= dimension_; ++c) scaled[c] = (2 * ends[c] - low - high) / (high - low);
    std::vector<SimplexPolynomial> t{SimplexPolynomial(dimension_, 1)};
    for (int k = 1; k <= most_; ++k) {
      SimplexPolynomial next = t[k - 1].times_affine(scaled);
      t.push_back(k == 1 ? std::move(next) : SimplexPolynomial::combined(2, next, -1, t[k - 2].raised().raised()));
    }
    return {{low, high}, std::move(t)};
  }

  const KernelExpansion& expansion(const Argument& x, int i) {
    auto [found, is_new] = expansions_.try_emplace({x.interval.first, x.interval.second, i});
    if (is_new)
      found->second = expand_kernel(models_.basis_, i, x.interval.first, x.interval.second, models_.expansion_);
    return found->second;
  }

  KernelProduct times(const Argument& x, int i, const KernelProduct& rest, int first, int last) {
    const KernelExpansion& own = expansion(x, i);
    KernelProduct result;
    for (int n = first; n <= last; ++n)
      result.cut.push_back(SimplexPolynomial::convolved(own.coefficients, x.chebyshev, rest.cut, n));
    result.sizes = own.sizes * rest.sizes;
    const double bound = kernel_bound(models_.basis_, i), slope = kernel_slope_bound(models_.basis_, i);
    result.bound = bound * rest.bound;
    result.slope_bound = slope * rest.bound + bound * rest.slope_bound;
    return result;
  }

  const KernelProduct& at_vertex(int vertex, int j, const KernelProduct& rest, KernelProduct& kept) {
    if (kept.cut.empty()) kept = times(at_vertices_[vertex], j, rest, 0, most_);
    return kept;
  }

  const SimplexModels& models_;
  int dimension_, most_;
  std::vector<Argument> at_vertices_, at_edges_;
  KernelProduct one_;
  std::map<std::tuple<double, double, int>, KernelExpansion> expansions_;
  std::map<int, KernelProduct> last_;                          // V_3,k
  std::map<std::array<int, 3>, KernelProduct> pairs_;          // V_vertex,j V_3,k
};

const SimplexModels& SimplexModels::get(CellKind kind, Basis basis, int order) {
  assert(kind != CellKind::hex && order >= 1 && order <= kMaxOrder);
  static std::array<std::array<std::array<std::unique_ptr<const SimplexModels>, kMaxOrder + 1>, 2>, 2> models;
  static std::array<std::array<std::array<std::once_flag, kMaxOrder + 1>, 2>, 2> made;
  const auto k = static_cast<std::size_t>(kind), b = static_cast<std::size_t>(basis);
  std::call_once(made[k][b][order], [&] { models[k][b][order].reset(new SimplexModels(kind, basis, order)); });
  return *models[k][b][order];
}

SimplexModels::SimplexModels(CellKind kind, Basis basis, int order)
    : kind_(kind), basis_(basis), order_(order),
      index_(kind == CellKind::tet ? 3 : 2, model_degree(basis, order)),
      stride_((index_.size() + kWide - 1) / kWide * kWide),
      most_halvings_(most_depth(basis, order) * halvings_between()),
      expansion_(num_nodes(basis, order)) {
  const int num_vertices = index_.dimension() + 1, num_edges = kind == CellKind::tet ? 6 : 3, n = order - 1;
  const auto add = [&](int edge, int i, int vertex, int j, int k) {
    LocalMode mode;
    mode.edge = static_cast<std::int8_t>(edge);
    mode.vertex = static_cast<std::int8_t>(vertex);
    mode.i = static_cast<std::uint8_t>(i);
    mode.j = static_cast<std::uint8_t>(j);
    mode.k = static_cast<std::uint8_t>(k);
    const std::size_t address = slot_address(mode);
    if (slots_.size() <= address) slots_.resize(address + 1, -1);
    slots_[address] = static_cast<int>(modes_.size());
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

std::size_t SimplexModels::slot_address(const LocalMode& mode) const {
  const auto n = static_cast<std::size_t>(order_);
  const std::size_t k = kind_ == CellKind::tet ? mode.k : 0;
  return ((((mode.edge + 1) * 5 + mode.vertex + 1) * n + mode.i) * n + mode.j) * n + k;
}

std::shared_ptr<const SimplexModels::Part> SimplexModels::part(std::uint32_t number,
                                                               std::span<const Vec3> vertices) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = stored_.find(number); found != stored_.end()) return found->second;
  }
  auto made = std::make_shared<const Part>(make_part(number, vertices));
  const std::lock_guard lock(mutex_);
  if ((stored_.size() + 1) * modes_.size() * stride_ * sizeof(double) <= kMostStoredBytes)
    stored_.emplace(number, made);
  return made;
}

SimplexModels::Part SimplexModels::make_part(std::uint32_t number, std::span<const Vec3> vertices) const {
  const int degree = index_.degree(), dimension = index_.dimension();
  std::array<Ends, 4> barycentric{};  // exact: vertices of parts are multiples of a power of 1/2
  for (int c = 0; c <= dimension; ++c) {
    const Vec3& x = vertices[c];
    barycentric[0][c] = 1 - x[0] - x[1] - x[2];
    for (int v = 1; v <= dimension; ++v) barycentric[v][c] = x[v - 1];
  }
  // Over the whole simplex, products of two, three, four coordinates are at most so many times sqrt(1 - t^2), with t
  // in [-1, 1] what T_k is taken of: twice a coordinate less 1, or the difference of two.
  constexpr double kDamping[] = {0, 0, 1.0 / 4, 1.0 / 16, 1.0 / 108};
  const bool whole = number == 1;
  Kernels kernels(*this, barycentric);
  Part part;
  part.coefficients.assign(modes_.size() * stride_, 0);
  for (const LocalMode& mode : modes_) {
    std::vector<int> bubble;  // vertices of the barycentric coordinates
    if (mode.edge >= 0) {
      const auto [a, b] = cell_topology(kind_).edges[mode.edge];
      bubble = {a, b};
    }
    if (mode.vertex >= 0) bubble.push_back(mode.vertex);
    if (mode.k > 0) bubble.push_back(3);
    const int size = static_cast<int>(bubble.size());

    SimplexPolynomial product(dimension, 1), bubble_alone(dimension, 1);
    Function f{1, 1, 0, 0, 0, 0};
    int missing = degree - size;
    if (mode.edge >= 0) {
      for (const int v : bubble) bubble_alone = bubble_alone.times_affine(barycentric[v]);
      // The product of n coordinates is at most (1/n)^n, what is left of it when one is taken away bounds its gradient.
      const double largest = std::min(bubble_alone.bound(), (1 + 1e-12) * std::pow(1.0 / size, size));
      const double steepest = (1 + 1e-12) * std::pow(1.0 / (size - 1), size - 1);
      KernelProduct model = kernels.product(mode, missing);
      product = std::move(model.cut[0]);
      const double error = Sizes::beyond(model.sizes.value, missing);
      f.value_bound = largest * model.bound;
      f.gradient_bound = steepest * model.bound + largest * model.slope_bound;
      f.error = largest * error;
      double of_kernels = largest * Sizes::beyond(model.sizes.gradient, missing);
      if (whole) of_kernels = std::min(of_kernels, kDamping[size] * Sizes::beyond(model.sizes.damped, missing));
      f.gradient_error = steepest * error + of_kernels;
      missing = 0;
    }
    for (const int v : bubble) product = product.times_affine(barycentric[v]);
    for (; missing > 0; --missing) product = product.raised();
    f.largest_coefficient = product.bound();
    f.rounding = product.rounding();
    product.bernstein(part.coefficients.data() + part.functions.size() * stride_);
    part.functions.push_back(f);
  }
  return part;
}

}  // namespace subvol
