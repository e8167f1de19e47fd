// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/diagnosis_report.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/loading.h"
#include "cli/runs/writing.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/target/surface_wrap.h"
#include "subvol/fit/target/touching_solids.h"
#include "subvol/io/label_grid_io.h"
#include "subvol/io/nodal_mesh.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/surface/boundary.h"
#include "subvol/templates/label_surface.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <sstream>
#include <utility>
#include <variant>

namespace subvol::cli {

using namespace internal;
namespace {

Json numbers_json(const std::array<Index, 2>& numbers) {
  Json json = Json::array();
  for (const Index n : numbers)
    if (n != kNoIndex) json.push_back(n);
  return json;
}

/// Name of `SurfacePlace::measure`; null if a fault has none.
const char* measure_of(SurfaceFault fault) {
  switch (fault) {
    case SurfaceFault::open_rim:
    case SurfaceFault::pinhole: return "length";
    case SurfaceFault::thin_wall:
    case SurfaceFault::thin_gap: return "width";
    case SurfaceFault::sharp_angle: return "degrees";
    case SurfaceFault::wall_outward:
    case SurfaceFault::part_inward:
    case SurfaceFault::part_in_void: return "volume";
    default: return nullptr;
  }
}

Json place_json(const SurfacePlace& place, const SurfaceFinding& finding, double diagonal) {
  Json json{{"at", point_json(place.at)}};
  if (place.to) json["to"] = point_json(*place.to);
  if (const char* name = measure_of(finding.fault)) {
    json[name] = place.measure;
    if (name == std::string("length") || name == std::string("width"))
      json["percent"] = diagonal > 0 ? 100 * place.measure / diagonal : 0;
  }
  json["triangles"] = numbers_json(place.triangles);
  json["parts"] = numbers_json(place.parts);
  return json;
}

Json parts_json(const std::vector<SurfacePart>& parts) {
  Json json = Json::array();
  for (const SurfacePart& part : parts) {
    if (json.size() == kMostPlaces) break;
    Json one{{"triangles", part.triangles}, {"first_triangle", part.first_triangle}, {"closed", part.is_closed}};
    if (part.is_closed) {
      one["volume"] = part.volume;
      one["depth"] = part.depth;
    }
    json.push_back(std::move(one));
  }
  return json;
}

std::string place_line(const SurfacePlace& place) {
  std::string text = std::string(22, ' ') + subvol::to_text(place.at);
  if (place.to) text += " to " + subvol::to_text(*place.to);
  if (place.triangles[0] == kNoIndex) return text + '\n';
  text += place.triangles[1] == kNoIndex ? ", triangle " : ", triangles ";
  text += std::to_string(place.triangles[0]);
  if (place.triangles[1] != kNoIndex) text += " and " + std::to_string(place.triangles[1]);
  return text + '\n';
}

/// Says how the references of cells have become numbers of regions.
std::string renumbering(const std::filesystem::path& path, std::span<const int> references,
                        std::span<const Group> regions) {
  constexpr std::size_t kMostListedReferences = 10;
  std::string text = path.string() + ": a reference is below 1, so the regions are numbered anew:";
  for (std::size_t i = 0; i < std::min(kMostListedReferences, references.size()); ++i)
    text += formatted("%s %d becomes %d", i == 0 ? "" : ",", references[i], regions[i].number);
  return references.size() > kMostListedReferences ? text + " and so on" : text;
}

SurfaceRepair wrap_to_fill(const std::filesystem::path& path, double percent, std::vector<std::string>& warnings) {
  if (is_label_grid_file(path)) throw UsageError("--wrap: " + path.string() + " is a segmentation, expected a surface");
  SurfaceRepair result;
  result.surface = wrap_surface(load_surface(path, warnings), {.voxel_percent = percent}, interrupted);
  result.done.push_back(formatted("target: wrapped with voxels of %g %% of its diagonal: %zu triangles", percent,
                                  result.surface.triangles.size()));
  return result;
}

/// Repairs named solids that touch along triangles of which the reader drops the copies; nothing if the surface is
/// another one. Warnings of the reader from `told` on are replaced.
std::optional<SurfaceRepair> repaired_with_copies(const std::filesystem::path& path, RegionRule rule, std::size_t told,
                                                  std::vector<std::string>& warnings) {
  std::vector<std::string> own_warnings;
  const TriangleMesh surface = triangulate(read_polygon_mesh(path, &own_warnings));
  std::optional<TouchingSolids> solids = touching_solids(surface, interrupted, rule);
  if (!solids) return std::nullopt;
  warnings.resize(told);
  warnings.insert(warnings.end(), own_warnings.begin(), own_warnings.end());
  return repair_of_solids(*std::move(solids));
}

/// Repairs a surface with the copies of triangles that the reader drops, if these tell more: two that face each other
/// are a sheet between two regions, or walls of zero width where solids touch.
///
/// num_read  triangles of the surface without the copies.
/// repair    of that surface; replaced if the copies tell more.
/// warnings  those of the reader from `told` on are replaced with it: no copy was dropped then.
void consider_copies(const std::filesystem::path& path, RegionRule rule, std::size_t num_read, std::size_t told,
                     SurfaceRepair& repair, std::vector<std::string>& warnings) {
  if (repair.regions || interrupted()) return;
  std::vector<std::string> own_warnings;
  const TriangleMesh surface = triangulate(read_polygon_mesh(path, &own_warnings));
  if (surface.triangles.size() == num_read) return;
  if (repair.done.empty() && rule == RegionRule::automatic) repair.regions = find_regions(surface, rule);
  if (repair.regions || repair.is_fillable) return;
  SurfaceRepair with_copies = repair_surface(surface, interrupted, rule);
  if (!with_copies.is_fillable) return;
  repair = std::move(with_copies);
  warnings.resize(told);
  warnings.insert(warnings.end(), own_warnings.begin(), own_warnings.end());
}

}  // namespace

FileSurface file_surface(const PolygonMesh& polygons) {
  FileSurface surface;
  surface.mesh = triangulate(polygons, &surface.face_of_triangle);
  return surface;
}

SurfaceRepair load_to_fill(const std::filesystem::path& path, const FillingOptions& options,
                           std::vector<std::string>& warnings) {
  const RegionRule rule = options.rule;
  if (options.wrap_percent) return wrap_to_fill(path, *options.wrap_percent, warnings);
  if (rule != RegionRule::merge && is_nodal_extension(path)) {
    std::vector<std::string> own_warnings;
    const LoadedMesh mesh = load_mesh(path, own_warnings);
    const auto* cells = std::get_if<VolumeMesh>(&mesh);
    if (cells && region_references(*cells).size() > 1) {
      warnings.insert(warnings.end(), own_warnings.begin(), own_warnings.end());
      const std::vector<int> references = region_references(*cells);
      SurfaceRepair loaded;
      loaded.regions = surface_of_regions(*cells);
      if (loaded.regions->regions.front().number != references.front())
        warnings.push_back(renumbering(path, references, loaded.regions->regions));
      loaded.surface = loaded.regions->mesh;
      return loaded;
    }
  }
  if (!is_label_grid_file(path)) {
    const std::size_t told = warnings.size();
    const TriangleMesh read = load_surface(path, warnings);
    const bool may_have_copies = warnings.size() > told && is_surface_file(path);
    if (may_have_copies && !read.face_groups.empty())
      if (std::optional<SurfaceRepair> repair = repaired_with_copies(path, rule, told, warnings)) return *repair;
    SurfaceRepair repair = repair_surface(read, interrupted, rule);
    if (may_have_copies) consider_copies(path, rule, read.triangles.size(), told, repair, warnings);
    return repair;
  }
  LabelGrid grid = read_label_grid(path);
  if (rule == RegionRule::merge)
    for (int& label : grid.labels) label = std::min(label, 1);
  RegionSurface surface = surface_of_labels(grid, {.cancelled = interrupted});
  if (surface.regions.empty()) throw EndedEarly(path.string() + ": interrupted; nothing was written", kInterrupted);
  SurfaceRepair loaded;
  for (const std::string& note : surface.notes) loaded.notes.push_back("target: " + note);
  if (surface.regions.size() > 1) {
    loaded.surface = surface.mesh;
    loaded.regions = std::move(surface);
  } else {
    loaded.surface = outer_surface(surface);
  }
  return loaded;
}

std::string to_text(const RegionSurface& regions) {
  std::string text = formatted("%-20s%zu", "regions", regions.regions.size());
  for (std::size_t r = 0; r < regions.regions.size(); ++r) {
    const Group& region = regions.regions[r];
    text += (r == 0 ? ": " : ", ") + (region.name.empty() ? "region " + std::to_string(region.number) : region.name) +
            formatted(" of volume %.6g", regions.volumes[r]);
  }
  return text + '\n';
}

Json regions_json(const RegionSurface& regions) {
  Json json = Json::array();
  for (std::size_t r = 0; r < regions.regions.size(); ++r) {
    Json one{{"reference", regions.regions[r].number}, {"volume", regions.volumes[r]}};
    if (!regions.regions[r].name.empty()) one["name"] = as_utf8(regions.regions[r].name);
    json.push_back(std::move(one));
  }
  return json;
}

void number_by_faces(SurfaceDiagnosis& diagnosis, const FileSurface& surface) {
  const auto rename = [&](Index& triangle) {
    if (triangle != kNoIndex) triangle = surface.face_of_triangle[triangle];
  };
  for (SurfaceFinding& finding : diagnosis.findings)
    for (SurfacePlace& place : finding.places)
      for (Index& triangle : place.triangles) rename(triangle);
  for (SurfacePart& part : diagnosis.parts) rename(part.first_triangle);
}

Json diagnosis_json(const SurfaceDiagnosis& diagnosis) {
  Json findings = Json::object();
  for (const SurfaceFinding& finding : diagnosis.findings) {
    Json places = Json::array();
    for (const SurfacePlace& place : finding.places) places.push_back(place_json(place, finding, diagnosis.diagonal));
    findings[to_string(finding.fault)] = {{"count", finding.count},
                                          {"complete", finding.is_complete},
                                          {"prevents_filling", prevents_filling(finding.fault)},
                                          {"first", std::move(places)}};
  }
  Json json{{"fillable", diagnosis.is_fillable()},  {"triangles", diagnosis.num_triangles},
            {"vertices", diagnosis.num_vertices},   {"diagonal", diagnosis.diagonal},
            {"volume", diagnosis.volume},           {"num_parts", diagnosis.parts.size()},
            {"parts", parts_json(diagnosis.parts)}, {"findings", std::move(findings)}};
  if (diagnosis.is_cancelled) json["ended_early"] = true;
  return json;
}

std::string to_text(const SurfaceDiagnosis& diagnosis) {
  std::ostringstream text;
  text << formatted("%-20s", "surface") << diagnosis.num_triangles
       << (diagnosis.num_triangles == 1 ? " triangle, " : " triangles, ") << diagnosis.num_vertices << " vertices, "
       << diagnosis.parts.size() << (diagnosis.parts.size() == 1 ? " part" : " parts")
       << formatted(", diagonal %.6g, volume %.6g\n", diagnosis.diagonal, diagnosis.volume);
  std::string reasons;
  for (const SurfaceFinding& finding : diagnosis.findings) {
    text << formatted("%-20s", to_string(finding.fault).c_str()) << subvol::to_text(finding, diagnosis.diagonal)
         << '\n';
    for (std::size_t i = 1; i < finding.places.size(); ++i) text << place_line(finding.places[i]);
    if (prevents_filling(finding.fault)) reasons += (reasons.empty() ? "" : ", ") + to_string(finding.fault);
  }
  if (reasons.empty())
    text << "can be filled as it is\n";
  else
    text << "CANNOT BE FILLED AS IT IS: " << reasons << '\n';
  return text.str();
}

FillingForecast forecast_filling(const std::filesystem::path& path, const std::vector<std::string>& told) {
  std::vector<std::string> warnings;
  try {
    FillingForecast forecast{load_to_fill(path, {}, warnings), ""};
    const std::string file = path.string() + ": ";
    std::vector<std::string> of_reader;
    for (const std::string& warning : warnings)
      if (std::ranges::find(told, warning) == told.end())
        of_reader.push_back(warning.starts_with(file) ? warning.substr(file.size()) : warning);
    std::vector<std::string>& done = forecast.repair.done;
    done.insert(done.begin(), of_reader.begin(), of_reader.end());
    return forecast;
  } catch (const InputError& e) {
    return {{}, e.what()};
  }
}

std::string to_text(const FillingForecast& forecast) {
  const auto without_subject = [](const std::string& remark) {
    constexpr std::string_view kSubject = "target: ";
    return remark.starts_with(kSubject) ? remark.substr(kSubject.size()) : remark;
  };
  if (!forecast.refusal.empty()) return "a fit refuses it:   " + without_subject(forecast.refusal) + '\n';
  std::string text;
  for (const std::string& done : forecast.repair.done) text += "a fit repairs it:   " + without_subject(done) + '\n';
  for (const std::string& note : forecast.repair.notes) text += "a fit notes:        " + without_subject(note) + '\n';
  if (forecast.repair.regions)
    text += formatted("a fit fills it:     as %zu regions\n", forecast.repair.regions->regions.size());
  if (!forecast.repair.is_fillable)
    text += "a fit goes on with what is left, and may be far off or meet itself there\n";
  return text;
}

Json filling_json(const FillingForecast& forecast) {
  if (!forecast.refusal.empty()) return {{"refused", as_utf8(forecast.refusal)}};
  Json json{
      {"repairs", forecast.repair.done}, {"notes", forecast.repair.notes}, {"complete", forecast.repair.is_fillable}};
  if (forecast.repair.regions) json["regions"] = forecast.repair.regions->regions.size();
  return json;
}

void repair_to_fill(Target& target, RegionRule rule, std::vector<std::string>& warnings) {
  auto* surface = std::get_if<TriangleMesh>(&target);
  if (!surface) return;
  SurfaceRepair repair = repair_surface(*surface, interrupted, rule);
  add_remarks(repair, warnings);
  *surface = std::move(repair.surface);
}

void add_remarks(const SurfaceRepair& repair, std::vector<std::string>& warnings) {
  warnings.insert(warnings.end(), repair.done.begin(), repair.done.end());
  warnings.insert(warnings.end(), repair.notes.begin(), repair.notes.end());
}

}  // namespace subvol::cli
