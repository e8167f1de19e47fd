// SPDX-License-Identifier: GPL-3.0-or-later
// This file names the findings of a diagnosis, for programs and for people.

#include "subvol/base/format.h"
#include "subvol/base/text_scanner.h"
#include "subvol/fit/target/surface_diagnosis.h"

#include <cstdio>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

struct Words {
  const char* name;
  const char* one;   ///< after the count 1
  const char* many;  ///< after another count
  bool prevents_filling;
};

/// In the order of SurfaceFault.
constexpr Words kFaultWords[kNumSurfaceFaults] = {
    {"crossing", "pair of triangles crosses", "pairs of triangles cross", true},
    {"face_contact", "pair of triangles overlaps in one plane", "pairs of triangles overlap in one plane", true},
    {"edge_contact", "edge at which the surface touches itself", "edges at which the surface touches itself", false},
    {"vertex_contact", "point at which the surface touches itself", "points at which the surface touches itself",
     false},
    {"open_rim", "hole", "holes", true},
    {"pinhole", "pinhole", "pinholes", true},
    {"fin", "edge of a fin has three triangles or more", "edges of fins have three triangles or more", true},
    {"interface", "edge of three triangles or more divides the inside into regions",
     "edges of three triangles or more divide the inside into regions", false},
    {"disagreement", "edge whose two triangles disagree about the outside",
     "edges whose two triangles disagree about the outside", true},
    {"wall_outward", "part inside another faces the same way: the wall of a void that points outward",
     "parts inside others face the same way: walls of voids that point outward", true},
    {"part_inward", "part points inward", "parts point inward", false},
    {"part_in_void", "solid part lies in a void", "solid parts lie in voids", false},
    {"repeated_triangle", "triangle is there more than once", "triangles are there more than once", true},
    {"flat_triangle", "triangle has no area", "triangles have no area", false},
    {"thin_wall", "thinnest wall", "thinnest walls", false},
    {"thin_gap", "thinnest gap", "thinnest gaps", false},
    {"sharp_angle", "edge sharper than 30 degrees", "edges sharper than 30 degrees", false}};

const Words& words_of(SurfaceFault fault) { return kFaultWords[static_cast<std::size_t>(fault)]; }

std::string triangles_text(const SurfacePlace& place) {
  if (place.triangles[0] == kNoIndex) return "";
  const std::string first = std::to_string(place.triangles[0]);
  if (place.triangles[1] == kNoIndex) return " (triangle " + first + ")";
  return " (triangles " + first + " and " + std::to_string(place.triangles[1]) + ")";
}

std::string parts_text(const SurfacePlace& place, const char* between) {
  if (place.parts[1] == kNoIndex || place.parts[0] == place.parts[1]) return "";
  return ", part " + std::to_string(place.parts[0]) + between + std::to_string(place.parts[1]);
}

std::string width_text(const SurfacePlace& place, double diagonal) {
  return formatted("%.4g wide (%.3g %% of the diagonal)", place.measure, 100 * place.measure / diagonal);
}

}  // namespace

bool prevents_filling(SurfaceFault fault) { return words_of(fault).prevents_filling; }

std::string to_string(SurfaceFault fault) { return words_of(fault).name; }

std::string to_text(const Vec3& point) { return formatted("(%.6g, %.6g, %.6g)", point.x(), point.y(), point.z()); }

std::string to_text(const SurfaceFinding& finding, double diagonal) {
  const Words& words = words_of(finding.fault);
  const SurfacePlace place = finding.places.empty() ? SurfacePlace{} : finding.places.front();
  if (finding.fault == SurfaceFault::thin_wall || finding.fault == SurfaceFault::thin_gap)
    return std::string(words.one) + ": " + width_text(place, diagonal) + ", at " + to_text(place.at) +
           triangles_text(place);
  std::string text = (finding.is_complete ? "" : "more than ") + std::to_string(finding.count) + ' ' +
                     (finding.count == 1 ? words.one : words.many);
  if (finding.places.empty()) return text;
  if (finding.fault == SurfaceFault::open_rim || finding.fault == SurfaceFault::pinhole)
    text += formatted(", %s a rim %.4g long (%.3g %% of the diagonal)", finding.count > 1 ? "the first with" : "with",
                      place.measure, 100 * place.measure / diagonal) +
            " around " + to_text(place.at);
  else if (finding.fault == SurfaceFault::sharp_angle)
    text += formatted(", the sharpest of %.3g degrees", place.measure);
  if (finding.fault != SurfaceFault::open_rim && finding.fault != SurfaceFault::pinhole)
    text += (finding.count > 1 && finding.fault != SurfaceFault::sharp_angle ? ", the first at " : ", at ") +
            to_text(place.at) + (place.to ? " to " + to_text(*place.to) : "");
  const bool nested = finding.fault == SurfaceFault::wall_outward || finding.fault == SurfaceFault::part_in_void ||
                      finding.fault == SurfaceFault::part_inward;
  return text + triangles_text(place) + parts_text(place, nested ? " in part " : " and part ");
}

std::string obstacles_for_cells(const SurfaceDiagnosis& diagnosis, double cell) {
  std::string text;
  const auto tell = [&](const std::string& cause) { text += (text.empty() ? "" : "; ") + cause; };
  for (const auto& [fault, name] : {std::pair(SurfaceFault::thin_wall, "wall"), {SurfaceFault::thin_gap, "gap"}})
    if (const SurfaceFinding* found = diagnosis.find(fault); found && found->places.front().measure < cell)
      tell(std::string("the thinnest ") + name + " is " + width_text(found->places.front(), diagnosis.diagonal) +
           " at " + to_text(found->places.front().at) + formatted(", thinner than a cell (%.4g)", cell));
  for (const SurfaceFault fault : {SurfaceFault::crossing, SurfaceFault::face_contact, SurfaceFault::edge_contact,
                                   SurfaceFault::vertex_contact, SurfaceFault::open_rim})
    if (const SurfaceFinding* found = diagnosis.find(fault)) tell(to_text(*found, diagnosis.diagonal));
  return text;
}

}  // namespace subvol
