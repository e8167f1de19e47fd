// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/surface_diagnosis.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/thinnest_place.h"
#include "subvol/fit/geometry/triangle_meeting.h"
#include "subvol/surface/corner_fans.h"
#include "subvol/surface/part_nesting.h"
#include "subvol/surface/rim_loops.h"
#include "subvol/surface/surface_parts.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

using Corners = std::array<Vec3, 3>;

/// The findings of a surface, one after the other.
class Diagnostician {
 public:
  Diagnostician(const TriangleMesh& surface, const std::function<bool()>& cancelled)
      : cancelled_(cancelled), parts_(surface_parts(surface)), mesh_(parts_.surface.mesh) {
    result_.num_triangles = surface.triangles.size();
    for (std::size_t i = 0; i < kNumSurfaceFaults; ++i) findings_[i].fault = static_cast<SurfaceFault>(i);
  }
  SurfaceDiagnosis run();

 private:
  SurfaceFinding& of(SurfaceFault fault) { return findings_[static_cast<std::size_t>(fault)]; }
  void add(SurfaceFault fault, SurfacePlace place) {
    SurfaceFinding& finding = of(fault);
    if (++finding.count <= kMostPlaces) finding.places.push_back(std::move(place));
  }
  Index number(Index triangle) const { return parts_.surface.triangle_numbers[triangle]; }
  Index part(Index triangle) const { return static_cast<Index>(parts_.part[triangle]); }
  Corners corners(Index t) const {
    const auto& [a, b, c] = mesh_.triangles[t];
    return {mesh_.positions[a], mesh_.positions[b], mesh_.positions[c]};
  }
  Vec3 center(Index t) const {
    const Corners p = corners(t);
    return (p[0] + p[1] + p[2]) / 3;
  }
  SurfacePlace place_of(const Vec3& at, Index t, Index other = kNoIndex) const {
    return {at,
            std::nullopt,
            0,
            {number(t), other == kNoIndex ? kNoIndex : number(other)},
            {part(t), other == kNoIndex ? kNoIndex : part(other)}};
  }
  SurfacePlace edge_place(const SurfaceHalfEdge& side, Index other) const {
    SurfacePlace place = place_of(mesh_.positions[side.low], side.triangle, other);
    place.to = mesh_.positions[side.high];
    return place;
  }
  bool goes_on() { return !(result_.is_cancelled = result_.is_cancelled || (cancelled_ && cancelled_())); }

  void measure();
  void find_repeated();
  void find_edge_faults();
  void find_rims();
  void add_rim(std::span<const RimEdge> rim);
  void find_vertex_contacts();
  void find_nesting();
  void find_meetings();
  void turn_outward() { turn_parts_outward(parts_, nesting_); }
  void find_sharp_angles();
  void find_thin_places();

  const std::function<bool()>& cancelled_;
  SurfaceParts parts_;
  const TriangleMesh& mesh_;
  PartNesting nesting_;
  SurfaceDiagnosis result_;
  std::array<SurfaceFinding, kNumSurfaceFaults> findings_;
  std::vector<char> repeated_;  ///< triangles with the corners of another one
};

void Diagnostician::measure() {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : mesh_.positions) box.extend(p);
  result_.diagonal = box.isEmpty() ? 0 : box.diagonal().norm();
  result_.num_vertices = mesh_.positions.size();
  of(SurfaceFault::flat_triangle).count = parts_.surface.dropped;
  result_.parts.resize(parts_.num_parts());
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    SurfacePart& p = result_.parts[parts_.part[t]];
    if (p.triangles++ == 0) p.first_triangle = number(static_cast<Index>(t));
    p.is_closed = parts_.is_closed[parts_.part[t]];
  }
}

/// Triangles on the same three vertices: of two that face each other, a solid lies on either side.
void Diagnostician::find_repeated() {
  std::vector<std::pair<std::array<Index, 3>, Index>> keys;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    keys.emplace_back(mesh_.triangles[t], static_cast<Index>(t));
    std::sort(keys.back().first.begin(), keys.back().first.end());
  }
  std::sort(keys.begin(), keys.end());
  repeated_.assign(mesh_.triangles.size(), 0);
  const auto turns = [&](Index t) {  // true if a triangle runs through its sorted corners backward
    const auto& c = mesh_.triangles[t];
    return (c[0] < c[1]) + (c[1] < c[2]) + (c[2] < c[0]) == 1;
  };
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].first != keys[i - 1].first) continue;
    const Index t = keys[i - 1].second, s = keys[i].second;
    repeated_[t] = repeated_[s] = 1;
    add(turns(t) == turns(s) ? SurfaceFault::repeated_triangle : SurfaceFault::face_contact, place_of(center(t), t, s));
  }
}

void Diagnostician::find_edge_faults() {
  for (const auto& [i, j] : parts_.joined) {
    const SurfaceHalfEdge &a = parts_.sides[i], &b = parts_.sides[j];
    if (a.forward == b.forward) add(SurfaceFault::disagreement, edge_place(a, b.triangle));
  }
  for (const std::size_t first : parts_.touching) {
    const auto sides = parts_.edge(first);
    if (std::any_of(sides.begin(), sides.end(), [&](const auto& side) { return repeated_[side.triangle]; })) continue;
    const auto other = std::find_if(sides.begin(), sides.end(), [&](const SurfaceHalfEdge& side) {
      return part(side.triangle) != part(sides[0].triangle);
    });
    add(SurfaceFault::edge_contact, edge_place(sides[0], other == sides.end() ? sides[1].triangle : other->triangle));
  }
  std::vector<char> has_rim(parts_.num_parts(), 0);
  for (const std::size_t side : parts_.rims) has_rim[part(parts_.sides[side].triangle)] = 1;
  for (const std::size_t first : parts_.crowded) {
    const auto sides = parts_.edge(first);
    const bool is_fin = std::any_of(sides.begin(), sides.end(), [&](const SurfaceHalfEdge& side) {
      return has_rim[part(side.triangle)] || repeated_[side.triangle];
    });
    add(is_fin ? SurfaceFault::fin : SurfaceFault::interface, edge_place(sides[0], sides[1].triangle));
  }
}

void Diagnostician::find_rims() {
  std::vector<SurfaceHalfEdge> rims;
  for (const std::size_t side : parts_.rims) rims.push_back(parts_.sides[side]);
  for (const std::vector<RimEdge>& rim : rim_walks(rims, mesh_.positions.size())) add_rim(rim);
}

void Diagnostician::add_rim(std::span<const RimEdge> rim) {
  double length = 0;
  Vec3 mean = Vec3::Zero();
  for (const RimEdge& edge : rim) {
    const auto [low, high] = std::minmax(edge.from, edge.to);
    const Vec3 &p = mesh_.positions[low], &q = mesh_.positions[high];
    length += (q - p).norm();
    mean += (p + q) / 2;
  }
  SurfacePlace place = place_of(mean / static_cast<double>(rim.size()), rim.front().triangle);
  place.measure = length;
  const bool is_pinhole = rim.size() > 2 && length <= kPinholePercent / 100 * result_.diagonal;
  add(is_pinhole ? SurfaceFault::pinhole : SurfaceFault::open_rim, std::move(place));
}

/// Vertices with several fans of triangles, other than the ends of edges at which the surface touches itself.
void Diagnostician::find_vertex_contacts() {
  std::vector<char> passed(mesh_.positions.size(), 0);
  for (const auto* edges : {&parts_.touching, &parts_.crowded, &parts_.rims})
    for (const std::size_t first : *edges) passed[parts_.sides[first].low] = passed[parts_.sides[first].high] = 1;
  CornerFans fans(mesh_.triangles);
  for (const auto& [i, j] : parts_.joined) fans.join(parts_.sides[i], parts_.sides[j]);
  std::vector<Index> first_fan(mesh_.positions.size(), kNoIndex);
  for (std::size_t c = 0; c < fans.num_corners(); ++c) {
    const Index v = mesh_.triangles[c / 3][c % 3], fan = fans.of(c);
    if (passed[v]) continue;
    if (first_fan[v] == kNoIndex) {
      first_fan[v] = fan;
    } else if (fan != first_fan[v]) {
      passed[v] = 1;
      add(SurfaceFault::vertex_contact, place_of(mesh_.positions[v], first_fan[v] / 3, static_cast<Index>(c / 3)));
    }
  }
}

void Diagnostician::find_nesting() {
  nesting_ = part_nesting(mesh_, parts_.part, static_cast<int>(parts_.num_parts()), cancelled_);
  if (!goes_on()) return;
  const PartNesting& nesting = nesting_;
  std::size_t closed = 0, wrong = 0;
  for (std::size_t p = 0; p < parts_.num_parts(); ++p) {
    if (!parts_.is_closed[p]) continue;
    result_.parts[p].volume = nesting.volumes[p];
    result_.parts[p].depth = nesting.depths[p];
    ++closed;
    wrong += !nesting.faces_out(p);
  }
  std::vector<Index> first(parts_.num_parts(), kNoIndex);
  for (std::size_t t = mesh_.triangles.size(); t-- > 0;) first[parts_.part[t]] = static_cast<Index>(t);
  for (std::size_t p = 0; p < parts_.num_parts(); ++p) {
    result_.volume += (nesting.is_void(p) ? -1 : 1) * std::abs(nesting.volumes[p]);
    if (!parts_.is_closed[p]) continue;
    const bool lies_inside = nesting.depths[p] > 0, faces_out = nesting.faces_out(p);
    if (!lies_inside && faces_out) continue;
    SurfacePlace place = place_of(center(first[p]), first[p]);
    place.measure = std::abs(nesting.volumes[p]);
    const auto told = [&](SurfaceFault fault) {
      if (lies_inside && of(fault).count < kMostPlaces)
        place.parts[1] = static_cast<Index>(part_around(mesh_, parts_.part, nesting, static_cast<int>(p)));
      add(fault, place);
    };
    // If every part faces the wrong way, their nesting is right: the surface is inside out.
    if (!faces_out) told(nesting.is_void(p) && wrong < closed ? SurfaceFault::wall_outward : SurfaceFault::part_inward);
    if (lies_inside && !nesting.is_void(p)) told(SurfaceFault::part_in_void);
  }
}

void Diagnostician::find_meetings() {
  const SelfIntersections found = self_intersections(mesh_, cancelled_);
  for (const Index t : found.degenerate) add(SurfaceFault::flat_triangle, place_of(center(t), t));
  for (const auto& [t, s] : edge_contacts(parts_))  // those that only rounding keeps apart
    if (!std::binary_search(found.pairs.begin(), found.pairs.end(), std::array{t, s}))
      add(SurfaceFault::face_contact, place_of(meeting_of(corners(t), corners(s)).place, t, s));
  for (const auto& [t, s] : found.pairs) {
    if (repeated_[t] && repeated_[s]) continue;
    const TriangleMeeting meeting = meeting_of(corners(t), corners(s));
    constexpr std::array<SurfaceFault, 4> kFaults{SurfaceFault::crossing, SurfaceFault::face_contact,
                                                  SurfaceFault::edge_contact, SurfaceFault::vertex_contact};
    add(kFaults[static_cast<std::size_t>(meeting.kind)], place_of(meeting.place, t, s));
  }
  if (!found.is_complete) of(SurfaceFault::crossing).is_complete = false;
}

void Diagnostician::find_sharp_angles() {
  const double least_cosine = std::cos((180 - kSharpDegrees) * std::numbers::pi / 180);
  std::vector<SurfacePlace> places;
  for (const auto& [i, j] : parts_.joined) {
    const SurfaceHalfEdge &a = parts_.sides[i], &b = parts_.sides[j];
    if (a.forward == b.forward || repeated_[a.triangle] || repeated_[b.triangle]) continue;
    const double cosine = triangle_normal(mesh_, a.triangle).dot(triangle_normal(mesh_, b.triangle));
    if (!(cosine < least_cosine)) continue;
    places.push_back(edge_place(a, b.triangle));
    places.back().measure = 180 - std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const SurfacePlace& a, const SurfacePlace& b) { return a.measure < b.measure; });
  for (SurfacePlace& place : places) add(SurfaceFault::sharp_angle, std::move(place));
}

void Diagnostician::find_thin_places() {
  if (mesh_.triangles.empty()) return;
  const ClosestPoint tree(mesh_);
  for (const ThinSide side : {ThinSide::wall, ThinSide::gap}) {
    const std::optional<ThinPlace> found = thinnest_place(mesh_, tree, side, cancelled_);
    if (!goes_on()) return;
    if (!found) continue;
    SurfacePlace place = place_of(found->at, found->triangles[0], found->triangles[1]);
    place.to = found->across;
    place.measure = found->width;
    add(side == ThinSide::wall ? SurfaceFault::thin_wall : SurfaceFault::thin_gap, std::move(place));
  }
}

SurfaceDiagnosis Diagnostician::run() {
  measure();
  using Step = void (Diagnostician::*)();
  constexpr Step kDiagnosisSteps[] = {
      &Diagnostician::find_repeated,        &Diagnostician::find_edge_faults,  &Diagnostician::find_rims,
      &Diagnostician::find_vertex_contacts, &Diagnostician::find_nesting,      &Diagnostician::find_meetings,
      &Diagnostician::turn_outward,         &Diagnostician::find_sharp_angles, &Diagnostician::find_thin_places};
  for (const Step step : kDiagnosisSteps)
    if (goes_on()) (this->*step)();
  for (SurfaceFinding& finding : findings_)
    if (finding.count > 0 || !finding.is_complete) result_.findings.push_back(std::move(finding));
  return std::move(result_);
}

}  // namespace

const SurfaceFinding* SurfaceDiagnosis::find(SurfaceFault fault) const {
  const auto found = std::find_if(findings.begin(), findings.end(), [&](const auto& f) { return f.fault == fault; });
  return found == findings.end() ? nullptr : &*found;
}

bool SurfaceDiagnosis::is_fillable() const {
  return std::none_of(findings.begin(), findings.end(), [](const auto& f) { return prevents_filling(f.fault); });
}

SurfaceDiagnosis diagnose(const TriangleMesh& surface, const std::function<bool()>& cancelled) {
  if (surface.triangles.empty()) throw InputError("surface: it has no triangles");
  return Diagnostician(surface, cancelled).run();
}

}  // namespace subvol
