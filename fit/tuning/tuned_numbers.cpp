// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/tuning/tuned_numbers.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"

#include <cmath>
#include <cstddef>
#include <type_traits>
#include <variant>

namespace subvol {
namespace {

template <class Part>
struct Member {
  const char* name;
  std::variant<double Part::*, int Part::*> place;
};

/// Returns true if these are all members of a part in the order of their declarations: laid out like that, they fill
/// it.
template <class Part, std::size_t n>
constexpr bool fills_part(const Member<Part> (&members)[n]) {
  std::size_t end = 0;
  for (const auto& member : members) {
    const std::size_t size = member.place.index() == 0 ? sizeof(double) : sizeof(int);
    end = (end + size - 1) / size * size + size;
  }
  return (end + alignof(Part) - 1) / alignof(Part) * alignof(Part) == sizeof(Part);
}

constexpr Member<FitTuning> kFitNumbers[] = {
    {"coarse_lambda", &FitTuning::coarse_lambda},
    {"held_lambda", &FitTuning::held_lambda},
    {"far_tangential_weight", &FitTuning::far_tangential_weight},
    {"close_tangential_weight", &FitTuning::close_tangential_weight},
    {"close_distance", &FitTuning::close_distance},
    {"unfolding_factor", &FitTuning::unfolding_factor},
    {"most_unfolding_lambda", &FitTuning::most_unfolding_lambda},
    {"default_accuracy_percent", &FitTuning::default_accuracy_percent},
    {"least_default_lambda_share", &FitTuning::least_default_lambda_share},
    {"least_lambda_share", &FitTuning::least_lambda_share},
    {"least_lambda_halving_gain", &FitTuning::least_lambda_halving_gain},
    {"most_shape_loss", &FitTuning::most_shape_loss},
    {"most_cage_shape_loss", &FitTuning::most_cage_shape_loss},
    {"accelerated_decrease", &FitTuning::accelerated_decrease},
    {"rough_tolerance", &FitTuning::rough_tolerance},
    {"hessian_life", &FitTuning::hessian_life},
    {"mesh_share", &FitTuning::mesh_share},
    {"most_mesh_limit_gap", &FitTuning::most_mesh_limit_gap},
    {"samples_per_quad", &FitTuning::samples_per_quad},
    {"least_coarse_samples", &FitTuning::least_coarse_samples},
    {"most_per_sample", &FitTuning::most_per_sample},
    {"far_too_many_per_sample", &FitTuning::far_too_many_per_sample},
    {"least_target_samples", &FitTuning::least_target_samples},
    {"back_off", &FitTuning::back_off},
    {"least_progress", &FitTuning::least_progress},
    {"slow_share", &FitTuning::slow_share},
};

constexpr Member<CurvedTuning> kCurvedNumbers[] = {
    {"nearly_all_edges", &CurvedTuning::nearly_all_edges},
    {"stiff_lambda", &CurvedTuning::stiff_lambda},
    {"stiff_order", &CurvedTuning::stiff_order},
    {"stiff_steps", &CurvedTuning::stiff_steps},
    {"most_steps", &CurvedTuning::most_steps},
    {"fair_distance_percent", &CurvedTuning::fair_distance_percent},
    {"fair_distortion", &CurvedTuning::fair_distortion},
    {"most_intervals", &CurvedTuning::most_intervals},
    {"least_intervals_per_order", &CurvedTuning::least_intervals_per_order},
    {"wanted_intervals_per_order", &CurvedTuning::wanted_intervals_per_order},
    {"most_fitted_triangles", &CurvedTuning::most_fitted_triangles},
    {"most_points_per_direction", &CurvedTuning::most_points_per_direction},
    {"first_emphasis", &CurvedTuning::first_emphasis},
    {"fair_shape", &CurvedTuning::fair_shape},
    {"stiffening_factor", &CurvedTuning::stiffening_factor},
    {"most_stiffenings", &CurvedTuning::most_stiffenings},
    {"far_share", &CurvedTuning::far_share},
    {"near_percent", &CurvedTuning::near_percent},
    {"most_draws", &CurvedTuning::most_draws},
    {"draw_steps", &CurvedTuning::draw_steps},
    {"most_improvements", &CurvedTuning::most_improvements},
    {"most_distance_growth", &CurvedTuning::most_distance_growth},
    {"allowed_max_percent", &CurvedTuning::allowed_max_percent},
    {"lift_steps", &CurvedTuning::lift_steps},
    {"hinge_above_quality", &CurvedTuning::hinge_above_quality},
    {"most_failed_lifts", &CurvedTuning::most_failed_lifts},
    {"most_moved_as_whole", &CurvedTuning::most_moved_as_whole},
    {"most_unfolding_lambda", &CurvedTuning::most_unfolding_lambda},
    {"raised_share", &CurvedTuning::raised_share},
    {"least_order_gain", &CurvedTuning::least_order_gain},
};

constexpr Member<QualityTuning> kQualityNumbers[] = {
    {"inner_weight", &QualityTuning::inner_weight},
    {"least_length", &QualityTuning::least_length},
    {"emphasis_rise", &QualityTuning::emphasis_rise},
    {"emphasis_fall", &QualityTuning::emphasis_fall},
    {"most_emphasis", &QualityTuning::most_emphasis},
    {"below_cap", &QualityTuning::below_cap},
    {"least_goal", &QualityTuning::least_goal},
    {"reachable_share", &QualityTuning::reachable_share},
    {"corner_cap", &QualityTuning::corner_cap},
    {"least_fold_limit", &QualityTuning::least_fold_limit},
    {"first_damping", &QualityTuning::first_damping},
    {"least_damping", &QualityTuning::least_damping},
    {"damping_fall", &QualityTuning::damping_fall},
    {"damping_rise", &QualityTuning::damping_rise},
    {"tangential_weight", &QualityTuning::tangential_weight},
    {"crease_edges", &QualityTuning::crease_edges},
    {"hinge_margin", &QualityTuning::hinge_margin},
    {"coarse_margin", &QualityTuning::coarse_margin},
    {"most_coarse_lift_steps", &QualityTuning::most_coarse_lift_steps},
    {"most_fine_lift_steps", &QualityTuning::most_fine_lift_steps},
    {"lift_round_steps", &QualityTuning::lift_round_steps},
    {"lift_patience", &QualityTuning::lift_patience},
    {"most_poor_share_left", &QualityTuning::most_poor_share_left},
    {"most_patch_share", &QualityTuning::most_patch_share},
    {"late_far_margin", &QualityTuning::late_far_margin},
    {"max_margin", &QualityTuning::max_margin},
    {"enough_of_goal", &QualityTuning::enough_of_goal},
    {"poor_share", &QualityTuning::poor_share},
    {"later_lift_steps", &QualityTuning::later_lift_steps},
    {"attempts_before_freeing", &QualityTuning::attempts_before_freeing},
    {"layer_below", &QualityTuning::layer_below},
    {"most_rise", &QualityTuning::most_rise},
    {"nearer_share", &QualityTuning::nearer_share},
    {"reached_share", &QualityTuning::reached_share},
    {"most_distance_factor", &QualityTuning::most_distance_factor},
    {"most_nearer_distance_factor", &QualityTuning::most_nearer_distance_factor},
    {"most_farthest_place_factor", &QualityTuning::most_farthest_place_factor},
};

constexpr Member<AutomaticTuning> kAutomaticNumbers[] = {
    {"good_merit", &AutomaticTuning::good_merit},
    {"quality_weight", &AutomaticTuning::quality_weight},
    {"not_valid", &AutomaticTuning::not_valid},
    {"far_off", &AutomaticTuning::far_off},
    {"edge_weight", &AutomaticTuning::edge_weight},
    {"most_miss", &AutomaticTuning::most_miss},
    {"enough_quality", &AutomaticTuning::enough_quality},
    {"acceptable_quality", &AutomaticTuning::acceptable_quality},
    {"most_aligned_share", &AutomaticTuning::most_aligned_share},
    {"room_for_pads", &AutomaticTuning::room_for_pads},
    {"least_routed_share", &AutomaticTuning::least_routed_share},
    {"most_routings", &AutomaticTuning::most_routings},
    {"most_long_lost", &AutomaticTuning::most_long_lost},
    {"one_in", &AutomaticTuning::one_in},
    {"most_refinement_growth", &AutomaticTuning::most_refinement_growth},
    {"most_relaxation_rounds", &AutomaticTuning::most_relaxation_rounds},
    {"first_surface_weight", &AutomaticTuning::first_surface_weight},
    {"polish_quality_step", &AutomaticTuning::polish_quality_step},
    {"polish_distance_growth", &AutomaticTuning::polish_distance_growth},
    {"most_poor", &AutomaticTuning::most_poor},
    {"most_poor_of_cage", &AutomaticTuning::most_poor_of_cage},
};

constexpr Member<OptimizeTuning> kOptimizeNumbers[] = {
    {"far_distance", &OptimizeTuning::far_distance},
    {"poor_jacobian", &OptimizeTuning::poor_jacobian},
    {"trusted_jacobian", &OptimizeTuning::trusted_jacobian},
    {"least_relief", &OptimizeTuning::least_relief},
    {"told_volume_change", &OptimizeTuning::told_volume_change},
    {"most_volume_change", &OptimizeTuning::most_volume_change},
    {"share_of_worst", &OptimizeTuning::share_of_worst},
    {"least_fall", &OptimizeTuning::least_fall},
    {"converged_decrease", &OptimizeTuning::converged_decrease},
    {"mean_share_of_tolerance", &OptimizeTuning::mean_share_of_tolerance},
    {"max_share_of_tolerance", &OptimizeTuning::max_share_of_tolerance},
    {"first_round_steps", &OptimizeTuning::first_round_steps},
    {"round_steps", &OptimizeTuning::round_steps},
    {"most_rounds", &OptimizeTuning::most_rounds},
    {"more_surface", &OptimizeTuning::more_surface},
    {"quality_beyond_aim", &OptimizeTuning::quality_beyond_aim},
};

static_assert(fills_part(kFitNumbers) && fills_part(kCurvedNumbers) && fills_part(kQualityNumbers) &&
              fills_part(kAutomaticNumbers) && fills_part(kOptimizeNumbers));

/// Calls visit(name, number) for each number of a part.
template <class Part, std::size_t n, class Visit>
void visit_part(const std::string& name, Part& part, const Member<std::remove_const_t<Part>> (&members)[n],
                const Visit& visit) {
  for (const auto& member : members)
    std::visit([&](auto place) { visit(name + "." + member.name, part.*place); }, member.place);
}

/// Calls visit(name, number) for each number of a `Tuning`, which may be constant.
template <class Numbers, class Visit>
void visit_numbers(Numbers& tuning, const Visit& visit) {
  visit_part("fitting", tuning.fitting, kFitNumbers, visit);
  visit_part("curved", tuning.curved, kCurvedNumbers, visit);
  visit_part("quality", tuning.quality, kQualityNumbers, visit);
  visit_part("automatic", tuning.automatic, kAutomaticNumbers, visit);
  visit_part("optimize", tuning.optimize, kOptimizeNumbers, visit);
}

/// Returns the value of a number by default. The name must exist.
double default_of(std::string_view name) {
  double value = 0;
  const Tuning defaults;
  visit_numbers(defaults, [&](const std::string& other, auto number) {
    if (other == name) value = number;
  });
  return value;
}

/// A number whose largest value is less than 1000 times its default.
struct UpperBound {
  std::string_view name;
  double most;
};

constexpr UpperBound kUpperBounds[] = {
    {"curved.stiffening_factor", 100},          // with the next bound, up to 1e20 in single precision
    {"curved.most_stiffenings", 10},            // the power of that factor
    {"curved.least_intervals_per_order", 20},   // at order 16, 320 times 320 samples of a face
    {"curved.most_points_per_direction", 100},  // 1e6 points in a cell
    {"quality.least_fold_limit", 359},          // an angle, which no fold exceeds
};

/// Returns the largest value of a number whose default is 1 or more.
double upper_bound_of(std::string_view name, double usual) {
  constexpr double kMostGrowth = 1000;  // larger numbers than so many times the default say nothing
  for (const UpperBound& bound : kUpperBounds)
    if (bound.name == name) return bound.most;
  return kMostGrowth * usual;
}

/// InputError: the value is out of the range of a number.
void check_range(std::string_view name, double value, bool is_whole) {
  constexpr double kLeastTunedShare = 1e-9, kMostTunedShare = 0.99, kLeastTunedFactor = 1.01;
  const double usual = default_of(name);
  const double least = usual < 1 ? kLeastTunedShare : usual > 1 && !is_whole ? kLeastTunedFactor : 1;
  const double most = usual < 1 ? kMostTunedShare : upper_bound_of(name, usual);
  if (value >= least && value <= most && (!is_whole || value == std::floor(value))) return;
  throw InputError(internal::formatted("the tuned number %s is %.10g; it must be %sfrom %g to %.10g",
                                       std::string(name).c_str(), value, is_whole ? "whole, " : "", least, most));
}

}  // namespace

std::vector<TunedNumber> tuned_numbers(const Tuning& tuning) {
  std::vector<TunedNumber> numbers;
  visit_numbers(tuning, [&](const std::string& name, auto number) {
    numbers.push_back({name, static_cast<double>(number)});
  });
  return numbers;
}

void set_tuned_number(Tuning& tuning, std::string_view name, double value) {
  bool is_found = false;
  visit_numbers(tuning, [&](const std::string& other, auto& number) {
    if (other != name) return;
    using Number = std::remove_reference_t<decltype(number)>;
    check_range(name, value, std::is_integral_v<Number>);
    number = static_cast<Number>(value);
    is_found = true;
  });
  if (!is_found)
    throw InputError("there is no tuned number '" + std::string(name) +
                     "'; the pages on the methods list them, such as fitting.coarse_lambda");
}

}  // namespace subvol
