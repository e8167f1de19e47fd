// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/control_matrices.h"

#include "subvol/fit/certificate/hex_matrices.h"
#include "subvol/fit/certificate/prism_matrices.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

namespace subvol::internal {

namespace {

/// Number of vectors of matrices taken in between two tests for positive definiteness.
constexpr std::size_t kVectorsPerDefinitenessTest = 4;

/// Approximates the transposed rotation of m's polar decomposition by Newton's iteration, scaled while far from it
/// (Higham). The closer m is to a singular matrix, the smaller the error. The result times m is symmetric.
Mat3 unrotate(const Mat3& m) {
  const auto inverse_transposed = [](const Mat3& x) {
    Mat3 result;
    for (int d = 0; d < 3; ++d) result.col(d) = x.col((d + 1) % 3).cross(x.col((d + 2) % 3));
    return Mat3(result * (1 / x.col(0).dot(result.col(0))));
  };
  const double near = m.determinant();
  const Mat3 first_inverse = inverse_transposed(m);
  Mat3 rotation = m, inverse = first_inverse;
  for (int step = 0; step < 12; ++step) {
    if (step > 0) inverse = inverse_transposed(rotation);
    const double distance = (inverse - rotation).squaredNorm();
    if (distance > 1) {
      const double factor = std::sqrt(inverse.norm() / rotation.norm());
      rotation *= factor;
      inverse *= 1 / factor;
    }
    rotation = 0.5 * (rotation + inverse);
    if (distance < 4 * near) break;
  }
  const Mat3 product = rotation.transpose() * m;
  return rotation.transpose() - 0.5 * (product - product.transpose()) * first_inverse.transpose();
}

/// Mean square of the entries of rotation (J_b - mean) frame, over a sample of the matrices that is spread over all.
/// frame: null for none.
template <class Matrices>
Mat3 variation(const Matrices& matrices, const Mat3& mean, const Mat3& rotation, const Mat3* frame) {
  constexpr std::size_t kMostSampledVectors = 4;  // more make little difference (measured)
  const std::size_t vectors = (matrices.size() + kWide - 1) / kWide, sampled = std::min(vectors, kMostSampledVectors);
  using Vector = typename Matrices::Vector;
  using Number = NumberOf<Vector>;
  // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): only of doubles is it a copy
  const Eigen::Matrix<Number, 3, 3> middle = mean.cast<Number>(), turn = rotation.cast<Number>();
  MatrixOf<Vector> squares{};
  for (std::size_t i = 0; i < sampled; ++i) {
    const std::size_t at = std::min(i == 0 ? 0 : i * (vectors - 1) / (sampled - 1) * kWide, matrices.size() - kWide);
    MatrixOf<Vector> j;
    matrices.load(at, j);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) j[r][c] -= middle(r, c);
    multiply(turn, j);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        Vector x = j[r][c];
        if (frame) {
          x = Vector{};
          for (int k = 0; k < 3; ++k) x += static_cast<Number>((*frame)(k, c)) * j[r][k];
        }
        squares[r][c] += x * x;
      }
  }
  Mat3 result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) result(r, c) = sum_of_lanes(widen(squares[r][c]));
  return result / static_cast<double>(kWide * sampled);
}

/// Returns c, with product 1. lengths: those of the columns of M frame.
Vec3 scales_by_variation(const Mat3& variation, const Vec3& lengths) {
  constexpr double kLeastSquaredVariation = 0.01;  // squared share of the lengths; smaller variation does not count
  const Mat3 v = variation + kLeastSquaredVariation * Vec3::Ones() * lengths.cwiseAbs2().transpose();
  const double by_01 = v(0, 1) / v(1, 0), by_02 = v(0, 2) / v(2, 0), by_12 = v(1, 2) / v(2, 1);
  const double first = std::cbrt(std::sqrt(by_01 * by_02)), second = std::cbrt(std::sqrt(by_12 / by_01));
  return {first, second, 1 / (first * second)};
}

constexpr std::size_t kNoMatrix = static_cast<std::size_t>(-1);

struct Bound {
  double value;                        ///< lower bound of det J; 0: none
  bool is_final;                       ///< true if no other L needs to be tried: a bound was found, or none exists
  std::size_t in_the_way = kNoMatrix;  ///< number b of an S_b that is not positive definite, if one is known
};

template <class Vector>
int lowest_place(const Vector& x) {
  int result = 0;
  for (int k = 1; k < static_cast<int>(sizeof x / sizeof x[0]); ++k)
    if (x[k] < x[result]) result = k;
  return result;
}

/// Returns a vector near the eigenvector of a symmetric matrix's least eigenvalue: a column of the adjugate of s + m,
/// where m, a multiple of the identity, makes all eigenvalues positive. Closer vectors bring no benefit (measured).
Vec3 near_least_eigenvector(const Mat3& s) {
  const double third = s.trace() / 3;
  Mat3 shifted = s;
  shifted.diagonal().array() -= third;
  const double half_size = std::sqrt(shifted.squaredNorm() / 6);  // the eigenvalues of `shifted` are within twice this
  if (!(half_size > 0)) return Vec3::UnitX();
  shifted.diagonal().array() += 2 * half_size;
  Mat3 adjugate;
  for (int d = 0; d < 3; ++d) adjugate.col(d) = shifted.col((d + 1) % 3).cross(shifted.col((d + 2) % 3));
  int largest;
  adjugate.diagonal().maxCoeff(&largest);
  return adjugate.col(largest);
}

/// Returns L + (margin - e) v (J_b D v)^T / |J_b D v|^2, where e <= 0 is the least eigenvalue of sym(L J_b D) and v its
/// eigenvector, of any length: then v^T L J_b D v = margin v^T v. This is one step of the perceptron algorithm for an L
/// that suits all b.
Mat3 turned(Mat3 l, const Mat3& scaled_matrix) {
  constexpr double kPerceptronMargin = 0.06;  // relative to L's largest entry
  l *= 1 / l.cwiseAbs().maxCoeff();
  const Mat3 product = l * scaled_matrix;
  const Vec3 v = near_least_eigenvector(0.5 * (product + product.transpose()));
  const double least = std::min(0.0, v.dot(product * v) / v.squaredNorm());
  const Vec3 w = scaled_matrix * v;
  return l + (kPerceptronMargin - least) / w.squaredNorm() * v * w.transpose();
}

/// Lowest leading minors and largest entries of many symmetric matrices 2 T_b, T_b = sym(m_b) - diag(shift).
template <class Vector>
class Extremes {
 public:
  explicit Extremes(const Vec3& shift)
      : start0_(number(-2 * shift[0])), start1_(number(-2 * shift[1])), start2_(number(-2 * shift[2])) {
    first_ = second_ = third_ = Vector{} + std::numeric_limits<Number>::infinity();
  }
  void take(const MatrixOf<Vector>& m) {
    const Vector t00 = (m[0][0] + m[0][0]) + start0_, t11 = (m[1][1] + m[1][1]) + start1_,
                 t22 = (m[2][2] + m[2][2]) + start2_;
    const Vector t01 = m[0][1] + m[1][0], t02 = m[0][2] + m[2][0], t12 = m[1][2] + m[2][1];
    const Vector minor = t00 * t11 - t01 * t01;
    take_lower(first_, t00);
    take_lower(second_, minor);
    take_lower(third_, t22 * minor - t12 * (t00 * t12 - t01 * t02) + t02 * (t01 * t12 - t02 * t11));
    take_higher_size(sizes_[0], t00);
    take_higher_size(sizes_[1], t11);
    take_higher_size(sizes_[2], t22);
    take_higher_size(sizes_[3], t02);
    take_higher_size(sizes_[4], t12);
  }
  bool are_positive() const { return !lanes_within(lowest_minor(), 0); }
  Vector lowest_minor() const {
    Vector result = first_;
    take_lower(result, second_);
    take_lower(result, third_);
    return result;
  }
  /// Returns a lower bound of det S_b, S_b = D T_b D, if all are certainly positive definite; else 0. scale: D.
  double determinant(const Vec3& scale) const {
    constexpr double kNumberRoundoff = std::numeric_limits<Number>::epsilon() / 2;
    const auto scaled_size = [&](int e, int i, int k) { return highest_lane(sizes_[e]) * scale[i] * scale[k]; };
    const double largest = std::max(
        {scaled_size(0, 0, 0), scaled_size(1, 1, 1), scaled_size(2, 2, 2), scaled_size(3, 0, 2), scaled_size(4, 1, 2)});
    const double to_second = scale[0] * scale[0] * scale[1] * scale[1], to_third = to_second * scale[2] * scale[2];
    // A second minor has products of two entries with at most 3 roundings each, a third minor six of three with 5 or 6.
    const double least = to_third * lowest_lane(third_) - 100 * kNumberRoundoff * largest * largest * largest;
    return largest < 1e30 && lowest_lane(first_) > 0 &&
                   to_second * lowest_lane(second_) > 9 * kNumberRoundoff * largest * largest && least > 0
               ? least / 8
               : 0;
  }

 private:
  using Number = NumberOf<Vector>;
  static Number number(double x) { return static_cast<Number>(x); }

  Number start0_, start1_, start2_;
  Vector first_, second_, third_;
  Vector sizes_[5] = {};  // without t01, which is less than t00 or t11 if the second minor is positive
};

/// Result for a box if T_b is not positive definite for some of these matrices. begin: number of the first matrix.
template <class Vector>
Bound failed_at(std::size_t begin, const MatrixOf<Vector>& m, const Extremes<Vector>& own) {
  const Vector det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                     m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                     m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  return {0, lanes_within(det, 0) != 0, begin + lowest_place(own.lowest_minor())};  // S_b > 0 implies det J_b > 0
}

/// Takes in the T_b of `count` matrices. Stops at, and returns, the number of one that is not positive definite; else
/// kNoMatrix.
template <class Vector, class Product>
std::size_t take_until_failure(const Product& product, std::size_t count, const Vec3& shift,
                               Extremes<Vector>& extremes) {
  constexpr std::size_t kVectorLanes = sizeof(Vector) / sizeof(Vector{}[0]);
  MatrixOf<Vector> m;
  const auto place = [&](std::size_t b) { return std::min(b, count - kVectorLanes); };  // the last vector may overlap
  for (std::size_t block = 0; block < count; block += kVectorsPerDefinitenessTest * kVectorLanes) {
    const std::size_t end = std::min(count, block + kVectorsPerDefinitenessTest * kVectorLanes);
    for (std::size_t b = block; b < end; b += kVectorLanes) {
      product.load(place(b), m);
      extremes.take(m);
    }
    if (extremes.are_positive()) continue;
    for (std::size_t b = block; b < end; b += kVectorLanes) {
      Extremes<Vector> own(shift);
      product.load(place(b), m);
      own.take(m);
      if (!own.are_positive()) return place(b) + lowest_place(own.lowest_minor());
    }
  }
  return kNoMatrix;
}

/// Twice the amount to subtract from the diagonal of S_b if |error of L J D| <= g.
Vec3 sums_of_both(const Mat3& g) { return g.rowwise().sum() + g.colwise().sum().transpose(); }

/// Data shared by the bounds with all L.
///
/// D is multiplied by the length of the mean's longest column, so that no entry of T_b below is much above 1.
struct Scaling {
  Scaling(const Mat3& mean_matrix, const Vec3& mean_lengths, const Mat3& remainder)
      : mean(mean_matrix),
        lengths(mean_lengths),
        longest(lengths.maxCoeff()),
        scale(longest * lengths.cwiseInverse()),
        unscaling(lengths / (longest * longest)),
        squared_unscaling((lengths / longest).cwiseAbs2()),
        scaled_remainder(remainder * (scale / longest).asDiagonal()) {}

  Mat3 mean;
  Vec3 lengths;  ///< of the columns of `mean`
  double longest;
  Vec3 scale;              ///< D times `longest`
  Vec3 unscaling;          ///< 1 over `scale` and over `longest`
  Vec3 squared_unscaling;  ///< 1 over `scale`, squared
  Mat3 scaled_remainder;   ///< the remainder over `longest`, times `scale`
};

/// Returns the bound of det S_b in single precision, or 0; in_the_way: the number of the matrix where it failed, if so.
///
/// S_b = D T_b D, T_b = sym(unscaled J_b) - ..., where the entries of T_b are about 1 at most.
template <class Matrices>
double narrow_bound(Matrices& matrices, const Mat3& unscaled, const Vec3& shift, const Scaling& scaling,
                    std::size_t& in_the_way) {
  if constexpr (!requires { typename Matrices::NarrowProduct; }) {
    return 0;
  } else {
    constexpr double kMostShift = 1e10;  // far from underflow and overflow
    const Vec3& scale = scaling.scale;
    if (!(scale.maxCoeff() < kMostScale)) return 0;
    const auto product = matrices.narrow_product(unscaled);
    const Mat3 g = scale.cwiseProduct(product.errors()) * scale.transpose();
    const Vec3 more = (1 + 1e-5) * (shift + 0.5 * sums_of_both(g)).cwiseProduct(scaling.squared_unscaling);
    if (!(product.errors().maxCoeff() <= kMostError && more.maxCoeff() <= kMostShift)) return 0;
    Extremes<typename Matrices::NarrowProduct::Vector> extremes(more);
    in_the_way = take_until_failure(product, matrices.size(), more, extremes);
    return in_the_way == kNoMatrix ? extremes.determinant(scale) : 0;
  }
}

/// Computes the bound with one L.
///
/// in_the_way  number of the matrix to examine first: one at which another L failed is likely to fail again
template <class Matrices>
Bound bound_by(Mat3 l, const Scaling& scaling, Matrices& matrices, const BoundOptions& options,
               std::size_t in_the_way) {
  constexpr double kLeastDeterminant = 1e-3;  // of L, relative to its largest entry cubed: then it is accurate to 1e-11
  l *= 1 / l.cwiseAbs().maxCoeff();
  const double l_determinant = l.determinant();
  if (!(l_determinant > kLeastDeterminant)) return {0, false};
  const Vec3 shift = 0.5 * (1 + 1e-12) * sums_of_both(l.cwiseAbs() * scaling.scaled_remainder);
  for (int i = 0; i < 3; ++i)
    if (!(l.row(i).dot(scaling.mean.col(i)) > shift[i] * scaling.lengths[i])) return {0, false};

  // T_b = D^-1 S_b D^-1 = sym(D^-1 L J_b) - ...: only the extremes over all b are scaled.
  const Mat3 unscaled = scaling.unscaling.asDiagonal() * l;
  const Vec3 unscaled_shift = shift.cwiseProduct(scaling.squared_unscaling);
  const std::size_t count = matrices.size();
  using Vector = typename Matrices::Vector;
  // NOLINTNEXTLINE(performance-unnecessary-copy-initialization): only of doubles is it a copy
  const Eigen::Matrix<NumberOf<Vector>, 3, 3> factors = unscaled.template cast<NumberOf<Vector>>();
  const auto failed_near = [&](std::size_t b) -> std::optional<Bound> {
    if (b == kNoMatrix) return {};
    const std::size_t begin = std::min(b / kWide * kWide, count - kWide);
    MatrixOf<Vector> m;
    matrices.load(begin, m);
    multiply(factors, m);
    Extremes<Vector> own(unscaled_shift);
    own.take(m);
    if (own.are_positive()) return {};
    return failed_at(begin, m, own);
  };
  const auto bound = [&](double determinant) {
    return Bound{determinant * (1 - 1e-11) * scaling.lengths.prod() / l_determinant, true};
  };
  if (const auto fails = failed_near(in_the_way)) return *fails;
  if (in_the_way != kNoMatrix || options.corners_first)
    for (const std::size_t corner : matrices.corners())
      if (const auto fails = failed_near(corner)) return *fails;
  in_the_way = kNoMatrix;
  constexpr bool kHasDouble = requires { matrices.times(unscaled); };
  if (options.single_first || !kHasDouble) {
    if (const double determinant = narrow_bound(matrices, unscaled, shift, scaling, in_the_way); determinant > 0)
      return bound(determinant);
    if (const auto fails = failed_near(in_the_way)) return *fails;
  }

  if constexpr (kHasDouble) {
    Extremes<Wide> extremes(unscaled_shift);
    in_the_way = take_until_failure(matrices.times(unscaled), count, unscaled_shift, extremes);
    if (in_the_way != kNoMatrix) return failed_near(in_the_way).value_or(Bound{0, false});
    if (const double determinant = extremes.determinant(scaling.scale); determinant > 0) return bound(determinant);
  }
  return {0, false};
}

}  // namespace

Mat3 ControlMatrices::mean() const {
  const std::size_t last = count_ - kWide, step = count_ > 16 * kWide ? 2 * kWide : kWide;
  const double sampled = kWide * (static_cast<double>(last / step) + 2);
  Mat3 result;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      const double* x = entries(r, c);
      Wide sum = load_wide(x + last);
      for (std::size_t b = 0; b <= last; b += step) sum += load_wide(x + b);
      result(r, c) = sum_of_lanes(sum) / sampled;
    }
  return result;
}

template <class Matrices>
double determinant_bound(Matrices& matrices, const Mat3& remainder, const Mat3& frame, const BoundOptions& options,
                         Mat3* near_l) {
  constexpr int kMostTurns = 3;  // more turns cost as much as they save, and so does stopping at a low e (measured)
  const Mat3 mean = matrices.mean();
  const Vec3 lengths = mean.colwise().norm().transpose(), inverse_lengths = lengths.cwiseInverse();
  // This also rejects a column that is 0 or not finite.
  if (!((mean * inverse_lengths.asDiagonal()).determinant() > 1e-12)) return 0;
  const Scaling scaling(mean, lengths, remainder);
  const auto bound = [&](const Mat3& l, std::size_t in_the_way = kNoMatrix) {
    if (near_l) *near_l = l;
    return bound_by(l, scaling, matrices, options, in_the_way);
  };
  Bound result{0, false};
  if (near_l && *near_l != Mat3::Zero()) {
    result = bound(*near_l);
    if (result.is_final) return result.value;
  }
  const bool is_framed = frame != Mat3::Identity();

  const Mat3 framed = is_framed ? Mat3(mean * frame) : mean;
  const Vec3 framed_lengths = is_framed ? Vec3(framed.colwise().norm().transpose()) : lengths;
  const Vec3 framed_scale = is_framed ? Vec3(framed_lengths.cwiseInverse()) : inverse_lengths;
  // L = D frame^-T diag(c)^-1 rotation.
  const auto from_frame = [&](const Vec3& c, const Mat3& rotation) -> Mat3 {
    const Mat3 in_frame = c.cwiseInverse().asDiagonal() * rotation;
    return inverse_lengths.asDiagonal() * (is_framed ? Mat3(frame.inverse().transpose() * in_frame) : in_frame);
  };
  const Mat3 rotation = unrotate(framed * framed_scale.asDiagonal());
  result = bound(from_frame(framed_scale, rotation), result.in_the_way);
  if (result.is_final) return result.value;

  const Vec3 c = scales_by_variation(variation(matrices, mean, rotation, is_framed ? &frame : nullptr), framed_lengths);
  const double size = std::cbrt(framed.determinant());
  Mat3 l = from_frame(c, unrotate(framed * (c / size).asDiagonal()));
  result = bound(l, result.in_the_way);
  for (int turn = 0; turn < kMostTurns && !result.is_final && result.in_the_way != kNoMatrix; ++turn) {
    l = turned(l, matrices[result.in_the_way] * inverse_lengths.asDiagonal());
    result = bound(l, result.in_the_way);
  }
  // The remainder is smallest in the box's own coordinates.
  if (!result.is_final && is_framed) result = bound(unrotate(mean * inverse_lengths.asDiagonal()), result.in_the_way);
  return result.value;
}

template double determinant_bound(ControlMatrices&, const Mat3&, const Mat3&, const BoundOptions&, Mat3*);
template double determinant_bound(HexMatrices&, const Mat3&, const Mat3&, const BoundOptions&, Mat3*);
template double determinant_bound(NarrowHexMatrices&, const Mat3&, const Mat3&, const BoundOptions&, Mat3*);
template double determinant_bound(PrismMatrices&, const Mat3&, const Mat3&, const BoundOptions&, Mat3*);

}  // namespace subvol::internal
