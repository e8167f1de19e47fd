// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/simplex_models.h"
#include "tests/support/element_fixtures.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include <random>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

using Barycentric = std::array<double, 4>;

Barycentric random_point(int dimension, std::mt19937& random) {
  std::exponential_distribution<double> weight;
  Barycentric l{};
  double sum = 0;
  for (int c = 0; c <= dimension; ++c) sum += l[c] = weight(random);
  for (double& x : l) x /= sum;
  return l;
}

/// sum_alpha b_alpha B_alpha(l) and its derivatives by the barycentric coordinates, one after the other.
double bernstein_sum(const SimplexIndex& index, const double* b, const Barycentric& l, Barycentric& slopes) {
  double sum = 0;
  slopes.fill(0);
  for (int n = 0; n < index.size(); ++n) {
    const auto& e = index.exponents(n);
    double weight = std::tgamma(index.degree() + 1.0);
    for (int c = 0; c < 4; ++c) weight /= std::tgamma(e[c] + 1.0);
    double value = weight * b[n];
    for (int c = 0; c < 4; ++c) value *= std::pow(l[c], e[c]);
    sum += value;
    for (int c = 0; c < 4; ++c) {
      if (e[c] == 0) continue;
      double slope = weight * b[n] * e[c];
      for (int d = 0; d < 4; ++d) slope *= std::pow(l[d], d == c ? e[d] - 1 : e[d]);
      slopes[c] += slope;
    }
  }
  return sum;
}

double value(const SimplexPolynomial& p, int dimension, const Barycentric& l) {
  const SimplexIndex index(dimension, p.degree());
  std::vector<double> b(index.size());
  p.bernstein(b.data());
  Barycentric slopes;
  return bernstein_sum(index, b.data(), l, slopes);
}

}  // namespace

TEST_CASE("sums of products of polynomials over simplices are what they say", "[simplex_models]") {
  PointSource source(211);
  std::mt19937& random = source.random();
  std::uniform_real_distribution<double> in_range(-1, 1);
  for (const int dimension : {2, 3}) {
    Barycentric x, y;
    for (double& value : x) value = in_range(random);
    for (double& value : y) value = in_range(random);
    std::vector<SimplexPolynomial> a{SimplexPolynomial(dimension, 1)}, b{SimplexPolynomial(dimension, 1)};
    for (int n = 1; n <= 9; ++n) a.push_back(a.back().times_affine(x)), b.push_back(b.back().times_affine(y));
    const std::vector<double> weights{0.5, -2, 0, 1, 0.25};
    for (const int n : {0, 3, 9}) {
      const SimplexPolynomial sum = SimplexPolynomial::convolved(weights, a, b, n);
      CHECK(sum.degree() == n);
      for (int repeat = 0; repeat < 20; ++repeat) {
        const Barycentric l = random_point(dimension, random);
        double at_x = 0, at_y = 0, expected = 0;
        for (int c = 0; c <= dimension; ++c) at_x += l[c] * x[c], at_y += l[c] * y[c];
        for (int k = 0; k <= std::min(n, 4); ++k) expected += weights[k] * std::pow(at_x, k) * std::pow(at_y, n - k);
        CAPTURE(dimension, n, repeat);
        CHECK(value(sum, dimension, l) == Approx(expected).margin(1e-13));
        CHECK(std::abs(expected) <= sum.bound());
        CHECK(value(sum.raised(), dimension, l) == Approx(expected).margin(1e-13));
        CHECK(value(SimplexPolynomial::combined(2, sum, -3, sum), dimension, l) == Approx(-expected).margin(1e-13));
      }
      CHECK(sum.rounding() < 1e-13);
    }
  }
}

TEST_CASE("halved control points are those of the same polynomial over the halves", "[simplex_models]") {
  PointSource source(223);
  std::mt19937& random = source.random();
  std::normal_distribution<double> normal;
  for (const int dimension : {2, 3}) {
    const SimplexIndex index(dimension, 5);
    std::vector<double> whole(index.size());
    for (double& x : whole) x = normal(random);
    for (int a = 0; a <= dimension; ++a)
      for (int b = a + 1; b <= dimension; ++b) {
        std::vector<double> low = whole, high = whole;
        for (const auto& round : SimplexHalving(index, a, b).rounds) {
          for (const auto& [n, m] : round.means) low[n] = 0.5 * (low[n] + low[m]);
          for (const auto& [n, m] : round.copies) high[m] = low[n];
        }
        const Barycentric l = random_point(dimension, random);
        Barycentric in_low = l, in_high = l, slopes;
        in_low[a] += 0.5 * l[b], in_low[b] *= 0.5;
        in_high[b] += 0.5 * l[a], in_high[a] *= 0.5;
        CAPTURE(dimension, a, b);
        CHECK(bernstein_sum(index, low.data(), l, slopes) ==
              Approx(bernstein_sum(index, whole.data(), in_low, slopes)).margin(1e-13));
        CHECK(bernstein_sum(index, high.data(), l, slopes) ==
              Approx(bernstein_sum(index, whole.data(), in_high, slopes)).margin(1e-13));
      }
  }
}

TEST_CASE("models of functions on simplices are as close to them as they say", "[simplex_models]") {
  constexpr double kRounding = 1e-9;  // of this test's own sums, in Bernstein polynomials of high degree
  PointSource source(227);
  std::mt19937& random = source.random();
  for (const CellKind kind : {CellKind::prism, CellKind::tet})
    for (const Basis basis : kBothBases)
      for (const int order : {2, 3, 4, 6}) {
        const SimplexModels& models = SimplexModels::get(kind, basis, order);
        const int dimension = models.dimension(), last_tier = models.num_tiers() - 1;
        const VolumeMesh cell = single_cell(kind);
        const ElementSpace space(cell, basis, order);
        ShapeFunctions shapes(kind, basis, order);
        // The whole, the part at vertex 1 of half its size, and one that lies askew.
        const auto canonical = canonical_vertices(kind);
        std::vector<std::vector<Vec3>> parts{{canonical.begin(), canonical.begin() + dimension + 1}};
        parts.push_back(parts[0]);
        for (Vec3& p : parts[1]) p = 0.5 * (p + canonical[1]);
        parts.push_back({0.5 * canonical[1], canonical[1], 0.5 * (canonical[1] + canonical[2])});
        if (dimension == 3) parts[2].push_back(0.5 * (canonical[3] + canonical[2]));
        for (std::size_t p = 0; p < (basis == Basis::legendre ? 1 : parts.size()); ++p) {
          // Numbers after five halvings: nothing else asks for models there.
          const std::uint32_t number = p == 0 ? 1u : 31u + static_cast<std::uint32_t>(p);
          const auto part = models.part(number, parts[p]);
          std::vector<SimplexModels::Models> made(models.num_tiers());
          for (int tier = 0; tier <= last_tier; ++tier)
            models.add_models(number, parts[p], *part, tier, order - 1, made[tier]);
          Mat3 sides = Mat3::Identity();
          for (int d = 0; d < dimension; ++d) sides.col(d) = parts[p][d + 1] - parts[p][0];
          const Mat3 by_canonical = sides.inverse().transpose();
          double worst = 0;
          for (int repeat = 0; repeat < 9; ++repeat) {
            Barycentric l = random_point(dimension, random);
            if (repeat % 3 == 0) {  // also on the border
              double& lost = l[repeat % (dimension + 1)];
              l[(repeat + 1) % (dimension + 1)] += lost;
              lost = 0;
            }
            Vec3 x = Vec3::Zero();
            for (int c = 0; c <= dimension; ++c) x += l[c] * parts[p][c];
            shapes.set_point(x);
            for (const LocalMode& mode : space.modes(0)) {
              if (kind == CellKind::prism && mode.k > 0) continue;  // N_0 = 1 at w = 0
              const std::size_t slot = models.slot(mode);
              const auto& f = part->functions[slot];
              Vec3 exact;
              const double value = shapes.value(mode, exact);
              for (const int tier : {repeat % models.num_tiers()}) {
                const SimplexTables& tables = models.tables(tier);
                const SimplexModels::Batch& batch = *made[tier][models.own_order(mode)];
                std::vector<double> coefficients(tables.index.size());
                for (std::size_t alpha = 0; alpha < coefficients.size(); ++alpha)
                  coefficients[alpha] = batch.coefficients[batch.address(slot, alpha)];
                const double* b = coefficients.data();
                Barycentric slopes;
                const double modeled = bernstein_sum(tables.index, b, l, slopes);
                Vec3 local = Vec3::Zero();
                for (int d = 0; d < dimension; ++d) local[d] = slopes[d + 1] - slopes[0];
                const double off = (by_canonical * local - exact).head(dimension).cwiseAbs().maxCoeff();
                worst = std::max({worst, std::abs(modeled - value) - part->error(slot, tier),
                                  off - part->gradient_error(slot, tier)});
                const double largest = *std::max_element(b, b + tables.index.size(), [](double left, double right) {
                  return std::abs(left) < std::abs(right);
                });
                CHECK(std::abs(largest) <= batch.sizes[slot - batch.first].largest_coefficient);
                const bool is_enough = tables.index.degree() >= models.own_order(mode) + 1;
                if (basis == Basis::legendre && is_enough) CHECK(part->gradient_error(slot, tier) == 0);
                if (f.is_left_out(tier)) CHECK(part->gradient_error(slot, tier) == f.gradient_bound);
              }
              if (basis == Basis::fourier) {  // the highest tier is close
                CHECK(part->gradient_error(slot, last_tier) < (p == 0 ? 0.05 : 1e-2));
                CHECK(part->gradient_error(slot, last_tier) <= part->gradient_error(slot, 0));
              }
              CHECK(std::abs(value) <= f.value_bound + kRounding);
              CHECK(exact.head(dimension).cwiseAbs().maxCoeff() <= f.gradient_bound + kRounding);
            }
          }
          CAPTURE(kind, basis, order, p);
          CHECK(worst < kRounding);
        }
      }
}
