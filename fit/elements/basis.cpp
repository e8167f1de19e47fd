// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/basis.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace subvol {

namespace {

constexpr double kPi = std::numbers::pi, kSqrt2 = std::numbers::sqrt2;

/// sin(z) / z and its derivative.
void sinc(double z, double& value, double& derivative) {
  if (z > 0.5) {
    value = std::sin(z) / z;
    derivative = (std::cos(z) - value) / z;
    return;
  }
  value = 1;
  derivative = 0;
  double term = 1;  // (-1)^n z^(2n-1) / (2n+1)!, times z once more for the value
  for (int n = 1; n <= 8; ++n) {
    term *= n == 1 ? -z / 6 : -z * z / (2 * n * (2 * n + 1));
    value += term * z;
    derivative += 2 * n * term;
  }
}

/// Legendre polynomials at t with two derivatives, raised degree by degree.
struct LegendreRecurrence {
  explicit LegendreRecurrence(double at) : t(at), value(at) {}
  double t, value, first = 1, second = 0;  // P_i, P_i', P_i'' for i = 1

  void raise() {
    const double next_value = ((2 * i_ + 1) * t * value - i_ * old_value_) / (i_ + 1);
    const double next_first = old_first_ + (2 * i_ + 1) * value;
    const double next_second = old_second_ + (2 * i_ + 1) * first;
    old_value_ = value, old_first_ = first, old_second_ = second;
    value = next_value, first = next_first, second = next_second;
    ++i_;
  }

 private:
  int i_ = 1;
  double old_value_ = 1, old_first_ = 0, old_second_ = 0;
};

/// Both families at x <= 1/2, where there is no cancellation; the other half follows by parity.
void fourier_modes(int count, double x, double* values, double* derivatives) {
  for (int i = 1; i <= count; ++i) {
    values[i - 1] = kSqrt2 * std::sin(i * kPi * x) / (i * kPi);
    derivatives[i - 1] = kSqrt2 * std::cos(i * kPi * x);
  }
}

void fourier_kernels(int count, double x, double* values, double* derivatives) {
  for (int i = 1; i <= count; ++i) {
    double value, derivative;
    sinc(i * kPi * x, value, derivative);
    values[i - 1] = kSqrt2 * value / (1 - x);
    derivatives[i - 1] = kSqrt2 * (derivative * i * kPi + value / (1 - x)) / (1 - x);
  }
}

// phi_i(x) = sqrt(2i+1)/2 int_t^1 P_i = x (1 - x) 2 sqrt(2i+1) / (i (i+1)) P_i'(t), t = 1 - 2x, by Legendre's equation.
void legendre_modes(int count, double x, double* values, double* derivatives) {
  LegendreRecurrence p(1 - 2 * x);
  for (int i = 1; i <= count; ++i, p.raise()) {
    values[i - 1] = x * (1 - x) * 2 * std::sqrt(2 * i + 1.0) / (i * (i + 1)) * p.first;
    derivatives[i - 1] = std::sqrt(2 * i + 1.0) * p.value;
  }
}

void legendre_kernels(int count, double x, double* values, double* derivatives) {
  LegendreRecurrence p(1 - 2 * x);
  for (int i = 1; i <= count; ++i, p.raise()) {
    const double factor = 2 * std::sqrt(2 * i + 1.0) / (i * (i + 1));
    values[i - 1] = factor * p.first;
    derivatives[i - 1] = -2 * factor * p.second;
  }
}

/// Calls f(count, x, ..) for x <= 1/2; beyond that, uses the parity of the modes.
template <class Function>
void by_parity(const Function& f, int count, double x, double* values, double* derivatives) {
  if (x <= 0.5) return f(count, x, values, derivatives);
  f(count, 1 - x, values, derivatives);
  for (int i = 1; i <= count; ++i) {
    values[i - 1] *= mode_parity(i);
    derivatives[i - 1] *= -mode_parity(i);
  }
}

}  // namespace

void line_functions(Basis basis, int order, double x, double* values, double* derivatives) {
  assert(order >= 1 && order <= kMaxOrder);
  values[0] = 1 - x, derivatives[0] = -1;
  values[1] = x, derivatives[1] = 1;
  by_parity(basis == Basis::fourier ? fourier_modes : legendre_modes, order - 1, x, values + 2, derivatives + 2);
}

void mode_kernels(Basis basis, int order, double x, double* values, double* derivatives) {
  assert(order >= 1 && order <= kMaxOrder);
  by_parity(basis == Basis::fourier ? fourier_kernels : legendre_kernels, order - 1, x, values, derivatives);
}

const char* to_string(Basis basis) { return basis == Basis::fourier ? "fourier" : "legendre"; }

}  // namespace subvol
