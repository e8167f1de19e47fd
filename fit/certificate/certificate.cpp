// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/certificate.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/fit/certificate/bernstein.h"

#include <algorithm>
#include <string>

namespace subvol {

using namespace internal;

namespace {

using bernstein::EdgeLengths;
using bernstein::Vector;

/// Bounds on det J from a cell's own coefficients.
struct Bounds {
  double coefficient, corner, scale;  // least coefficient, least corner value, unit of the rounding margin

  CellValidity validity() const {
    const double margin = bernstein::rounding_margin(scale, 0);
    if (coefficient > margin) return CellValidity::valid;
    return corner < -margin ? CellValidity::invalid : CellValidity::undecided;
  }
};

template <std::size_t N>
std::array<Vector<double>, N> gather(std::span<const Vec3> corners) {
  std::array<Vector<double>, N> x;
  for (std::size_t v = 0; v < N; ++v) x[v] = {corners[v][0], corners[v][1], corners[v][2]};
  return x;
}

/// Coefficients of a cell of any kind; the first `count` entries of the array are used.
struct Coefficients {
  std::array<double, 27> d;
  int count;
  double scale;
};

Coefficients coefficients(CellKind kind, std::span<const Vec3> corners) {
  Coefficients result;
  EdgeLengths<double> lengths;
  const auto keep = [&](const auto& d) {
    std::copy(d.begin(), d.end(), result.d.begin());
    result.count = static_cast<int>(d.size());
  };
  if (kind == CellKind::hex) {
    std::array<double, 27> d;
    bernstein::hex_coefficients(gather<8>(corners), d, lengths);
    keep(d);
  } else if (kind == CellKind::prism) {
    std::array<double, 9> d;
    bernstein::prism_coefficients(gather<6>(corners), d, lengths);
    keep(d);
  } else if (kind == CellKind::pyramid) {
    std::array<double, 4> d;
    bernstein::pyramid_coefficients(gather<5>(corners), d, lengths);
    keep(d);
  } else {
    std::array<double, 1> d;
    bernstein::tet_coefficients(gather<4>(corners), d, lengths);
    keep(d);
  }
  result.scale = bernstein::length_scale(lengths);
  return result;
}

bool is_corner(CellKind kind, int index) {
  if (kind == CellKind::hex) return index % 3 != 1 && index / 3 % 3 != 1 && index / 9 != 1;
  return kind != CellKind::prism || index % 3 != 1;
}

Bounds bounds(CellKind kind, std::span<const Vec3> corners) {
  const Coefficients c = coefficients(kind, corners);
  Bounds result{c.d[0], c.d[0], c.scale};
  for (int i = 1; i < c.count; ++i) {
    result.coefficient = std::min(result.coefficient, c.d[i]);
    if (is_corner(kind, i)) result.corner = std::min(result.corner, c.d[i]);
  }
  return result;
}

/// Computes `bounds` of kSimdLanes hexes at once, with the same operations in each lane.
void bounds_of_hexes(std::span<const Vec3> positions, const Index* vertices, Bounds* out) {
  std::array<Lanes, 27> d;
  EdgeLengths<Lanes> lengths;
  bernstein::hex_coefficients(gather_hexes(positions, vertices), d, lengths);
  Lanes coefficient = d[0], corner = d[0];
  for (int i = 1; i < 27; ++i) {
    coefficient = smaller(coefficient, d[i]);
    if (is_corner(CellKind::hex, i)) corner = smaller(corner, d[i]);
  }
  for (int lane = 0; lane < kSimdLanes; ++lane) {
    const auto& m = lengths.squared_max;
    const EdgeLengths<double> own{{m[0][lane], m[1][lane], m[2][lane]}, lengths.squared_sum[lane]};
    out[lane] = {coefficient[lane], corner[lane], bernstein::length_scale(own)};
  }
}

/// Calls visit(cell, bounds) for every cell, in parallel.
template <class Visit>
void for_each_cell_bounds(std::span<const Vec3> positions, const VolumeMesh& mesh, const Visit& visit) {
  const auto hexes = [&](std::size_t first) {
    Bounds result[kSimdLanes];
    bounds_of_hexes(positions, mesh.cell(first).data(), result);
    for (int lane = 0; lane < kSimdLanes; ++lane) visit(first + lane, result[lane]);
  };
  for_each_cell_block(mesh, hexes, [&](std::size_t c) {
    const auto corners = gather_cell(positions, mesh, c);
    visit(c, bounds(mesh.kinds[c], {corners.data(), mesh.cell(c).size()}));
  });
}

/// det J in extended precision, and a bound on its error.
struct Evaluated {
  long double value, margin;
};

Evaluated evaluate(CellKind kind, std::span<const Vec3> x, const Vec3& at, double scale) {
  using Wide = Vector<long double>;
  const long double u = at[0], v = at[1], w = at[2];
  Wide column[3] = {};
  const auto add = [&](int direction, long double weight, int to, int from) {
    for (int axis = 0; axis < 3; ++axis)
      column[direction][axis] += weight * (static_cast<long double>(x[to][axis]) - x[from][axis]);
  };
  if (kind == CellKind::hex) {
    for (int m = 0; m < 2; ++m)
      for (int n = 0; n < 2; ++n) {
        using bernstein::hex_corner;
        add(0, (m ? v : 1 - v) * (n ? w : 1 - w), hex_corner(1, m, n), hex_corner(0, m, n));
        add(1, (m ? u : 1 - u) * (n ? w : 1 - w), hex_corner(m, 1, n), hex_corner(m, 0, n));
        add(2, (m ? u : 1 - u) * (n ? v : 1 - v), hex_corner(m, n, 1), hex_corner(m, n, 0));
      }
  } else if (kind == CellKind::prism) {
    for (int m = 0; m < 2; ++m)
      for (int d = 0; d < 2; ++d) add(d, m ? w : 1 - w, 3 * m + d + 1, 3 * m);
    const long double triangle[3] = {1 - u - v, u, v};
    for (int i = 0; i < 3; ++i) add(2, triangle[i], i + 3, i);
  } else if (kind == CellKind::pyramid) {  // dx/dw but for multiples of the other columns
    for (int m = 0; m < 2; ++m) {
      add(0, m ? v : 1 - v, bernstein::hex_corner(1, m, 0), bernstein::hex_corner(0, m, 0));
      add(1, m ? u : 1 - u, bernstein::hex_corner(m, 1, 0), bernstein::hex_corner(m, 0, 0));
      for (int n = 0; n < 2; ++n) add(2, (m ? u : 1 - u) * (n ? v : 1 - v), 4, bernstein::hex_corner(m, n, 0));
    }
  } else {
    for (int d = 0; d < 3; ++d) add(d, 1, d + 1, 0);
  }
  // An interpolated column has at most 9 roundings and the determinant 5 more: fewer than 35 units of roundoff of the
  // type per product, as in rounding_margin. This also holds if long double is double.
  constexpr long double u_wide = std::numeric_limits<long double>::epsilon() / 2;
  return {bernstein::dot(column[0], bernstein::cross(column[1], column[2])), 48 * u_wide * scale};
}

/// One dyadic box of a cell that is not decided yet. Hexes: a cube of coefficients; prisms: the quadratics of three
/// edges.
template <std::size_t N>
struct Box {
  std::array<double, N> d;
  std::array<double, 3> origin;
  int level;
};

/// Bisects a quadratic with the given stride in place: `low` keeps [0, 1/2], `high` becomes [1/2, 1].
void halve(double* low, double* high, int stride) {
  const double d0 = low[0], d1 = low[stride], d2 = low[2 * stride];
  const double left = 0.5 * (d0 + d1), right = 0.5 * (d1 + d2), middle = 0.5 * (left + right);
  low[stride] = left;
  low[2 * stride] = middle;
  high[0] = middle;
  high[stride] = right;
  high[2 * stride] = d2;
}

void split(const Box<27>& box, std::array<Box<27>, 8>& children) {
  children[0] = box;
  int count = 1;
  for (int axis = 0, stride = 9; axis < 3; ++axis, stride /= 3, count *= 2)
    for (int c = 0; c < count; ++c) {
      children[count + c] = children[c];
      children[count + c].origin[axis] += std::ldexp(0.5, -box.level);
      for (int line = 0; line < 9; ++line) {
        const int first = axis == 0 ? line : axis == 1 ? 9 * (line / 3) + line % 3 : 3 * line;
        halve(&children[c].d[first], &children[count + c].d[first], stride);
      }
    }
  for (auto& child : children) child.level = box.level + 1;
}

void split(const Box<9>& box, std::array<Box<9>, 2>& children) {
  children = {box, box};
  children[1].origin[2] += std::ldexp(0.5, -box.level);
  for (int i = 0; i < 3; ++i) halve(&children[0].d[3 * i], &children[1].d[3 * i], 1);
  for (auto& child : children) child.level = box.level + 1;
}

/// Canonical coordinates of the corner coefficient `index` of a box.
Vec3 corner_point(const Box<27>& box, int index) {
  const double size = std::ldexp(1.0, -box.level);
  return {box.origin[0] + size * (index / 9 / 2), box.origin[1] + size * (index / 3 % 3 / 2),
          box.origin[2] + size * (index % 3 / 2)};
}
Vec3 corner_point(const Box<9>& box, int index) {
  const int i = index / 3;
  return {i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0, box.origin[2] + std::ldexp(1.0, -box.level) * (index % 3 / 2)};
}

/// Breadth-first search for the sign of det J over one cell: a witness is found at the coarsest level that has one.
template <std::size_t N, std::size_t NumChildren>
class Search {
 public:
  Search(CellKind kind, std::span<const Vec3> corners, double scale) : kind_(kind), corners_(corners), scale_(scale) {}

  CellCertificate run(const Coefficients& root, const CertificateOptions& options) {
    Box<N> box{{}, {0, 0, 0}, 0};
    std::copy_n(root.d.begin(), N, box.d.begin());
    std::vector<Box<N>> queue{box};
    std::array<Box<N>, NumChildren> children;
    result_.lower_bound = std::numeric_limits<double>::infinity();
    bool open = false;
    for (std::size_t next = 0; next < queue.size() && !refuted_; ++next) {
      box = queue[next];
      const double bound = look_at(box);
      const bool may_split =
          box.level < options.max_depth && queue.size() < static_cast<std::size_t>(options.max_boxes);
      if (bound > 0 || !may_split) {
        result_.lower_bound = std::min(result_.lower_bound, bound);
        open = open || !(bound > 0);
      } else {
        split(box, children);
        queue.insert(queue.end(), children.begin(), children.end());
      }
    }
    if (refuted_) result_.lower_bound = *std::min_element(queue[0].d.begin(), queue[0].d.end());
    result_.validity = refuted_ ? CellValidity::invalid : open ? CellValidity::undecided : CellValidity::valid;
    return result_;
  }

 private:
  /// Returns a lower bound of det J over the box; records the lowest corner met, and whether it refutes the cell.
  double look_at(const Box<N>& box) {
    int lowest = 0;
    double least = box.d[0];
    for (int i = 1; i < static_cast<int>(N); ++i) {
      least = std::min(least, box.d[i]);
      if (is_corner(kind_, i) && box.d[i] < box.d[lowest]) lowest = i;
    }
    if (result_.boxes++ == 0 || box.d[lowest] < lowest_) {
      lowest_ = box.d[lowest];
      result_.witness = corner_point(box, lowest);
      const Evaluated exact = evaluate(kind_, corners_, result_.witness, scale_);
      result_.witness_determinant = static_cast<double>(exact.value);
      refuted_ = exact.value < -exact.margin;
    }
    return least - bernstein::rounding_margin(scale_, box.level);
  }

  CellKind kind_;
  std::span<const Vec3> corners_;
  double scale_, lowest_ = 0;
  bool refuted_ = false;
  CellCertificate result_;
};

/// For tets and pyramids, whose coefficients are all values of det J.
CellCertificate certify_by_corners(CellKind kind, std::span<const Vec3> corners, const Coefficients& c) {
  CellCertificate result;
  const auto lowest = static_cast<int>(std::min_element(c.d.begin(), c.d.begin() + c.count) - c.d.begin());
  result.witness = Vec3(lowest / 2, lowest % 2, 0);
  const Evaluated exact = evaluate(kind, corners, result.witness, c.scale);
  result.boxes = 1;
  result.witness_determinant = static_cast<double>(exact.value);
  result.lower_bound = c.d[lowest] - bernstein::rounding_margin(c.scale, 0);
  if (result.lower_bound > 0) result.validity = CellValidity::valid;
  if (exact.value < -exact.margin) result.validity = CellValidity::invalid;
  return result;
}

CellCertificate certify_checked(CellKind kind, std::span<const Vec3> corners, const CertificateOptions& options) {
  const Coefficients c = coefficients(kind, corners);
  if (!std::isfinite(c.scale)) {
    CellCertificate result;
    result.lower_bound = -c.scale;
    return result;
  }
  if (kind == CellKind::hex) return Search<27, 8>(kind, corners, c.scale).run(c, options);
  if (kind == CellKind::prism) return Search<9, 2>(kind, corners, c.scale).run(c, options);
  return certify_by_corners(kind, corners, c);
}

void check_corners(CellKind kind, std::span<const Vec3> corners) {
  const CellTopology& topology = cell_topology(kind);
  if (corners.size() != static_cast<std::size_t>(topology.num_vertices))
    throw InputError("certificate: a " + std::string(topology.name) + " has " + std::to_string(topology.num_vertices) +
                     " corners, got " + std::to_string(corners.size()));
}

void check_size(const char* what, std::size_t size, std::size_t expected, bool or_more) {
  if (or_more ? size < expected : size != expected)
    throw InputError("certificate: " + std::to_string(size) + " " + what + ", expected " + std::to_string(expected));
}

}  // namespace

void check_options(const CertificateOptions& options) {
  if (options.max_depth < 0 || options.max_depth > 50)
    throw InputError("certificate: max_depth is " + std::to_string(options.max_depth) + ", expected 0 to 50");
  if (options.max_boxes < 1)
    throw InputError("certificate: max_boxes is " + std::to_string(options.max_boxes) + ", expected 1 or more");
}

const char* to_string(CellValidity validity) {
  constexpr const char* kValidityNames[] = {"valid", "invalid", "undecided"};
  return kValidityNames[static_cast<int>(validity)];
}

CellCertificate certify_cell(CellKind kind, std::span<const Vec3> corners, const CertificateOptions& options) {
  check_options(options);
  check_corners(kind, corners);
  return certify_checked(kind, corners, options);
}

double min_bernstein(CellKind kind, std::span<const Vec3> corners) {
  check_corners(kind, corners);
  return bounds(kind, corners).coefficient;
}

CertificateSummary summarize(std::span<const CellValidity> cells) {
  CertificateSummary summary;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    ++(cells[c] == CellValidity::valid     ? summary.certified
       : cells[c] == CellValidity::invalid ? summary.invalid
                                           : summary.undecided);
    if (cells[c] == CellValidity::invalid) summary.invalid_cells.push_back(static_cast<Index>(c));
    if (cells[c] != CellValidity::valid) summary.not_certified.push_back(static_cast<Index>(c));
  }
  return summary;
}

CertificateSummary certify(std::span<const Vec3> positions, const VolumeMesh& mesh, const CertificateOptions& options) {
  check_options(options);
  check_size("positions", positions.size(), mesh.num_vertices(), true);
  std::vector<CellValidity> validity(mesh.num_cells());
  for_each_cell_bounds(positions, mesh, [&](std::size_t c, const Bounds& b) { validity[c] = b.validity(); });
  std::vector<std::size_t> open;
  for (std::size_t c = 0; c < validity.size(); ++c)
    if (validity[c] == CellValidity::undecided) open.push_back(c);
  if (options.max_depth > 0) {
    ParallelErrors errors;
#pragma omp parallel for schedule(dynamic, 16)
    for (std::size_t i = 0; i < open.size(); ++i)
      errors.guard([&] {
        const std::size_t c = open[i];
        const auto corners = gather_cell(positions, mesh, c);
        validity[c] = certify_checked(mesh.kinds[c], {corners.data(), mesh.cell(c).size()}, options).validity;
      });
    errors.rethrow();
  }
  return summarize(validity);
}

CertificateSummary certify(const VolumeMesh& mesh, const CertificateOptions& options) {
  return certify(mesh.positions, mesh, options);
}

std::size_t positive_bernstein(std::span<const Vec3> positions, const VolumeMesh& mesh,
                               std::span<std::uint8_t> positive) {
  check_size("positions", positions.size(), mesh.num_vertices(), true);
  check_size("flags", positive.size(), mesh.num_cells(), false);
  for_each_cell_bounds(positions, mesh,
                       [&](std::size_t c, const Bounds& b) { positive[c] = b.validity() == CellValidity::valid; });
  return static_cast<std::size_t>(std::count(positive.begin(), positive.end(), 0));
}

void min_bernstein(std::span<const Vec3> positions, const VolumeMesh& mesh, std::span<double> minima) {
  check_size("positions", positions.size(), mesh.num_vertices(), true);
  check_size("minima", minima.size(), mesh.num_cells(), false);
  for_each_cell_bounds(positions, mesh, [&](std::size_t c, const Bounds& b) { minima[c] = b.coefficient; });
}

}  // namespace subvol
