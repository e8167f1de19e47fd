// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/simplex_boxes.h"

#include "subvol/fit/elements/element_rule.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace subvol::internal {

namespace {

constexpr std::size_t kDoublesAtOnce = SimplexTables::kControlPointLanes;
using FourDoubles = double __attribute__((vector_size(kDoublesAtOnce * sizeof(double))));

FourDoubles load_lanes(const double* from) {
  FourDoubles result;
  std::memcpy(&result, from, sizeof result);
  return result;
}
void store_lanes(const FourDoubles& value, double* to) { std::memcpy(to, &value, sizeof value); }

/// Turns rows into columns.
void transpose(FourDoubles (&x)[kDoublesAtOnce]) {
  const FourDoubles a = __builtin_shufflevector(x[0], x[1], 0, 4, 2, 6);
  const FourDoubles b = __builtin_shufflevector(x[0], x[1], 1, 5, 3, 7);
  const FourDoubles c = __builtin_shufflevector(x[2], x[3], 0, 4, 2, 6);
  const FourDoubles d = __builtin_shufflevector(x[2], x[3], 1, 5, 3, 7);
  x[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  x[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  x[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  x[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

/// Model errors up to this share of the mean edges count as small as long as nothing is known about det J. At high
/// orders, low degrees cost more in boxes than they save (measured).
double small_error(int order) { return order <= 4 ? 0.08 : 0.004; }
/// No bound is expected beyond this relative model error, because of the shifts of `determinant_bound` (see
/// `HexBoxes`).
constexpr double kHopelessSimplexError = 1;
/// New models need not reduce the error by more than this factor: the next ones will.
constexpr double kEnoughErrorFall = 0.05;

}  // namespace

/// Along a prism's w, models have the degree whose coefficients are one `Wide`.
SimplexBoxes::SimplexBoxes(CellKind kind, Basis basis, int order)
    : kind_(kind),
      simplex_(SimplexModels::get(kind, basis, order)),
      line_(LineModels::get(basis, order, kWide - 1)),
      num_layers_(kind == CellKind::tet ? 1 : order + 1),
      lanes_(rounded_up(3 * num_layers_, kDoublesAtOnce)),
      small_error_(small_error(order)),
      whole_models_(simplex_.num_tiers()) {
  layer_terms_.resize(num_layers_);
}

void SimplexBoxes::set_modes(std::span<const LocalMode> modes) {
  of_modes_ = modes;
  places_.clear();
  linear_modes_.clear();
  const bool prism = kind_ == CellKind::prism;
  for (std::size_t a = 0; a < modes.size(); ++a) {
    const LocalMode& mode = modes[a];
    places_.push_back({prism ? mode.k : 0, simplex_.slot(mode), simplex_.own_order(mode)});
    if (mode.edge >= 0 || (prism && mode.k > 1)) continue;
    Eigen::RowVector3d gradient = Eigen::RowVector3d::Zero();
    if (mode.vertex > 0)
      gradient[mode.vertex - 1] = prism ? 0.5 : 1;
    else
      gradient.head(simplex_.dimension()).setConstant(prism ? -0.5 : -1);
    if (prism) gradient[2] = (mode.k == 1 ? 1 : -1) / 3.0;
    linear_modes_.push_back({a, gradient});
  }
}

void SimplexBoxes::set_cell(std::span<const LocalMode> modes, std::span<const Vec3> coefficients) {
  if (modes.data() != of_modes_.data() || modes.size() != of_modes_.size()) set_modes(modes);
  num_modes_ = highest_ = 0;
  for (auto& layer : layer_terms_) layer.clear();
  for (std::size_t a = 0; a < modes.size(); ++a) {
    if (coefficients[a] == Vec3::Zero()) continue;
    ++num_modes_;
    highest_ = std::max(highest_, places_[a].order);
    layer_terms_[places_[a].layer].push_back({places_[a].slot, places_[a].order, coefficients[a]});
  }
  Mat3 edges = Mat3::Zero();
  for (const LinearMode& mode : linear_modes_) edges += coefficients[mode.number] * mode.gradient;
  mean_edges_ = edges.colwise().norm().transpose();
}

Mat3 SimplexBoxes::lasting_error(const Box& box) const {
  Mat3 result = Mat3::Zero();
  for (int k = 0; k < num_layers_; ++k) {
    const Layer& layer = (*box.layers)[k];
    const bool prism = kind_ == CellKind::prism;
    const Vec3 across = layer.gradient_error * (prism ? line_.bounds()[k] : 1);
    const Vec3 along = prism ? Vec3(layer.error * line_.slope_bounds()[k]) : across;
    result += (Mat3() << across, across, along).finished();
  }
  return result;
}

bool SimplexBoxes::is_stuck_at(const Box& box, const Mat3& mean) {
  const Mat3 lasting = lasting_error(box);
  if (lasting.maxCoeff() == 0) return false;
  mean_.resize(kWide);
  for (int row = 0; row < 3; ++row)
    for (int d = 0; d < 3; ++d) std::fill_n(mean_.entries(row, d), kWide, mean(row, d));
  return mean.determinant() > 0 && determinant_bound(mean_, lasting * sides(box).cwiseAbs(), frame(box)) == 0;
}

SimplexBoxes::Box SimplexBoxes::root() {
  Box box;
  const auto vertices = canonical_vertices(kind_);
  std::copy_n(vertices.begin(), simplex_.dimension() + 1, box.vertices.begin());
  take_models(box, small_error_, 0);
  return box;
}

int SimplexBoxes::choose_tier(const Box& box, const SimplexModels::Part& part, double wanted, int least_tier) const {
  const int last = simplex_.num_tiers() - 1;
  if (simplex_.is_exact()) {  // one degree more than needed brings control points much closer to the map
    int tier = 0;
    while (tier < last && simplex_.tables(tier).index.degree() < highest_ + 2) ++tier;
    return tier;
  }
  if (!(mean_edges_.minCoeff() > 0)) return 0;
  const Vec3 inverse = mean_edges_.cwiseInverse();
  Wide errors{};
  for (int k = 0; k < num_layers_; ++k) {
    const bool prism = kind_ == CellKind::prism;
    const double across = inverse[0] + inverse[1] + (prism ? 0 : inverse[2]), along = prism ? inverse[2] : 0;
    Wide value{}, gradient{};
    for (const Term& term : layer_terms_[k]) {
      const double* e = part.errors.data() + 2 * SimplexModels::kMostSimplexTiers * term.slot;
      const double size = term.coefficient.cwiseAbs().sum();
      value += size * load_wide(e);
      gradient += size * load_wide(e + SimplexModels::kMostSimplexTiers);
    }
    errors += gradient * (across * (prism ? line_.bounds()[k] : 1)) + value * (along * line_.slope_bounds()[k]);
  }
  for (int tier = least_tier; tier <= last; ++tier)
    if (errors[tier] <= wanted) return tier;
  const bool parts_follow = box.halvings + simplex_.halvings_between() <= simplex_.most_halvings();
  return parts_follow && !(errors[last] <= kHopelessSimplexError) ? -1 : last;
}

void SimplexBoxes::take_models(Box& box, double wanted, int least_tier) {
  const bool whole = box.part == 1;
  if (whole && !whole_) whole_ = simplex_.part(box.part, box.vertices);
  const auto part = whole ? whole_ : simplex_.part(box.part, box.vertices);
  box.tier = choose_tier(box, *part, wanted, least_tier);
  box.modeled = box.halvings;
  if (box.tier < 0) {
    box.layers.reset();
    box.control.clear();
    return;
  }
  SimplexModels::Models own;
  SimplexModels::Models& models = whole ? whole_models_[box.tier] : own;
  simplex_.add_models(box.part, box.vertices, *part, box.tier, highest_, models);

  std::vector<Layer> layers(num_layers_);
  for (int k = 0; k < num_layers_; ++k) {
    Layer& layer = layers[k];
    for (const Term& term : layer_terms_[k]) {
      const auto& f = part->functions[term.slot];
      const auto& batch = *models[term.order];
      const auto& model = batch.sizes[term.slot - batch.first];
      const Vec3 size = term.coefficient.cwiseAbs();
      layer.value_bound += f.value_bound * size;
      layer.gradient_bound += f.gradient_bound * size;
      layer.error += part->error(term.slot, box.tier) * size;
      layer.gradient_error += part->gradient_error(term.slot, box.tier) * size;
      layer.largest_coefficient += model.largest_coefficient * size;
      layer.rounding += model.rounding * size;
    }
  }
  box.layers = std::make_shared<const std::vector<Layer>>(std::move(layers));

  const std::size_t stride = tables(box).stride;
  box.control.assign(stride * lanes_, 0);
  constexpr int kVectorSumsAtOnce = 4;  // the sums of a single vector would wait for each other
  for (int k = 0; k < num_layers_; ++k) {
    used_.clear();
    for (const Term& term : layer_terms_[k]) {
      const auto& batch = *models[term.order];
      if (!part->functions[term.slot].is_left_out(box.tier))
        used_.push_back({batch.coefficients.data() + batch.address(term.slot, 0), batch.step(), term.coefficient});
    }
    std::size_t first = 0;
    const std::size_t end = stride / kWide;
    for (; first + kVectorSumsAtOnce <= end; first += kVectorSumsAtOnce)
      store_sums<kVectorSumsAtOnce>(used_, first, box.control.data() + k);
    for (; first < end; ++first) store_sums<1>(used_, first, box.control.data() + k);
  }
}

template <int count>
void SimplexBoxes::store_sums(std::span<const Weighted> models, std::size_t first, double* control) const {
  Wide sums[count][3] = {};
  for (const Weighted& f : models)
    for (int i = 0; i < count; ++i) {
      const Wide b = load_wide(f.model + (first + i) * f.step);
      for (int row = 0; row < 3; ++row) sums[i][row] += f.coefficient[row] * b;
    }
  double* out = control + first * kWide * lanes_;
  for (int i = 0; i < count; ++i, out += kWide * lanes_) {
    if (num_layers_ > 1) {
      for (int n = 0; n < kWide; ++n)
        for (int row = 0; row < 3; ++row) out[n * lanes_ + row * num_layers_] = sums[i][row][n];
    } else {
      FourDoubles low[kDoublesAtOnce] = {}, high[kDoublesAtOnce] = {};
      for (int row = 0; row < 3; ++row) {
        low[row] = __builtin_shufflevector(sums[i][row], sums[i][row], 0, 1, 2, 3);
        high[row] = __builtin_shufflevector(sums[i][row], sums[i][row], 4, 5, 6, 7);
      }
      transpose(low);
      transpose(high);
      for (std::size_t n = 0; n < kDoublesAtOnce; ++n) {
        store_lanes(low[n], out + n * kDoublesAtOnce);
        store_lanes(high[n], out + (kDoublesAtOnce + n) * kDoublesAtOnce);
      }
    }
  }
}

bool SimplexBoxes::improve(Box& box, double lowest, bool) {
  if (simplex_.is_exact() || box.tier < 0 || box.modeled != box.halvings || box.tier + 1 >= simplex_.num_tiers() ||
      !models_matter(box, lowest))
    return false;
  const double error = by_mean_edges(lasting_error(box));
  take_models(box, std::max(wanted_error(lowest / mean_edges_.prod()), kEnoughErrorFall * error), box.tier + 1);
  return true;
}

/// Errors are relative to the mean edges, and det J to their product.
bool SimplexBoxes::models_matter(const Box& box, double lowest) const {
  const double error = by_mean_edges(lasting_error(box));
  return error > 0 && !(error <= wanted_error(lowest / mean_edges_.prod()));
}

/// Largest error allowed if the lowest relative det J is this; -infinity: it is unknown.
double SimplexBoxes::wanted_error(double lowest) const {
  // The error may be kModelErrorShare of the lowest determinant, at most of kGoodSimplexDeterminant, relative to the
  // cell's mean determinant.
  constexpr double kGoodSimplexDeterminant = 0.3;
  if (lowest == -std::numeric_limits<double>::infinity()) return small_error_;
  return std::max(kModelErrorShare * std::min(lowest, kGoodSimplexDeterminant), kLeastModelError);
}

std::array<SimplexBoxes::Box, 2> SimplexBoxes::children(Box box, double lowest) {
  const Mat3 ideal = ideal_matrix(kind_);
  int a = 0, b = 1;
  double longest = 0;
  for (int i = 0; i <= simplex_.dimension(); ++i)
    for (int j = i + 1; j <= simplex_.dimension(); ++j) {
      const double length = (ideal * (box.vertices[j] - box.vertices[i])).norm();
      if (length > longest * (1 + 1e-9)) longest = length, a = i, b = j;
    }
  ++box.level;
  if (kind_ == CellKind::prism && box.w_level < LineModels::kMaxLevel && std::ldexp(1.0, -box.w_level) > longest) {
    ++box.w_level;
    box.w_index *= 2;
    std::array<Box, 2> result{box, std::move(box)};
    ++result[1].w_index;
    return result;
  }
  ++box.halvings;
  const bool numbered = box.halvings <= simplex_.most_halvings();
  const bool modeled =
      numbered && box.halvings % simplex_.halvings_between() == 0 && (box.tier < 0 || models_matter(box, lowest));
  const double wanted = std::max(wanted_error(lowest / mean_edges_.prod()),
                                 modeled && box.tier >= 0 ? kEnoughErrorFall * by_mean_edges(lasting_error(box)) : 0);
  AlignedDoubles control = std::move(box.control);
  box.control.clear();
  std::array<Box, 2> result{box, std::move(box)};
  result[0].vertices[b] = result[1].vertices[a] = 0.5 * (result[0].vertices[a] + result[0].vertices[b]);
  if (numbered) {
    result[0].part *= 2;
    result[1].part = result[0].part + 1;
  }
  if (modeled) {
    for (Box& half : result) take_models(half, wanted, 0);
  } else if (result[0].tier >= 0) {
    result[1].control = control;
    result[0].control = std::move(control);
    halve_control(tables(result[0]).halving(a, b), result[0].control, result[1].control);
  }
  return result;
}

void SimplexBoxes::halve_control(const SimplexHalving& halving, AlignedDoubles& low, AlignedDoubles& high) const {
  for (const SimplexHalving::Round& round : halving.rounds) {
    for (const auto& [n, other] : round.means)
      for (std::size_t lane = 0; lane < lanes_; lane += kDoublesAtOnce) {
        double* x = low.data() + n * lanes_ + lane;
        store_lanes(0.5 * (load_lanes(x) + load_lanes(low.data() + other * lanes_ + lane)), x);
      }
    for (const auto& [from, to] : round.copies)
      for (std::size_t lane = 0; lane < lanes_; lane += kDoublesAtOnce)
        store_lanes(load_lanes(low.data() + from * lanes_ + lane), high.data() + to * lanes_ + lane);
  }
}

Vec3 SimplexBoxes::corner_point(const Box& box, int corner) const {
  if (kind_ == CellKind::tet) return box.vertices[corner];
  return box.vertices[corner % 3] + std::ldexp(box.w_index + corner / 3, -box.w_level) * Vec3::UnitZ();
}

std::size_t TetBoxes::corner_matrix(const Box& box, int corner) const {
  SimplexIndex::Exponents e{};
  const SimplexIndex& index = tables(box).lower;
  e[corner] = static_cast<std::int8_t>(index.degree());
  return static_cast<std::size_t>(index.find(e));
}

std::size_t PrismBoxes::corner_matrix(const Box&, int corner) const {
  return matrices_.corners()[corner % 3] + static_cast<std::size_t>(corner / 3 * (kWide - 1));
}

ControlMatrices& TetBoxes::matrices(const Box& box) {
  const SimplexTables& t = tables(box);
  matrices_.resize(t.lower.size());
  const double* x = box.control.data();
  const FourDoubles degree = FourDoubles{} + t.index.degree();
  for (std::size_t first = 0; first < t.raised[0].size(); first += kDoublesAtOnce) {
    FourDoubles columns[3][kDoublesAtOnce];
    for (std::size_t n = 0; n < kDoublesAtOnce; ++n) {
      const FourDoubles origin = load_lanes(x + t.raised[0][first + n] * kDoublesAtOnce);
      for (int d = 0; d < 3; ++d)
        columns[d][n] = degree * (load_lanes(x + t.raised[d + 1][first + n] * kDoublesAtOnce) - origin);
    }
    for (int d = 0; d < 3; ++d) {
      transpose(columns[d]);
      for (int row = 0; row < 3; ++row) store_lanes(columns[d][row], matrices_.entries(row, d) + first);
    }
  }
  return matrices_;
}

PrismMatrices& PrismBoxes::matrices(const Box& box) {
  const double* table = line_.coefficients(line_.level(box.w_level), box.w_index);
  const SimplexIndex& index = tables(box).index;
  matrices_.resize(index.degree());
  Wide* const result[3] = {matrices_.coordinate(0), matrices_.coordinate(1), matrices_.coordinate(2)};
  for (int n = 0; n < index.size(); ++n) {
    const double *x = box.control.data() + n * lanes_, *y = x + num_layers_, *z = y + num_layers_;
    Wide sums[3] = {};
    for (int k = 0; k < num_layers_; ++k) {
      const Wide b = load_wide(table + k * LineModels::kStride);
      sums[0] += x[k] * b, sums[1] += y[k] * b, sums[2] += z[k] * b;
    }
    for (int row = 0; row < 3; ++row) result[row][n] = sums[row];
  }
  return matrices_;
}

Mat3 SimplexBoxes::sides(const Box& box) const {
  Mat3 result;
  for (int d = 0; d < 3; ++d) result.col(d) = box.vertices[d + 1] - box.vertices[0];
  if (kind_ == CellKind::prism) result.col(2) = std::ldexp(1.0, -box.w_level) * Vec3::UnitZ();
  return result;
}

Mat3 SimplexBoxes::frame(const Box& box) const { return (ideal_matrix(kind_) * sides(box)).inverse(); }

double SimplexBoxes::determinant_scale(const Box& box) const { return 1 / sides(box).determinant(); }

Mat3 SimplexBoxes::modeling_error(const Box& box) const {
  if (kind_ == CellKind::tet) return lasting_error(box);
  const LineModels::Errors& errors = line_.level(box.w_level).errors[LineModels::zone(box.w_level, box.w_index)];
  Mat3 result = Mat3::Zero();
  for (int k = 0; k < num_layers_; ++k) {
    const Layer& layer = (*box.layers)[k];
    const double n = line_.bounds()[k], error = errors.value[k], slope_error = errors.slope[k];
    const Vec3 across = layer.gradient_bound * error + layer.gradient_error * (n + error);
    const Vec3 along = layer.value_bound * slope_error + layer.error * (line_.slope_bounds()[k] + slope_error);
    result += (Mat3() << across, across, along).finished();
  }
  return result;
}

bool SimplexBoxes::is_hopeless(const Box& box) const {
  if (box.tier < 0) return true;
  const double shifts = by_mean_edges(modeling_error(box));
  return shifts > kHopelessSimplexError && std::isfinite(shifts);
}

Mat3 SimplexBoxes::remainder(const Box& box) const {
  return (1 + 1e-10) * (modeling_error(box) * sides(box).cwiseAbs() + rounding_error(box));
}

Mat3 SimplexBoxes::rounding_error(const Box& box) const {
  const LineModels::Level& level = line_.level(box.w_level);
  Vec3 size = Vec3::Zero(), rounding = Vec3::Zero();
  for (int k = 0; k < num_layers_; ++k) {
    const Layer& layer = (*box.layers)[k];
    const double along = kind_ == CellKind::prism ? level.largest_coefficient[k] : 1;
    size += along * layer.largest_coefficient;
    rounding += along * layer.rounding;
  }
  // Roundings: sums over modes and along w, tables, the shift, bisections of `degree` averages each, L, differences,
  // and the 16 that `determinant_bound` requires.
  const int degree = tables(box).index.degree();
  const double roundings = num_modes_ + num_layers_ + 4 + 1 + degree * box.level + 3 + degree + 8 + 16;
  const Vec3 control = rounding + roundings * (std::numeric_limits<double>::epsilon() / 2) * size;
  const double differences = 2 * std::max(degree, kind_ == CellKind::tet ? 1 : kWide - 1);
  return differences * control * Eigen::RowVector3d::Ones();
}

}  // namespace subvol::internal
