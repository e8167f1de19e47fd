// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/surface_repair.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/geometry/contact_imprint.h"
#include "subvol/fit/geometry/hole_covers.h"
#include "subvol/fit/mending/fins.h"
#include "subvol/fit/mending/mend_surface.h"
#include "subvol/fit/mending/part_union.h"
#include "subvol/fit/mending/second_sides.h"
#include "subvol/fit/mending/solid_wrap.h"
#include "subvol/fit/mending/tidy_surface.h"
#include "subvol/fit/target/carried_groups.h"
#include "subvol/fit/target/touching_solids.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/surface_parts.h"
#include "subvol/surface/welded_surface.h"
#include "subvol/templates/auto_template.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// The number of places at which a surface cannot be filled as it is.
std::size_t num_obstacles(const SurfaceDiagnosis& diagnosis) {
  std::size_t count = 0;
  for (const SurfaceFinding& finding : diagnosis.findings)
    if (prevents_filling(finding.fault)) count += finding.count;
  return count;
}

/// Returns true if some closed parts point inward, and not the whole surface does.
bool points_inward_in_part(const SurfaceDiagnosis& diagnosis) {
  const SurfaceFinding* inward = diagnosis.find(SurfaceFault::part_inward);
  return inward && std::cmp_less(inward->count, std::ranges::count_if(diagnosis.parts, &SurfacePart::is_closed));
}

/// Repairs what needs no change of a triangle's place: unites and turns parts, leaves sheets out.
SurfaceRepair rearranged(const TriangleMesh& given, const SurfaceDiagnosis& diagnosis,
                         const std::function<bool()>& cancelled, RegionRule rule) {
  TriangleMesh surface = given;
  SurfaceRepair repair{.surface = surface};
  if (diagnosis.is_cancelled) return repair;
  const auto words = [&](SurfaceFault fault) {
    const SurfaceFinding* found = diagnosis.find(fault);
    return found ? "target: " + to_text(*found, diagnosis.diagonal) : std::string();
  };
  const bool crosses = diagnosis.find(SurfaceFault::crossing) || diagnosis.find(SurfaceFault::face_contact);
  if (!crosses) {
    repair.regions = find_regions(surface, rule);
    if (repair.regions) {
      for (const std::string& note : repair.regions->notes) repair.notes.push_back("target: " + note);
      repair.is_fillable = true;
      return repair;
    }
  }
  if (const std::string sheets = words(SurfaceFault::interface); !sheets.empty()) {
    const std::optional<RegionSurface> regions = find_regions(surface, RegionRule::keep);
    if (crosses)
      throw InputError(
          sheets + ", and " +
          words(diagnosis.find(SurfaceFault::crossing) ? SurfaceFault::crossing : SurfaceFault::face_contact)
              .substr(std::string("target: ").size()) +
          ": sheets must meet along edges that they share. A wrap makes one region of such a surface");
    if (!regions)
      throw InputError(sheets + ", but an edge of one triangle leaves them open, or what they divide has no volume");
    surface = outer_surface(*regions);
    repair.surface = surface;
    repair.done.push_back(sheets + "; they are left out, and the regions are one");
  }
  std::vector<std::string> turned;
  if (diagnosis.find(SurfaceFault::wall_outward)) turned.push_back(words(SurfaceFault::wall_outward));
  if (points_inward_in_part(diagnosis)) turned.push_back(words(SurfaceFault::part_inward));
  bool united = false;
  if (diagnosis.parts.size() > 1 && !diagnosis.find(SurfaceFault::fin) && (crosses || !turned.empty())) {
    PartUnion parts(surface_parts(surface), cancelled);
    if (!parts.group()) return repair;
    const std::size_t before = repair.done.size();
    std::optional<TriangleMesh> made = parts.made(repair.done);
    if (!made) return repair;
    united = repair.done.size() > before;
    for (const std::string& parts_turned : turned) repair.done.push_back(parts_turned + "; turned");
    if (!repair.done.empty()) {
      made->face_groups = groups_of_pieces(surface, *made);
      repair.surface = std::move(*made);
    }
  }
  const SurfaceDiagnosis after = united ? diagnose(repair.surface, cancelled) : SurfaceDiagnosis{};
  const SurfaceDiagnosis& left = united ? after : diagnosis;
  const auto is_repaired = [&](SurfaceFault fault) {
    return fault == SurfaceFault::wall_outward ? !repair.done.empty() : fault == SurfaceFault::pinhole;
  };
  repair.is_fillable = !left.is_cancelled && std::ranges::all_of(left.findings, [&](const SurfaceFinding& finding) {
    return !prevents_filling(finding.fault) || is_repaired(finding.fault);
  });
  for (const SurfaceFault fault : {SurfaceFault::crossing, SurfaceFault::face_contact})
    if (const SurfaceFinding* found = left.find(fault))
      repair.notes.push_back("target: " + to_text(*found, left.diagonal) + ": left as it is");
  for (const SurfaceFault fault : {SurfaceFault::edge_contact, SurfaceFault::vertex_contact})
    if (!united && diagnosis.find(fault)) repair.notes.push_back(words(fault) + ": what touches stays apart");
  if (diagnosis.find(SurfaceFault::pinhole)) repair.notes.push_back(words(SurfaceFault::pinhole) + ": closed");
  return repair;
}

/// Returns the surface with small faults removed for a goal, and a sentence about it; nothing if that brings no
/// improvement.
std::optional<SurfaceRepair> mended_for(MendingGoal goal, const TriangleMesh& given, const SurfaceDiagnosis& before,
                                        const std::function<bool()>& cancelled, RegionRule rule) {
  const MendedSurface mending = mend_surface(as_polygons(given), {}, kMendingShare * before.diagonal, goal, cancelled);
  if (mending.is_cancelled || !mending.is_mended()) return std::nullopt;
  const TriangleMesh surface = triangulate(mending.surface);
  if (surface.triangles.empty()) return std::nullopt;
  const SurfaceDiagnosis after = diagnose(surface, cancelled);
  if (after.is_cancelled || num_obstacles(after) >= num_obstacles(before)) return std::nullopt;
  SurfaceRepair repair = rearranged(surface, after, cancelled, rule);
  repair.done.insert(repair.done.begin(), "target: " + to_text(mending, before.diagonal));
  return repair;
}

/// Returns the surface with small faults removed, and a sentence about it; nothing if that brings no improvement.
/// Rims may be cracks or the borders of holes; what can be filled decides. Sheets that divide the inside are left
/// alone: what meets there is meant to meet. InputError: the surface without faults bounds no solid.
std::optional<SurfaceRepair> mended(const TriangleMesh& given, const SurfaceDiagnosis& before,
                                    const std::function<bool()>& cancelled, RegionRule rule) {
  constexpr std::array<SurfaceFault, 4> kMendable{SurfaceFault::crossing, SurfaceFault::face_contact, SurfaceFault::fin,
                                                  SurfaceFault::repeated_triangle};
  if (before.find(SurfaceFault::interface)) return std::nullopt;
  std::vector<MendingGoal> goals;
  if (before.find(SurfaceFault::open_rim)) goals.push_back(MendingGoal::solid_with_cracks);
  if (std::ranges::any_of(kMendable, [&](SurfaceFault fault) { return before.find(fault) != nullptr; }))
    goals.push_back(MendingGoal::solid);
  std::optional<SurfaceRepair> repair;
  std::exception_ptr error;
  for (const MendingGoal goal : goals) {
    try {
      std::optional<SurfaceRepair> next = mended_for(goal, given, before, cancelled, rule);
      if (next && (!repair || next->is_fillable)) repair = std::move(next);
      if (repair && repair->is_fillable) return repair;
    } catch (const InputError&) {
      error = std::current_exception();
    }
  }
  if (!repair && error) std::rethrow_exception(error);
  return repair;
}

/// A repair, or the error that it ended with.
struct RepairAttempt {
  std::optional<SurfaceRepair> repair;
  std::exception_ptr error;  ///< null if there is a repair
  bool is_successful() const { return repair && repair->is_fillable; }
};

/// Repairs a surface without covers for its holes.
RepairAttempt attempt_repair(const TriangleMesh& given, const SurfaceDiagnosis& diagnosis,
                             const std::function<bool()>& cancelled, RegionRule rule) {
  RepairAttempt attempt;
  try {
    attempt.repair = rearranged(given, diagnosis, cancelled, rule);
    if (attempt.is_successful()) return attempt;
  } catch (const InputError&) {
    attempt.error = std::current_exception();
  }
  try {
    if (std::optional<SurfaceRepair> better = mended(given, diagnosis, cancelled, rule))
      attempt = {std::move(better), nullptr};
  } catch (const InputError&) {
    attempt = {std::nullopt, std::current_exception()};
  }
  return attempt;
}

/// Repairs a surface after a change. Returns nothing if it was cancelled, or cannot be repaired.
/// before  the repair without the change; done: what was changed.
std::optional<SurfaceRepair> repaired_after(const TriangleMesh& changed, const SurfaceRepair& before,
                                            const std::string& done, const std::function<bool()>& cancelled,
                                            RegionRule rule) {
  const SurfaceDiagnosis diagnosis = diagnose(changed, cancelled);
  if (diagnosis.is_cancelled) return std::nullopt;
  RepairAttempt attempt = attempt_repair(changed, diagnosis, cancelled, rule);
  if (!attempt.repair) return std::nullopt;
  std::vector<std::string>& all = attempt.repair->done;
  all.insert(all.begin(), "target: " + done);
  all.insert(all.begin(), before.done.begin(), before.done.end());
  return std::move(attempt.repair);
}

/// Returns the repair of a surface without its fins, if these are a small part of it and the rest bounds a solid.
std::optional<SurfaceRepair> repaired_without_fins(const SurfaceRepair& before, const std::function<bool()>& cancelled,
                                                   RegionRule rule) {
  constexpr double kMostFinShare = 0.25;  // of the area
  const std::optional<SurfaceWithoutFins> rest = without_fins(before.surface);
  if (!rest || rest->area_share > kMostFinShare) return std::nullopt;
  std::optional<SurfaceRepair> repair =
      repaired_after(rest->surface, before,
                     formatted("%zu %s of fins left out, with %.3g %% of the surface's area", rest->triangles,
                               rest->triangles == 1 ? "triangle" : "triangles", 100 * rest->area_share),
                     cancelled, rule);
  return repair && repair->is_fillable ? std::move(repair) : std::nullopt;
}

/// Area of the covers of a solid's holes, as a share of the surface's. The disk under half a sphere has 0.5; covers of
/// a sheet have about its own area, and say nothing about a solid.
constexpr double kMostCoverShare = 0.5;

/// Returns the repair of a surface whose holes are covered, if that leaves fewer places that prevent filling: covers
/// may cross it.
/// diagnosis  of the surface as it was given.
std::optional<SurfaceRepair> repaired_with_covers(const CoveredHoles& covered, const SurfaceRepair& before,
                                                  const SurfaceDiagnosis& diagnosis,
                                                  const std::function<bool()>& cancelled, RegionRule rule) {
  if (covered.area_share > kMostCoverShare) return std::nullopt;
  std::optional<SurfaceRepair> repair =
      repaired_after(covered.surface, before,
                     formatted("%zu %s covered, with %.3g %% of the surface's area", covered.count,
                               covered.count == 1 ? "hole is" : "holes are", 100 * covered.area_share),
                     cancelled, rule);
  if (!repair || repair->is_fillable) return repair;
  const SurfaceDiagnosis after = diagnose(repair->surface, cancelled);
  return after.is_cancelled || num_obstacles(after) >= num_obstacles(diagnosis) ? std::nullopt : std::move(repair);
}

/// Returns the edge length of the smallest cells that `auto_templates` tries if so many are wanted.
double smallest_cell(const SurfaceDiagnosis& diagnosis, std::size_t cells) {
  return std::cbrt(std::abs(diagnosis.volume) / static_cast<double>(kMostTemplateGrowth * cells));
}

/// Returns the surface with contacts of faces that are cut into equal triangles, if sheets or parts make regions and
/// nothing else is in the way of telling them apart.
std::optional<TriangleMesh> with_common_contacts(const TriangleMesh& given, const SurfaceDiagnosis& diagnosis,
                                                 const std::function<bool()>& cancelled, RegionRule rule) {
  if (!diagnosis.find(SurfaceFault::face_contact) && !diagnosis.find(SurfaceFault::crossing)) return std::nullopt;
  if (!diagnosis.find(SurfaceFault::interface) && rule != RegionRule::keep) return std::nullopt;
  std::optional<TriangleMesh> common = imprinted_contacts(given, cancelled);
  if (!common) return std::nullopt;
  drop_copies(*common);
  const SurfaceDiagnosis after = diagnose(*common, cancelled);
  const bool is_clear = !after.is_cancelled && !after.find(SurfaceFault::face_contact) &&
                        !after.find(SurfaceFault::crossing) && num_obstacles(after) < num_obstacles(diagnosis);
  return is_clear ? std::move(common) : std::nullopt;
}

/// `repair_surface`, whose result counts only if it was not cancelled.
SurfaceRepair repaired(const TriangleMesh& given, const std::function<bool()>& cancelled, RegionRule rule) {
  if (std::optional<TouchingSolids> solids = touching_solids(given, cancelled, rule))
    return repair_of_solids(*std::move(solids));
  const SurfaceDiagnosis diagnosis = diagnose(given, cancelled);
  if (diagnosis.is_cancelled) return {.surface = given};
  if (rule != RegionRule::keep && diagnosis.find(SurfaceFault::face_contact))
    if (const std::optional<OneSidedSurface> one = without_second_sides(given)) {
      SurfaceRepair repair = repaired(one->surface, cancelled, rule);
      repair.done.insert(
          repair.done.begin(),
          formatted("target: %zu triangles are there with both orientations; one of each is left", one->dropped));
      return repair;
    }
  if (const std::optional<TriangleMesh> common = with_common_contacts(given, diagnosis, cancelled, rule)) {
    SurfaceRepair repair = repaired(*common, cancelled, rule);
    const SurfaceFinding* contacts = diagnosis.find(SurfaceFault::face_contact);
    if (!contacts) contacts = diagnosis.find(SurfaceFault::crossing);
    repair.done.insert(repair.done.begin(),
                       "target: " + to_text(*contacts, diagnosis.diagonal) + "; they are cut along each other's edges");
    return repair;
  }
  if (std::optional<TidySurface> tidy = tidy_surface(given, diagnosis)) {
    SurfaceRepair repair = repaired(tidy->surface, cancelled, rule);
    repair.done.insert(repair.done.begin(), tidy->done.begin(), tidy->done.end());
    return repair;
  }
  RepairAttempt attempt = attempt_repair(given, diagnosis, cancelled, rule);
  if (attempt.is_successful()) return std::move(*attempt.repair);
  if (cancelled && cancelled()) return {.surface = given};
  const SurfaceRepair before = attempt.repair ? *attempt.repair : SurfaceRepair{.surface = given};
  if (diagnosis.find(SurfaceFault::fin))
    if (std::optional<SurfaceRepair> repair = repaired_without_fins(before, cancelled, rule)) return std::move(*repair);
  const SurfaceFinding* holes = diagnosis.find(SurfaceFault::open_rim);
  std::optional<CoveredHoles> covered;
  std::optional<SurfaceRepair> without_holes;
  if (holes) covered = cover_holes(before.surface);
  if (covered) without_holes = repaired_with_covers(*covered, before, diagnosis, cancelled, rule);
  if (without_holes && without_holes->is_fillable) return std::move(*without_holes);
  if (rule != RegionRule::keep && needs_wrap(attempt.repair ? &attempt.repair->surface : nullptr, diagnosis))
    if (std::optional<SurfaceRepair> repair = wrapped_to_fill(given, diagnosis, cancelled)) return std::move(*repair);
  if (without_holes) return std::move(*without_holes);
  if (!attempt.repair) std::rethrow_exception(attempt.error);
  if (covered && covered->area_share > kMostCoverShare)
    throw InputError(
        "target: " + to_text(*holes, diagnosis.diagonal) +
        formatted(": a cover would have %.3g %% of the surface's area. A sheet bounds no solid; layers can "
                  "be grown on it (`shell`)",
                  100 * covered->area_share));
  return std::move(*attempt.repair);
}

}  // namespace

SurfaceRepair internal::repair_of_solids(TouchingSolids solids) {
  SurfaceRepair repair{.surface = std::move(solids.surface), .is_fillable = true};
  repair.done.push_back("target: " + solids.text());
  for (const std::string& note : solids.regions.notes) repair.notes.push_back("target: " + note);
  repair.regions = std::move(solids.regions);
  return repair;
}

SurfaceRepair repair_surface(const TriangleMesh& given, const std::function<bool()>& cancelled, RegionRule rule) {
  if (!cancelled) return repaired(given, {}, rule);
  // Steps that are cancelled leave the surface in any state, or do not find what they look for.
  bool is_cancelled = false;
  const std::function<bool()> ask = [&] { return is_cancelled = is_cancelled || cancelled(); };
  try {
    SurfaceRepair repair = repaired(given, ask, rule);
    if (!is_cancelled) return repair;
  } catch (const InputError&) {
    if (!is_cancelled) throw;
  }
  return {.surface = given};
}

std::string why_no_grid(const SurfaceDiagnosis& diagnosis, std::size_t cells, const BettiNumbers& wanted) {
  const std::string text = "no grid that was tried, of up to " + std::to_string(kMostTemplateGrowth) + " times " +
                           std::to_string(cells) + " cells, has the target's " + to_string(wanted);
  const std::string causes = obstacles_for_cells(diagnosis, smallest_cell(diagnosis, cells));
  return causes.empty() ? text : text + ": " + causes;
}

bool is_too_thin_for_grids(const SurfaceDiagnosis& diagnosis, std::size_t cells) {
  const double least = kHopelessShare * smallest_cell(diagnosis, cells);
  return std::ranges::any_of(std::array{SurfaceFault::thin_wall, SurfaceFault::thin_gap}, [&](SurfaceFault fault) {
    const SurfaceFinding* found = diagnosis.find(fault);
    return found && found->places.front().measure < least;
  });
}

}  // namespace subvol
