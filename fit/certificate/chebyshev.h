// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

namespace subvol::internal {

/// Expansions in Chebyshev polynomials with proved error bounds, in extended precision if the platform has it.
///
///   f(mid + radius t) = sum_{k < count} c_k T_k(t) + error,   |error| <= remainder,   -1 <= t <= 1
///
/// The c_k are those of the interpolant at the K = num_nodes zeros of T_K. Its own error is at most
/// sup|f^(K)| radius^K / (2^(K-1) K!); truncating it adds at most the sum of the |c_k| that are dropped.
class ChebyshevExpansion {
 public:
  explicit ChebyshevExpansion(int num_nodes) : num_nodes_(num_nodes) {
    for (int j = 0; j < 4 * num_nodes; ++j)
      cosines_.push_back(std::cos(std::numbers::pi_v<long double> * j / (2 * num_nodes)));
  }

  int num_nodes() const { return num_nodes_; }

  /// coefficients  output, `count` <= num_nodes entries.
  /// log_derivative_bound  logarithm of a bound on |f^(num_nodes)| on the interval; -infinity if f is a polynomial of
  /// lower degree.
  /// returns  the remainder, including 1e-15 of the largest value for rounding.
  template <class Function>
  double expand(const Function& f, long double mid, long double radius, double log_derivative_bound, int count,
                long double* coefficients) const {
    std::vector<long double> values(num_nodes_);
    long double largest = 0;
    for (int m = 0; m < num_nodes_; ++m) {
      values[m] = f(mid + radius * cosines_[2 * m + 1]);
      largest = std::max(largest, std::abs(values[m]));
    }
    long double cut = 0;
    for (int k = 0; k < num_nodes_; ++k) {
      long double sum = 0;
      std::size_t at = k;  // k (2m + 1), modulo the period of the cosine
      for (int m = 0; m < num_nodes_; ++m) {
        sum += values[m] * cosines_[at];
        at += 2 * k;
        if (at >= cosines_.size()) at -= cosines_.size();
      }
      sum *= (k == 0 ? 1.0L : 2.0L) / num_nodes_;
      if (k < count)
        coefficients[k] = sum;
      else
        cut += std::abs(sum);
    }
    const double log_error = log_derivative_bound + num_nodes_ * std::log(static_cast<double>(radius) / 2) +
                             std::numbers::ln2 - std::lgamma(num_nodes_ + 1.0);
    return static_cast<double>(cut + 1e-15L * largest) + 1.0001 * std::exp(log_error);
  }

 private:
  int num_nodes_;
  std::vector<long double> cosines_;  // of j pi / (2 num_nodes)
};

/// Coefficients of T_k, k <= degree, in the Bernstein polynomials of `degree` over [-1, 1]: row k has degree + 1
/// entries.
std::vector<std::vector<long double>> chebyshev_to_bernstein(int degree);

}  // namespace subvol::internal
