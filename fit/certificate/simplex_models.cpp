// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/simplex_models.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <mutex>

namespace subvol::internal {

namespace {

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

/// psi_i and its derivative for x in [0, 1/2].
void kernel_below_half(Basis basis, int i, long double x, long double& value, long double& slope) {
  if (basis == Basis::fourier) {  // sqrt2 sinc(i pi x) / (1 - x)
    constexpr long double pi = std::numbers::pi_v<long double>, sqrt2 = std::numbers::sqrt2_v<long double>;
    sinc(i * pi * x, value, slope);
    slope = sqrt2 * (slope * i * pi + value / (1 - x)) / (1 - x);
    value *= sqrt2 / (1 - x);
    return;
  }
  // psi_i = 2 sqrt(2i+1) / (i (i+1)) P_i'(1 - 2x); P_{n+1}' = P_{n-1}' + (2n+1) P_n, and likewise for P''.
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

/// Bounds on what the terms of a sum of products of Chebyshev polynomials contribute to value and gradient, by their
/// total degree. Errors, which no polynomial represents, count as a degree beyond all that are kept.
///
/// |T_k'(t)| <= k^2 for the gradient, and |T_k'(t)| sqrt(1 - t^2) <= k for the damped gradient.
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
  // The integral of sum s_k T_k has the terms radius (s_{k-1} - s_{k+1}) / 2k, where s_0 counts twice.
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

/// Bounds on |psi_i| and |psi_i'| over [0, 1].
double kernel_bound(Basis basis, int i) {
  return (1 + 1e-14) * (basis == Basis::legendre ? std::sqrt(2 * i + 1.0) : 2 * std::numbers::sqrt2);
}
double kernel_slope_bound(Basis basis, int i) {
  return (1 + 1e-14) *
         (basis == Basis::legendre ? 2.0 * i * i * std::sqrt(2 * i + 1.0) : std::numbers::sqrt2 * i * std::numbers::pi);
}

/// Values of an affine function at the vertices of a part.
using Ends = std::array<double, 4>;
using Interval = std::pair<double, double>;

Interval range(const Ends& ends, int dimension) {
  const auto last = ends.begin() + dimension + 1;
  return {*std::min_element(ends.begin(), last), *std::max_element(ends.begin(), last)};
}

/// Argument of the kernel of E_edge,i, from the barycentric coordinates of the edge's ends.
Ends along_edge(const Ends& a, const Ends& b) {
  Ends along{};
  for (std::size_t c = 0; c < 4; ++c) along[c] = 0.5 * (1 + b[c] - a[c]);
  return along;
}

/// Barycentric coordinates of the whole simplex at a part's vertices: exact, as these are multiples of a power of 1/2.
std::array<Ends, 4> barycentric_at(std::span<const Vec3> vertices, int dimension) {
  std::array<Ends, 4> result{};
  for (int c = 0; c <= dimension; ++c) {
    const Vec3& x = vertices[c];
    result[0][c] = 1 - x[0] - x[1] - x[2];
    for (int v = 1; v <= dimension; ++v) result[v][c] = x[v - 1];
  }
  return result;
}

/// Sizes of the terms of a product of kernels, and bounds on the product itself.
struct ProductSizes {
  Sizes sizes;
  double bound = 1, slope_bound = 0;
};

constexpr std::size_t kMostStoredBytes = 200'000'000;  // per kind, basis and order

/// Number of times that all sides are bisected before the last models are made, at most: part numbers have 32 bits.
int most_depth(Basis basis, int order) { return basis == Basis::legendre || order == 1 ? 0 : 10; }

/// Highest degree of the tiers. One degree more than needed brings control points much closer to the map. Fourier:
/// errors of the highest functions up to order 8 are small over the whole simplex.
int highest_degree(Basis basis, int order) {
  return basis == Basis::legendre || order == 1 ? std::max(order + 1, 3)
                                                : std::min({(5 * order + 2) / 2, order + 13, 21});
}

std::vector<const SimplexTables*> make_tiers(CellKind kind, Basis basis, int order) {
  const int dimension = kind == CellKind::tet ? 3 : 2, highest = highest_degree(basis, order);
  std::vector<const SimplexTables*> tiers;
  for (const int degree : {3, 5, 7, 9, 11, 14, 17})
    if (degree < highest) tiers.push_back(&SimplexTables::get(dimension, degree));
  if (tiers.size() == SimplexModels::kMostSimplexTiers) tiers.erase(tiers.begin());
  tiers.push_back(&SimplexTables::get(dimension, highest));
  return tiers;
}

int num_nodes(Basis basis, int order) {
  return basis == Basis::legendre ? order : std::min((5 * order + 2) / 2, order + 13) + order + 4;
}

}  // namespace

/// The kernels' expansions over the intervals of one part, computed once each.
class SimplexModels::Expansions {
 public:
  explicit Expansions(const SimplexModels& models) : models_(models) {}
  const KernelExpansion& operator()(const Interval& x, int i) {
    auto [found, is_new] = known_.try_emplace({x.first, x.second, i});
    if (is_new) found->second = expand_kernel(models_.basis_, i, x.first, x.second, models_.expansion_);
    return found->second;
  }

 private:
  const SimplexModels& models_;
  std::map<std::tuple<double, double, int>, KernelExpansion> known_;
};

/// Products of the kernels' expansions over one part, for models of one degree.
class SimplexModels::Kernels {
 public:
  /// barycentric: coordinates in the whole simplex, at the part's vertices.
  Kernels(const SimplexModels& models, int degree, const std::array<Ends, 4>& barycentric)
      : expansions_(models), dimension_(models.dimension()), most_(std::max(0, degree - 2)) {
    for (int v = 0; v <= dimension_; ++v) at_vertices_.push_back(argument(barycentric[v]));
    for (const auto& [a, b] : cell_topology(models.kind_).edges) {
      if (static_cast<int>(at_edges_.size()) == (dimension_ == 3 ? 6 : 3)) break;
      at_edges_.push_back(argument(along_edge(barycentric[a], barycentric[b])));
    }
    one_.assign(1, SimplexPolynomial(dimension_, 1));
    for (int n = 1; n <= most_; ++n) one_.push_back(one_.back().raised());
  }

  /// Returns the product of a mode's kernels, truncated at a total degree.
  SimplexPolynomial product(const LocalMode& mode, int degree) {
    const Cut* rest = &one_;
    if (mode.k > 0) rest = &at_vertex(3, mode.k, one_, last_[mode.k]);
    if (mode.j > 0) rest = &at_vertex(mode.vertex, mode.j, *rest, pairs_[{mode.vertex, mode.j, mode.k}]);
    return times(at_edges_[mode.edge], mode.i, *rest, degree);
  }

 private:
  using Cut = std::vector<SimplexPolynomial>;  // truncated at all total degrees from 0 on; entry n has degree n
  struct Argument {
    Interval interval;
    Cut chebyshev;  // T_k of the argument
  };

  Argument argument(const Ends& ends) const {
    const auto [low, high] = range(ends, dimension_);
    Ends scaled{};
    for (int c = 0; c <= dimension_; ++c) scaled[c] = (2 * ends[c] - low - high) / (high - low);
    Cut t{SimplexPolynomial(dimension_, 1)};
    for (int k = 1; k <= most_; ++k) {
      SimplexPolynomial next = t[k - 1].times_affine(scaled);
      t.push_back(k == 1 ? std::move(next) : SimplexPolynomial::combined(2, next, -1, t[k - 2].raised().raised()));
    }
    return {{low, high}, std::move(t)};
  }

  SimplexPolynomial times(const Argument& x, int i, const Cut& rest, int degree) {
    return SimplexPolynomial::convolved(expansions_(x.interval, i).coefficients, x.chebyshev, rest, degree);
  }

  const Cut& at_vertex(int vertex, int j, const Cut& rest, Cut& kept) {
    for (int n = static_cast<int>(kept.size()); n <= most_; ++n)
      kept.push_back(times(at_vertices_[vertex], j, rest, n));
    return kept;
  }

  Expansions expansions_;
  int dimension_, most_;
  std::vector<Argument> at_vertices_, at_edges_;
  Cut one_;
  std::map<int, Cut> last_;                  // V_3,k
  std::map<std::array<int, 3>, Cut> pairs_;  // V_vertex,j V_3,k
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
    : kind_(kind),
      basis_(basis),
      order_(order),
      tiers_(make_tiers(kind, basis, order)),
      most_halvings_(most_depth(basis, order) * halvings_between()),
      expansion_(num_nodes(basis, order)) {
  assert(num_tiers() <= kMostSimplexTiers);
  const int num_vertices = dimension() + 1, num_edges = kind == CellKind::tet ? 6 : 3, n = order - 1;
  const auto add = [&](int edge, int i, int vertex, int j, int k) {
    LocalMode mode;
    mode.edge = static_cast<std::int8_t>(edge);
    mode.vertex = static_cast<std::int8_t>(vertex);
    mode.i = static_cast<std::uint8_t>(i);
    mode.j = static_cast<std::uint8_t>(j);
    mode.k = static_cast<std::uint8_t>(k);
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
  const auto lower = [&](const LocalMode& x, const LocalMode& y) { return own_order(x) < own_order(y); };
  std::stable_sort(modes_.begin(), modes_.end(), lower);
  for (std::size_t slot = 0; slot < modes_.size(); ++slot) {
    const std::size_t address = slot_address(modes_[slot]);
    if (slots_.size() <= address) slots_.resize(address + 1, -1);
    slots_[address] = static_cast<int>(slot);
  }
  for (int o = 0; o <= kMaxOrder; ++o)
    first_slots_[o] = static_cast<std::size_t>(
        std::count_if(modes_.begin(), modes_.end(), [&](const LocalMode& mode) { return own_order(mode) < o; }));
}

std::size_t SimplexModels::slot_address(const LocalMode& mode) const {
  const auto n = static_cast<std::size_t>(order_);
  const std::size_t k = kind_ == CellKind::tet ? mode.k : 0;
  return ((((mode.edge + 1) * 5 + mode.vertex + 1) * n + mode.i) * n + mode.j) * n + k;
}

/// Vertices whose barycentric coordinates are factors of a mode.
std::vector<int> SimplexModels::bubble(const LocalMode& mode) const {
  std::vector<int> vertices;
  if (mode.edge >= 0) {
    const auto [a, b] = cell_topology(kind_).edges[mode.edge];
    vertices = {a, b};
  }
  if (mode.vertex >= 0) vertices.push_back(mode.vertex);
  if (mode.k > 0) vertices.push_back(3);
  return vertices;
}

/// Counts newly stored bytes, and drops what is stored if it is too much. The lock must be held.
void SimplexModels::count(std::size_t bytes) const {
  stored_bytes_ += bytes;
  if (stored_bytes_ <= kMostStoredBytes) return;
  std::erase_if(stored_, [](const auto& stored) { return stored.first != 1; });
  stored_bytes_ = bytes;
}

std::shared_ptr<const SimplexModels::Part> SimplexModels::part(std::uint32_t number,
                                                               std::span<const Vec3> vertices) const {
  const auto known = [&]() -> std::shared_ptr<const Part> {
    const std::lock_guard lock(mutex_);
    const auto found = stored_.find(number);
    return found != stored_.end() ? found->second.part : nullptr;
  };
  if (auto found = known()) return found;
  const std::lock_guard alone(making_);
  if (auto found = known()) return found;
  auto made = std::make_shared<const Part>(make_part(number, vertices));
  const std::lock_guard lock(mutex_);
  count(made->errors.size() * sizeof(double));
  stored_[number].part = made;
  return made;
}

void SimplexModels::add_models(std::uint32_t number, std::span<const Vec3> vertices, const Part& part, int tier,
                               int order, Models& models) const {
  const auto is_complete = [&] {
    return std::all_of(models.begin(), models.begin() + order + 1, [](const auto& batch) { return batch != nullptr; });
  };
  const auto take_known = [&] {
    const std::lock_guard lock(mutex_);
    if (const auto found = stored_.find(number); found != stored_.end())
      for (int o = 0; o <= order; ++o)
        if (!models[o]) models[o] = found->second.models[tier][o];
    return is_complete();
  };
  if (is_complete() || take_known()) return;
  const std::lock_guard alone(making_);
  if (take_known()) return;
  const std::array<Ends, 4> barycentric = barycentric_at(vertices, dimension());
  Kernels kernels(*this, tables(tier).index.degree(), barycentric);
  for (int o = 0; o <= order; ++o) {
    if (models[o]) continue;
    models[o] = std::make_shared<const Batch>(make_batch(o, tier, part, kernels, barycentric));
    const std::lock_guard lock(mutex_);
    count(models[o]->coefficients.size() * sizeof(double));
    if (const auto found = stored_.find(number); found != stored_.end()) found->second.models[tier][o] = models[o];
  }
}

SimplexModels::Part SimplexModels::make_part(std::uint32_t number, std::span<const Vec3> vertices) const {
  const std::array<Ends, 4> barycentric = barycentric_at(vertices, dimension());
  // Over the whole simplex, a product of two, three or four coordinates is at most this times sqrt(1 - t^2), where t in
  // [-1, 1] is the argument of T_k: twice a coordinate minus 1, or the difference of two.
  constexpr double kDamping[] = {0, 0, 1.0 / 4, 1.0 / 16, 1.0 / 108};
  const bool whole = number == 1;
  Expansions expansions(*this);
  const auto times = [&](const Ends& argument, int i, const ProductSizes& rest) {
    const double bound = kernel_bound(basis_, i), slope = kernel_slope_bound(basis_, i);
    return ProductSizes{expansions(range(argument, dimension()), i).sizes * rest.sizes, bound * rest.bound,
                        slope * rest.bound + bound * rest.slope_bound};
  };
  std::map<std::array<int, 3>, ProductSizes> pairs;  // V_vertex,j V_3,k
  Part part;
  part.errors.assign(2 * kMostSimplexTiers * modes_.size(), 0);
  for (std::size_t slot = 0; slot < modes_.size(); ++slot) {
    const LocalMode& mode = modes_[slot];
    Part::Function f{1, 1, 0};
    if (mode.edge >= 0) {
      const auto [a, b] = cell_topology(kind_).edges[mode.edge];
      const std::vector<int> vertices_of = bubble(mode);
      const int size = static_cast<int>(vertices_of.size());
      SimplexPolynomial alone(dimension(), 1);
      for (const int v : vertices_of) alone = alone.times_affine(barycentric[v]);
      ProductSizes& rest = pairs[{mode.vertex, mode.j, mode.k}];
      if (rest.slope_bound == 0) {
        if (mode.k > 0) rest = times(barycentric[3], mode.k, rest);
        if (mode.j > 0) rest = times(barycentric[mode.vertex], mode.j, rest);
      }
      const ProductSizes product = times(along_edge(barycentric[a], barycentric[b]), mode.i, rest);
      // The product of n coordinates is at most (1/n)^n; the product without one of them bounds its gradient.
      const double largest = std::min(alone.bound(), (1 + 1e-12) * std::pow(1.0 / size, size));
      const double steepest = (1 + 1e-12) * std::pow(1.0 / (size - 1), size - 1);
      f.value_bound = largest * product.bound;
      f.gradient_bound = steepest * product.bound + largest * product.slope_bound;
      for (int tier = 0; tier < num_tiers(); ++tier) {
        const int degree = tables(tier).index.degree() - size;
        double& error = part.errors[2 * kMostSimplexTiers * slot + tier];
        double& gradient_error = part.errors[2 * kMostSimplexTiers * slot + kMostSimplexTiers + tier];
        if (degree >= 0) {
          const double of_kernel = Sizes::beyond(product.sizes.value, degree);
          error = largest * of_kernel;
          double of_kernels = largest * Sizes::beyond(product.sizes.gradient, degree);
          if (whole) of_kernels = std::min(of_kernels, kDamping[size] * Sizes::beyond(product.sizes.damped, degree));
          gradient_error = steepest * of_kernel + of_kernels;
        }
        if (degree < 0 || gradient_error >= f.gradient_bound) {
          error = f.value_bound;
          gradient_error = f.gradient_bound;
          f.left_out = static_cast<std::uint8_t>(f.left_out | 1 << tier);
        }
      }
    }
    part.functions.push_back(f);
  }
  return part;
}

SimplexModels::Batch SimplexModels::make_batch(int own_order, int tier, const Part& part, Kernels& kernels,
                                               const std::array<Ends, 4>& barycentric) const {
  const SimplexTables& t = tables(tier);
  Batch batch;
  batch.first = first_slots_[own_order];
  const std::size_t end = own_order < kMaxOrder ? first_slots_[own_order + 1] : modes_.size();
  batch.sizes.assign(end - batch.first, {0, 0});
  batch.coefficients.assign((end - batch.first) * t.stride, 0);
  std::vector<double> own(t.stride, 0);
  for (std::size_t slot = batch.first; slot < end; ++slot) {
    if (part.functions[slot].is_left_out(tier)) continue;
    const LocalMode& mode = modes_[slot];
    const std::vector<int> factors = bubble(mode);
    SimplexPolynomial product(dimension(), 1);
    int missing = t.index.degree() - static_cast<int>(factors.size());
    if (mode.edge >= 0) {
      product = kernels.product(mode, missing);
      missing = 0;
    }
    for (const int v : factors) product = product.times_affine(barycentric[v]);
    for (; missing > 0; --missing) product = product.raised();
    batch.sizes[slot - batch.first] = {product.bound(), product.rounding()};
    product.bernstein(own.data());
    for (std::size_t alpha = 0; alpha < t.stride; alpha += kWide)
      store_wide(load_wide(own.data() + alpha), batch.coefficients.data() + batch.address(slot, alpha));
  }
  return batch;
}

}  // namespace subvol::internal
