// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/hex_matrices.h"

#include "subvol/fit/certificate/hex_boxes.h"
#include "subvol/fit/certificate/prism_matrices.h"
#include "subvol/fit/certificate/simplex_tables.h"
#include "tests/support/bent_hex.h"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

namespace {

using Random = std::mt19937_64;
double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

double bernstein(int degree, int o, double x) {
  double result = std::pow(x, o) * std::pow(1 - x, degree - o);
  for (int k = 0; k < o; ++k) result = result * (degree - k) / (k + 1);
  return result;
}

/// Near a straight cell of these edges, bent by a share of them.
HexCoefficients random_hex(Random& random, int num_u, int num_w, const Mat3& edges, double bent) {
  HexCoefficients result;
  result.resize(num_u, num_w);
  for (int u = 0; u < num_u; ++u)
    for (int w = 0; w < num_w; ++w)
      for (int v = 0; v < kWide; ++v) {
        const Vec3 place(u / (num_u - 1.0), v / (kWide - 1.0), w / (num_w - 1.0));
        const Vec3 off(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
        const Vec3 x = edges * (place + bent * off);
        for (int row = 0; row < 3; ++row) result.coordinate(row)[u * num_w + w][v] = x[row];
      }
  return result;
}

/// In single precision, relative to a coefficient in the middle.
NarrowHexCoefficients narrowed(const HexCoefficients& hex) {
  NarrowHexCoefficients result;
  result.resize(hex.num_u(), hex.num_w());
  for (int row = 0; row < 3; ++row) {
    const double origin = hex.coordinate(row)[hex.num_vectors() / 2][kWide / 2];
    double size = 0;
    for (int n = 0; n < hex.num_vectors(); ++n)
      for (int v = 0; v < kWide; ++v) {
        const double x = hex.coordinate(row)[n][v] - origin;
        size = std::max(size, std::abs(x));
        result.coordinate(row)[n][v] = static_cast<float>(x);
      }
    result.precision.sizes[row] = size;
    result.precision.errors[row] = size * std::numeric_limits<float>::epsilon() / 2;
  }
  return result;
}

template <class Vector>
Vec3 value(const HexCoefficientsOf<Vector>& hex, const Vec3& at) {
  Vec3 result = Vec3::Zero();
  for (int u = 0; u < hex.num_u(); ++u)
    for (int w = 0; w < hex.num_w(); ++w)
      for (int v = 0; v < kWide; ++v)
        for (int row = 0; row < 3; ++row)
          result[row] += bernstein(hex.num_u() - 1, u, at[0]) * bernstein(kWide - 1, v, at[1]) *
                         bernstein(hex.num_w() - 1, w, at[2]) * hex.coordinate(row)[u * hex.num_w() + w][v];
  return result;
}

/// What the matrices say that J is at a point.
template <class Vector>
Mat3 jacobian(const HexMatricesOf<Vector>& matrices, const HexCoefficientsOf<Vector>& hex, const Vec3& at) {
  Mat3 result = Mat3::Zero();
  for (std::size_t b = 0; b < matrices.size(); ++b) {
    const int vector = static_cast<int>(b) / kWide, v = static_cast<int>(b) % kWide;
    result += bernstein(hex.num_u() - 1, vector / hex.num_w(), at[0]) * bernstein(kWide - 1, v, at[1]) *
              bernstein(hex.num_w() - 1, vector % hex.num_w(), at[2]) * matrices[b];
  }
  return result;
}

template <class Map>
Mat3 differences(const Map& map, const Vec3& at) {
  constexpr double kStep = 1e-5;
  Mat3 result;
  for (int d = 0; d < 3; ++d)
    result.col(d) = (map(at + kStep * Vec3::Unit(d)) - map(at - kStep * Vec3::Unit(d))) / (2 * kStep);
  return result;
}

/// That product's entries are those of l times `exact`, up to `error` of a row and the bounds of single precision.
template <class Product, class Matrices>
void check_product(const Product& product, const Matrices& exact, const Mat3& l, const Vec3& errors) {
  const auto check = [&]<class Entries>(Entries& entries) {
    using Vector = std::remove_reference_t<decltype(entries[0][0])>;
    constexpr std::size_t kLanes = sizeof(Vector) / sizeof(entries[0][0][0]);
    for (std::size_t first = 0; first < exact.size(); first += kWide) {
      const std::size_t from = std::min(first, exact.size() - kLanes);
      product.load(from, entries);
      for (std::size_t k = 0; k < kWide; ++k) {
        const Mat3 wanted = l * exact[first + k];
        for (int row = 0; row < 3; ++row)
          for (int column = 0; column < 3; ++column)
            CHECK(std::abs(entries[row][column][first - from + k] - wanted(row, column)) <= errors[row]);
      }
    }
  };
  if constexpr (requires { typename Product::Vector; }) {
    MatrixOf<typename Product::Vector> entries;
    check(entries);
  } else {
    WideMatrix entries;
    check(entries);
  }
}

/// All ways to the entries of the matrices agree.
template <class Matrices>
void check_loads(const Matrices& matrices) {
  MatrixOf<typename Matrices::Vector> entries;
  const double margin = std::is_same_v<typename Matrices::Vector, Wide> ? 1e-13 : 1e-4;
  for (std::size_t first = 0; first < matrices.size(); first += kWide) {
    matrices.load(first, entries);
    for (int k = 0; k < kWide; ++k) {
      const Mat3 j = matrices[first + static_cast<std::size_t>(k)];
      for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
          CHECK(entries[row][column][k] == Approx(j(row, column)).margin(margin));
    }
  }
}

/// Coefficients in single precision differ from those in double by a constant, up to their bounds.
void check_narrow(HexBoxes& boxes, const HexBoxes::Box& box) {
  if (box.halved > 0) return;  // of other models than its own
  HexBoxes::Box precise;
  precise.level = box.level, precise.levels = box.levels, precise.index = box.index, precise.tiers = box.tiers;
  precise.modeled_levels = box.modeled_levels, precise.modeled_index = box.modeled_index;
  boxes.with_matrices(precise, [](const auto&) {});
  const NarrowHexCoefficients& narrow = *box.narrow;
  const HexCoefficients& exact = *precise.coefficients;
  for (int row = 0; row < 3; ++row) {
    double least = std::numeric_limits<double>::infinity(), largest = -least, size = 0;
    for (int n = 0; n < exact.num_vectors(); ++n)
      for (int v = 0; v < kWide; ++v) {
        const double x = narrow.coordinate(row)[n][v], difference = x - exact.coordinate(row)[n][v];
        least = std::min(least, difference), largest = std::max(largest, difference);
        size = std::max(size, std::abs(x));
      }
    CHECK(largest - least <= 2 * narrow.precision.errors[row] + 1e-13);
    CHECK(size <= narrow.precision.sizes[row]);
  }
}

/// The functions of the vertices, and a cell made of them.
std::vector<LocalMode> corner_modes() {
  std::vector<LocalMode> result(8);
  for (int corner = 0; corner < 8; ++corner) {
    result[corner].i = corner & 1, result[corner].j = corner >> 1 & 1;
    result[corner].k = static_cast<std::uint8_t>(corner >> 2);
  }
  return result;
}
std::vector<Vec3> straight_cell(const Mat3& edges) {
  std::vector<Vec3> result;
  for (const LocalMode& mode : corner_modes()) result.push_back(edges * Vec3(mode.i, mode.j, mode.k));
  return result;
}

const Mat3 kEdges = (Mat3() << 1, 0.4, -0.2, 0.1, 0.8, 0.3, -0.3, 0.2, 3).finished();
const Mat3 kAny = (Mat3() << 0.9, -0.3, 0.2, 0.4, 1.1, -0.1, 0.1, 0.5, 0.7).finished();

}  // namespace

TEST_CASE("Halves of a map of a hex are the map", "[hex_matrices]") {
  Random random(1);
  for (const int num_u : {2, 3, 6, 8})
    for (const int num_w : {2, 5, 8})
      for (int direction = 0; direction < 3; ++direction) {
        const HexCoefficients whole = random_hex(random, num_u, num_w, kEdges, 0.2);
        HexCoefficients low = whole, high;
        low.halve(direction, high);
        for (int repeat = 0; repeat < 5; ++repeat) {
          const Vec3 at(uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1));
          Vec3 in_low = at, in_high = at;
          in_low[direction] = 0.5 * at[direction];
          in_high[direction] = 0.5 + 0.5 * at[direction];
          CHECK((value(low, at) - value(whole, in_low)).norm() < 1e-13);
          CHECK((value(high, at) - value(whole, in_high)).norm() < 1e-13);
        }
      }
}

TEST_CASE("Halves in single precision are halves up to their bounds", "[hex_matrices]") {
  Random random(7);
  HexCoefficients whole = random_hex(random, 6, 8, kEdges, 0.2), high;
  NarrowHexCoefficients narrow = narrowed(whole), narrow_high;
  Vec3 offset = Vec3::Zero();
  for (int row = 0; row < 3; ++row) offset[row] = whole.coordinate(row)[whole.num_vectors() / 2][kWide / 2];
  for (int level = 0; level < 30; ++level) {
    whole.halve(level % 3, high);
    narrow.halve(level % 3, narrow_high);
    const auto check = [&](const NarrowHexCoefficients& of, const HexCoefficients& exact) {
      for (int row = 0; row < 3; ++row)
        for (int n = 0; n < exact.num_vectors(); ++n)
          for (int v = 0; v < kWide; ++v) {
            const double x = exact.coordinate(row)[n][v] - offset[row];
            CHECK(std::abs(of.coordinate(row)[n][v] - x) <= of.precision.errors[row]);
            CHECK(std::abs(of.coordinate(row)[n][v]) <= (1 + 1e-6) * of.precision.sizes[row]);
          }
    };
    check(narrow, whole);
    check(narrow_high, high);
    if (level % 2) std::swap(whole, high), std::swap(narrow, narrow_high);
  }
}

TEST_CASE("Matrices of a hex are the Jacobian of its map, in either precision", "[hex_matrices]") {
  Random random(2);
  HexMatrices matrices;
  NarrowHexMatrices narrow_matrices;
  for (const int num_u : {2, 3, 6, 8})
    for (const int num_w : {2, 5, 8}) {
      const HexCoefficients hex = random_hex(random, num_u, num_w, kEdges, 0.2);
      matrices.set(hex);
      const Vec3 at(uniform(random, 0.1, 0.9), uniform(random, 0.1, 0.9), uniform(random, 0.1, 0.9));
      const auto map = [&](const Vec3& x) { return value(hex, x); };
      CHECK((jacobian(matrices, hex, at) - differences(map, at)).norm() < 1e-8);
      check_loads(matrices);
      check_product(matrices.times(kAny), matrices, kAny, Vec3::Constant(1e-12));

      const NarrowHexCoefficients narrow = narrowed(hex);
      narrow_matrices.set(narrow);
      check_loads(narrow_matrices);
      const auto product = narrow_matrices.narrow_product(kAny);
      REQUIRE(product.errors().maxCoeff() <= kMostError);
      check_product(product, matrices, kAny, product.errors());
      CHECK((narrow_matrices.mean() - matrices.mean()).norm() < 1e-4);
      CHECK((narrow_matrices.variation() - matrices.variation()).norm() < 1e-3);

      Mat3 mean = Mat3::Zero();
      for (std::size_t b = 0; b < matrices.size(); ++b) mean += matrices[b] / static_cast<double>(matrices.size());
      CHECK((matrices.mean() - mean).col(0).norm() < 1e-12);
      CHECK((matrices.mean() - mean).col(2).norm() < 1e-12);
      CHECK((matrices.mean() - mean).norm() < 0.5 * mean.norm());
    }
}

TEST_CASE("How J of a hex varies is told by direction", "[hex_matrices]") {
  HexCoefficients hex;
  HexMatrices matrices;
  for (const int num : {2, 6, 8}) {
    hex.resize(num, num);
    const auto set = [&](const std::function<Vec3(const Vec3&)>& map) {
      for (int u = 0; u < num; ++u)
        for (int w = 0; w < num; ++w)
          for (int v = 0; v < kWide; ++v) {
            const Vec3 x = map(Vec3(u / (num - 1.0), v / (kWide - 1.0), w / (num - 1.0)));
            for (int row = 0; row < 3; ++row) hex.coordinate(row)[u * num + w][v] = x[row];
          }
      matrices.set(hex);
    };
    set([](const Vec3& x) { return Vec3(kEdges * x); });
    CHECK(matrices.variation().cwiseAbs().maxCoeff() < 1e-12);
    set([](const Vec3& x) { return Vec3(x[0], x[1] + 0.5 * x[0] * x[2], x[2]); });  // the slope along w goes with u
    const Mat3 varies = matrices.variation();
    CHECK(varies(0, 2) > 0.2);
    CHECK(varies(2, 0) == Approx(varies(0, 2)));
    CHECK(varies.cwiseAbs().sum() == Approx(2 * varies(0, 2)));
  }
}

TEST_CASE("Matrices of a prism are the Jacobian of its map, in either precision", "[hex_matrices]") {
  Random random(3);
  PrismMatrices matrices;
  for (const int degree : {1, 2, 5, 9, 14}) {
    const SimplexIndex& index = SimplexTables::get(2, degree).index;
    matrices.resize(degree);
    for (int n = 0; n < index.size(); ++n)
      for (int w = 0; w < kWide; ++w) {
        const auto e = index.exponents(n);
        const Vec3 place(e[1] / static_cast<double>(degree), e[2] / static_cast<double>(degree), w / (kWide - 1.0));
        const Vec3 off(uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1));
        const Vec3 x = kEdges * (place + 0.1 * off);
        for (int row = 0; row < 3; ++row) matrices.coordinate(row)[n][w] = x[row];
      }
    const auto weight = [&](int n, int w, const Vec3& at) {
      const auto e = index.exponents(n);
      double result = std::tgamma(degree + 1.0) * bernstein(kWide - 1, w, at[2]);
      const double l[3] = {1 - at[0] - at[1], at[0], at[1]};
      for (int c = 0; c < 3; ++c) result *= std::pow(l[c], e[c]) / std::tgamma(e[c] + 1.0);
      return result;
    };
    const auto map = [&](const Vec3& at) {
      Vec3 result = Vec3::Zero();
      for (int n = 0; n < index.size(); ++n)
        for (int w = 0; w < kWide; ++w)
          for (int row = 0; row < 3; ++row) result[row] += weight(n, w, at) * matrices.coordinate(row)[n][w];
      return result;
    };
    const Vec3 at(0.3, 0.45, 0.6);
    Mat3 j = Mat3::Zero(), mean = Mat3::Zero();
    for (std::size_t b = 0; b < matrices.size(); ++b) {
      j += weight(static_cast<int>(b) / kWide, static_cast<int>(b) % kWide, at) * matrices[b];
      mean += matrices[b] / static_cast<double>(matrices.size());
    }
    CHECK((j - differences(map, at)).norm() < 1e-8);
    CHECK((matrices.mean() - mean).leftCols(2).norm() < 1e-12);
    for (const std::size_t corner : matrices.corners()) CHECK(corner % kWide == 0);
    check_loads(matrices);
    check_product(matrices.times(kAny), matrices, kAny, Vec3::Constant(1e-12));
    const auto product = matrices.narrow_product(kAny);
    REQUIRE(product.errors().maxCoeff() <= kMostError);
    check_product(product, matrices, kAny, product.errors());
  }
}

TEST_CASE("Bounds of det J hold in either precision", "[hex_matrices]") {
  Random random(4);
  HexMatrices matrices;
  NarrowHexMatrices narrow_matrices;
  int found = 0, far_apart = 0;
  for (int repeat = 0; repeat < 400; ++repeat) {
    const double size = std::pow(10.0, uniform(random, -10, 10)), flat = std::pow(10.0, uniform(random, -5, 0));
    const Mat3 edges = size * kEdges * Vec3(1, 1, flat).asDiagonal();
    const HexCoefficients hex =
        random_hex(random, repeat % 2 ? 6 : 8, repeat % 3 ? 6 : 8, edges, uniform(random, 0, 0.02));
    const NarrowHexCoefficients narrow = narrowed(hex);
    matrices.set(hex);
    narrow_matrices.set(narrow);
    const Mat3 remainder = 1e-14 * edges.cwiseAbs().rowwise().sum().replicate(1, 3);
    const double full = determinant_bound(matrices, remainder, Mat3::Identity());
    const double single = determinant_bound(narrow_matrices, remainder, Mat3::Identity());
    CAPTURE(repeat, size, flat, full, single);
    if (flat > 0.01) CHECK((full > 0) == (single > 0));  // flatter ones are too close to the errors
    if (!(full > 0)) {
      CHECK(single == 0);
      continue;
    }
    ++found;
    far_apart += flat > 0.01 && std::abs(single - full) > 0.01 * full;  // another L was the first to prove it
    for (int sample = 0; sample < 20; ++sample) {
      const Vec3 at(uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1));
      CHECK(jacobian(matrices, hex, at).determinant() >= std::max(full, single));
    }
  }
  CHECK(found > 100);
  CHECK(far_apart < found / 10);
}

TEST_CASE("A bound begins with the L that is known", "[hex_matrices]") {
  Random random(8);
  HexMatrices matrices;
  const HexCoefficients hex = random_hex(random, 6, 6, kEdges, 0.005);
  matrices.set(hex);
  Mat3 l = Mat3::Zero();
  const double bound = determinant_bound(matrices, Mat3::Zero(), Mat3::Identity(), {}, &l);
  CHECK(bound > 0);
  CHECK(l != Mat3::Zero());
  const Mat3 before = l;
  CHECK(determinant_bound(matrices, Mat3::Zero(), Mat3::Identity(), {}, &l) == Approx(bound));
  CHECK(l == before);
  l = -before;  // of no use
  CHECK(determinant_bound(matrices, Mat3::Zero(), Mat3::Identity(), {}, &l) == Approx(bound));
  CHECK((l - before).norm() < 1e-12 * before.norm());
}

TEST_CASE("Nothing of a larger box counts in a smaller one", "[hex_matrices]") {
  Random random(5);
  NarrowHexMatrices matrices;
  const auto bound = [&](const HexCoefficients& hex) {
    const NarrowHexCoefficients narrow = narrowed(hex);
    matrices.set(narrow);
    return determinant_bound(matrices, Mat3::Zero(), Mat3::Identity());
  };
  for (int repeat = 0; repeat < 20; ++repeat) {  // an odd number of vectors is followed by others in the last load
    CHECK(bound(random_hex(random, 8, 8, 1e9 * kEdges, 0.005)) > 0);
    HexCoefficients small = random_hex(random, 3, 3, 1e-9 * kEdges, 0.001);
    CHECK(bound(small) > 0);
    const int vector = repeat % 9, lane = repeat % kWide;
    small.coordinate(0)[vector][lane] += 1e-9 * (vector < 3 ? 8 : -8);  // J is folded there
    CHECK(bound(small) == 0);
  }
}

TEST_CASE("What is too large or too small for single precision is left to double", "[hex_matrices]") {
  const std::vector<LocalMode> modes = corner_modes();
  HexBoxes boxes(Basis::fourier, 4);
  for (const double size : {1e-45, 1e-12, 1.0, 1e12, 1e45}) {
    boxes.set_cell(modes, straight_cell(size * kEdges));
    HexBoxes::Box root = boxes.root();
    CHECK(root.is_precise);
    REQUIRE(!boxes.is_hopeless(root));
    boxes.choose_split(root);
    auto children = boxes.children(std::move(root), boxes.mean_determinant());
    for (HexBoxes::Box& child : children) {
      CHECK(child.is_precise == (size != 1));
      // Single precision gives way to double where det J is not far above its errors.
      CHECK(!boxes.is_hopeless(child));
      boxes.with_matrices(child, [](const auto&) {});
      CHECK(!boxes.improve(child, 0.1 * boxes.mean_determinant(), false));
      CHECK(boxes.improve(child, 1e-7 * boxes.mean_determinant(), false) == (size == 1));
      CHECK(child.is_precise);
      boxes.with_matrices(child, [](const auto& matrices) {
        CHECK(std::is_same_v<std::remove_cvref_t<decltype(matrices)>, HexMatrices>);
      });
    }
  }
}

TEST_CASE("Parts that single precision does not serve go over to double", "[hex_matrices]") {
  const std::vector<LocalMode> modes = corner_modes();
  HexBoxes boxes(Basis::fourier, 2);
  boxes.set_cell(modes, straight_cell(Vec3(1, 1 / 5000.0, 1 / 5000.0).asDiagonal()));
  HexBoxes::Box root = boxes.root();
  CHECK(!boxes.is_hopeless(root));
  boxes.choose_split(root);
  for (HexBoxes::Box& child : boxes.children(std::move(root), boxes.mean_determinant())) {
    CHECK(!boxes.is_hopeless(child));
    boxes.with_matrices(child, [](const auto&) {});
    CHECK(boxes.improve(child, boxes.mean_determinant(), false));
  }
}

TEST_CASE("Boxes of a hex have the Jacobian of the cell, by models and by halves of coefficients", "[hex_matrices]") {
  Random random(6);
  for (const Basis basis : {Basis::fourier, Basis::legendre})
    for (const std::pair<int, double>& of :
         {std::pair{1, 0.0}, {3, 0.0}, {4, 0.0}, {8, 0.0}, {12, 0.0}, {3, 0.6}, {4, 0.6}, {8, 0.6}, {12, 0.9}}) {
      const int order = of.first;
      const double share_left_out = of.second;
      const BentHex hex = bent_hex(random, order, kEdges, 0.03, share_left_out);
      const std::vector<LocalMode>& modes = hex.modes;
      const std::vector<Vec3>& coefficients = hex.coefficients;
      std::vector<Vec3> others;
      for (const Vec3& x : coefficients) others.push_back(3 * x + Vec3::Ones());
      ShapeFunctions shapes(CellKind::hex, basis, order);
      const auto exact = [&](const Vec3& at) {
        shapes.set_point(at);
        Mat3 result = Mat3::Zero();
        Vec3 gradient;
        for (std::size_t a = 0; a < modes.size(); ++a) {
          shapes.value(modes[a], gradient);
          result += coefficients[a] * gradient.transpose();
        }
        return result;
      };
      HexBoxes boxes(basis, order);
      boxes.set_cell(modes, others);  // of which nothing must stay
      boxes.set_cell(modes, coefficients);
      int halved = 0, narrow_halved = 0, looked_at = 0;
      for (int walk = 0; walk < 80; ++walk) {
        HexBoxes::Box box = boxes.root();
        for (int level = 0; level < 9; ++level) {
          double lowest = -std::numeric_limits<double>::infinity();
          if (!boxes.is_hopeless(box)) {
            ++looked_at;
            (box.is_precise ? halved : narrow_halved) += box.halved > 0 && (box.coefficients || box.narrow);
            const auto look = [&] {
              const Mat3 remainder = boxes.remainder(box);
              const Vec3 local(uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1));
              const Vec3 low = HexBoxes::corner_point(box, 0), high = HexBoxes::corner_point(box, 7);
              const Mat3 wanted = exact(low + local.cwiseProduct(high - low)) * (high - low).asDiagonal();
              CAPTURE(basis, order, share_left_out, level, box.halved, box.is_precise);
              const auto check = [&](const Mat3& j, const Vec3& more) {
                const Mat3 error = (j - wanted).cwiseAbs();
                CHECK((error.array() <= remainder.array() + more.replicate(1, 3).array() + 1e-14).all());
              };
              boxes.with_matrices(box, [&]<class Matrices>(const Matrices& matrices) {
                if constexpr (std::is_same_v<Matrices, HexMatrices>) {
                  check(jacobian(matrices, *box.coefficients, local), Vec3::Zero());
                } else {
                  const Vec3 errors = NarrowHexMatrices::entry_errors(box.narrow->precision);
                  check(jacobian(matrices, *box.narrow, local), errors);
                }
              });
            };
            look();
            if (box.narrow) check_narrow(boxes, box);
            // In double precision, the box has models of its own.
            if (walk % 3 == 0 && level > 2 && boxes.improve(box, 1e-9 * boxes.mean_determinant(), false)) look();
            const Vec3 low = HexBoxes::corner_point(box, 0), high = HexBoxes::corner_point(box, 7);
            CHECK(boxes.determinant_scale(box) * (high - low).prod() == Approx(1));
            lowest = walk % 2 ? 0.3 * boxes.mean_determinant() : 1e-3 * boxes.mean_determinant();
          }
          boxes.choose_split(box);
          auto children = boxes.children(std::move(box), lowest);
          box = std::move(children[uniform(random, 0, 1) < 0.5 ? 0 : 1]);
        }
      }
      CHECK(looked_at > 20);
      CHECK(halved > 10);
      CHECK(narrow_halved > 10);
    }
}
