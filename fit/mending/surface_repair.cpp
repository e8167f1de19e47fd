// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/surface_repair.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/surface_union.h"
#include "subvol/fit/geometry/triangle_meeting.h"
#include "subvol/fit/mending/mend_surface.h"
#include "subvol/fit/target/carried_groups.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/part_nesting.h"
#include "subvol/surface/surface_parts.h"
#include "subvol/templates/auto_template.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// The parts of a surface, some of which are to be united.
class Union {
 public:
  Union(SurfaceParts parts, const std::function<bool()>& cancelled) : parts_(std::move(parts)), cancelled_(cancelled) {
    nesting_ = part_nesting(mesh(), parts_.part, static_cast<int>(parts_.num_parts()));
    turn_parts_outward(parts_);
    group_.resize(parts_.num_parts());
    std::iota(group_.begin(), group_.end(), 0);
  }
  /// Finds out which parts cross or overlap. Returns false if cancelled.
  bool group();
  /// Returns the surface of the union, and a sentence for each group in `done`.
  TriangleMesh made(std::vector<std::string>& done) const;

 private:
  struct Meeting {
    std::size_t a, b;  ///< parts
    Vec3 place;
  };
  const TriangleMesh& mesh() const { return parts_.surface.mesh; }
  std::size_t root(std::size_t p) const {
    while (group_[p] != p) p = group_[p];
    return p;
  }
  TriangleMesh part(std::size_t p) const;
  TriangleMesh united_group(std::size_t group) const;
  std::string text_of(const Meeting& meeting) const {
    return "parts " + std::to_string(meeting.a) + " and " + std::to_string(meeting.b) + " meet at " +
           to_text(meeting.place);
  }

  SurfaceParts parts_;
  PartNesting nesting_;
  const std::function<bool()>& cancelled_;
  std::vector<std::size_t> group_;  ///< another part of the same group, or the part itself
  std::vector<Meeting> meetings_;   ///< those that joined groups
};

bool Union::group() {
  const SelfIntersections found = self_intersections(mesh(), cancelled_);
  if (cancelled_ && cancelled_()) return false;
  for (const auto& [t, s] : found.pairs) {
    const auto a = static_cast<std::size_t>(parts_.part[t]), b = static_cast<std::size_t>(parts_.part[s]);
    if (root(a) == root(b) || !parts_.is_closed[a] || !parts_.is_closed[b]) continue;
    const auto corners = [&](Index triangle) {
      const auto& [i, j, k] = mesh().triangles[triangle];
      return std::array<Vec3, 3>{mesh().positions[i], mesh().positions[j], mesh().positions[k]};
    };
    const TriangleMeeting meeting = meeting_of(corners(t), corners(s));
    if (meeting.kind != MeetingKind::crossing && meeting.kind != MeetingKind::face) continue;
    meetings_.push_back({a, b, meeting.place});
    group_[std::max(root(a), root(b))] = std::min(root(a), root(b));
  }
  return true;
}

TriangleMesh Union::part(std::size_t p) const {
  TriangleMesh result;
  std::vector<Index> number(mesh().positions.size(), kNoIndex);
  for (std::size_t t = 0; t < mesh().triangles.size(); ++t) {
    if (static_cast<std::size_t>(parts_.part[t]) != p) continue;
    std::array<Index, 3> corners = mesh().triangles[t];
    for (Index& v : corners) {
      if (number[v] == kNoIndex) {
        number[v] = static_cast<Index>(result.positions.size());
        result.positions.push_back(mesh().positions[v]);
      }
      v = number[v];
    }
    result.triangles.push_back(corners);
  }
  return result;
}

TriangleMesh Union::united_group(std::size_t group) const {
  std::optional<TriangleMesh> whole;
  for (const bool voids : {false, true})
    for (std::size_t p = 0; p < group_.size(); ++p) {
      if (root(p) != group || nesting_.is_void(p) != voids) continue;
      TriangleMesh next = part(p);
      if (voids)
        for (auto& t : next.triangles) std::swap(t[1], t[2]);
      if (!whole)
        whole = std::move(next);
      else
        whole = voids ? without(*whole, next) : united(*whole, next);
      if (whole) continue;
      const auto meeting =
          std::find_if(meetings_.begin(), meetings_.end(), [&](const Meeting& m) { return m.a == p || m.b == p; });
      throw InputError("target: " + text_of(meeting == meetings_.end() ? meetings_.front() : *meeting) +
                       " and cannot be united: a part meets itself, or parts also touch along an edge or at a vertex");
    }
  return std::move(*whole);
}

TriangleMesh Union::made(std::vector<std::string>& done) const {
  TriangleMesh result;
  for (std::size_t p = 0; p < group_.size(); ++p) {
    if (root(p) != p) continue;
    const auto members =
        std::count_if(meetings_.begin(), meetings_.end(), [&](const Meeting& m) { return root(m.a) == p; });
    TriangleMesh one = members == 0 ? part(p) : united_group(p);
    const auto first = static_cast<Index>(result.positions.size());
    result.positions.insert(result.positions.end(), one.positions.begin(), one.positions.end());
    for (const auto& [a, b, c] : one.triangles) result.triangles.push_back({first + a, first + b, first + c});
    if (members == 0) continue;
    const auto meeting =
        std::find_if(meetings_.begin(), meetings_.end(), [&](const Meeting& m) { return root(m.a) == p; });
    done.push_back("target: " + text_of(*meeting) + "; " + std::to_string(members + 1) +
                   " parts that cross or overlap are united");
  }
  return result;
}

/// The number of places at which a surface cannot be filled as it is.
std::size_t num_obstacles(const SurfaceDiagnosis& diagnosis) {
  std::size_t count = 0;
  for (const SurfaceFinding& finding : diagnosis.findings)
    if (prevents_filling(finding.fault)) count += finding.count;
  return count;
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
          ": sheets must meet along edges that they share");
    if (!regions) throw InputError(sheets + ", but an edge of one triangle leaves them open");
    surface = outer_surface(*regions);
    repair.surface = surface;
    repair.done.push_back(sheets + "; they are left out, and the regions are one");
  }
  const std::string turned = words(SurfaceFault::wall_outward);
  bool united = false;
  if (diagnosis.parts.size() > 1 && !diagnosis.find(SurfaceFault::fin) && (crosses || !turned.empty())) {
    Union parts(surface_parts(surface), cancelled);
    if (!parts.group()) return repair;
    const std::size_t before = repair.done.size();
    TriangleMesh made = parts.made(repair.done);
    united = repair.done.size() > before;
    if (!turned.empty()) repair.done.push_back(turned + "; turned");
    if (!repair.done.empty()) {
      made.face_groups = groups_of_pieces(surface, made);
      repair.surface = std::move(made);
    }
  }
  const auto is_repaired = [&](SurfaceFault fault) {
    if (fault == SurfaceFault::crossing || fault == SurfaceFault::face_contact) return united;
    return fault == SurfaceFault::wall_outward ? !repair.done.empty() : fault == SurfaceFault::pinhole;
  };
  repair.is_fillable = std::ranges::all_of(diagnosis.findings, [&](const SurfaceFinding& finding) {
    return !prevents_filling(finding.fault) || is_repaired(finding.fault);
  });
  for (const SurfaceFault fault : {SurfaceFault::crossing, SurfaceFault::face_contact})
    if (!united && diagnosis.find(fault)) repair.notes.push_back(words(fault) + ": left as it is");
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

/// Returns the edge length of the smallest cells that `auto_templates` tries if so many are wanted.
double smallest_cell(const SurfaceDiagnosis& diagnosis, std::size_t cells) {
  return std::cbrt(std::abs(diagnosis.volume) / static_cast<double>(kMostTemplateGrowth * cells));
}

}  // namespace

SurfaceRepair repair_surface(const TriangleMesh& given, const std::function<bool()>& cancelled, RegionRule rule) {
  const SurfaceDiagnosis diagnosis = diagnose(given, cancelled);
  if (diagnosis.is_cancelled) return {.surface = given};
  std::optional<SurfaceRepair> repair;
  std::exception_ptr error;
  try {
    repair = rearranged(given, diagnosis, cancelled, rule);
    if (repair->is_fillable) return std::move(*repair);
  } catch (const InputError&) {
    error = std::current_exception();
  }
  std::optional<SurfaceRepair> better = mended(given, diagnosis, cancelled, rule);
  if (better) return std::move(*better);
  if (error) std::rethrow_exception(error);
  return std::move(*repair);
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
