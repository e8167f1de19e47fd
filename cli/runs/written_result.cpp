// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/written_result.h"

#include "cli/runs/check_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/report.h"
#include "subvol/base/format.h"
#include "subvol/base/process_memory.h"
#include "subvol/base/version.h"
#include "subvol/export/high_order_file.h"
#include "subvol/io/mesh_io.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <string_view>

namespace subvol::cli {

using namespace internal;
namespace {

/// Points per direction at which maps are compared: Lagrange nodes of the largest order, and those half-way between.
constexpr int kMapSamples = 25;

/// The first output of this part and extension that is a regular file; null if there is none.
const Output* first_file(std::span<const Output> outputs, Part part, std::string_view extension) {
  const auto found = std::find_if(outputs.begin(), outputs.end(), [&](const Output& output) {
    return output.part == part && output.extension == extension && std::filesystem::is_regular_file(output.path);
  });
  return found == outputs.end() ? nullptr : &*found;
}

}  // namespace

std::optional<VolumeMesh> written_cells(std::span<const Output> outputs, Part part) {
  for (const char* extension : {".mesh", ".vtk"})
    if (const Output* file = first_file(outputs, part, extension))
      return read_volume_mesh(file->path, {.check = false});
  return {};
}

std::optional<HighOrderMesh> written_curved_cells(std::span<const Output> outputs) {
  if (const Output* file = first_file(outputs, Part::result, ".vtu")) return read_high_order(file->path).mesh;
  return {};
}

std::vector<std::string> linear_cells_warnings(const MeshCheck& check) {
  if (check.valid()) return {};
  std::string found;
  if (check.quality)
    found = formatted(": %zu of %zu are inverted, %zu pairs of triangles of their boundary intersect",
                      check.quality->inverted_cells, check.quality->num_cells, check.num_intersecting_triangle_pairs);
  return {"the linear cells that were written for the curved ones are not valid" + found + "; --intervals of " +
          "`convert` makes smaller ones of a .vtu"};
}

std::vector<PolynomialCells> check_polynomial_cells(std::span<const Output> outputs, const HighOrderMesh& mesh,
                                                    double map_tolerance_percent,
                                                    const std::function<MeshCheck(const HighOrderMesh&)>& check) {
  std::vector<PolynomialCells> all;
  for (const Output& output : outputs) {
    if (output.part != Part::result || !holds_polynomial_cells(output)) continue;
    const PolynomialMap written = file_cells(mesh, output.extension, map_tolerance_percent);
    if (written.distance_bound == 0) continue;
    const double scale = 100 / vertex_diagonal(mesh), percent = scale * written.distance_bound;
    const double sampled = scale * sampled_distance(mesh, written.mesh, kMapSamples);
    all.push_back({output.path.string(), percent, sampled, percent <= map_tolerance_percent, check(written.mesh)});
  }
  return all;
}

std::vector<std::string> polynomial_cells_warnings(const PolynomialCells& cells) {
  std::vector<std::string> warnings;
  const bool is_serendipity = cells.file.ends_with(".inp") || cells.file.ends_with(".bdf");
  if (!cells.is_close)
    warnings.push_back(cells.file + formatted(": its polynomial cells are %.3g %% of the diagonal away from the curved "
                                              "cells at sampled points, and proved to be within %.3g %%, which is more "
                                              "than --map-tolerance; %s",
                                              cells.sampled_percent, cells.distance_percent,
                                              is_serendipity ? "its elements have nodes on edges only, and lack those "
                                                               "inside faces"
                                                             : "the basis legendre needs no such approximation up to "
                                                               "the largest order of the format"));
  if (!cells.check.valid()) {
    std::string why;
    if (const auto& quality = cells.check.quality; quality && !quality->certificate.not_certified.empty())
      why = formatted(": %zu of %zu are not certified", quality->certificate.not_certified.size(), quality->num_cells);
    else if (!cells.check.intersecting_faces.empty())
      why = formatted(": %zu pairs of faces of their boundary meet", cells.check.intersecting_faces.size());
    warnings.push_back(cells.file + ": its polynomial cells, which other programs compute with, are not valid" + why);
  }
  return warnings;
}

Json polynomial_cells_json(std::span<const PolynomialCells> all) {
  Json json = Json::array();
  for (const PolynomialCells& cells : all) {
    Json one{{"file", as_utf8(cells.file)},
             {"distance_from_map_percent", cells.distance_percent},
             {"sampled_distance_from_map_percent", cells.sampled_percent},
             {"within_map_tolerance", cells.is_close}};
    one.update(check_json(cells.check));
    json.push_back(std::move(one));
  }
  return json;
}

int polynomial_cells_status(std::span<const PolynomialCells> all) {
  const auto count = [&](auto is_wrong) { return std::count_if(all.begin(), all.end(), is_wrong); };
  if (count([](const PolynomialCells& cells) { return !cells.check.valid(); }) > 0) return kFailed;
  return count([](const PolynomialCells& cells) { return !cells.is_close; }) > 0 ? kNotConverged : kDone;
}

int write_checked(const RunOptions& run, std::vector<Output> outputs, const VolumeMesh& mesh,
                  const std::function<void(const Output&)>& write, const std::vector<std::string>& warnings,
                  const Json& details) {
  require_extent(mesh.positions, "mesh to be written");
  const std::vector<std::string> failures = write_each(outputs, write);
  const std::optional<VolumeMesh> written = written_cells(outputs);
  const MeshCheck check = check_mesh(written ? *written : mesh);
  if (!run.report.empty()) {
    Json json{{"subvol", version()}};
    json.update(details);
    json.update(check_json(check));
    json["warnings"] = warnings_json(warnings, failures);
    json["peak_memory_bytes"] = internal::peak_memory_bytes();
    json["outputs"] = output_names(outputs);
    write_report(run.report, json);
  }
  if (!run.quiet) {
    for (const std::string& warning : warnings) std::cerr << "subvol: warning: " << warning << '\n';
    std::cerr << to_text(check);
    for (const Output& output : outputs) std::cerr << "wrote " << output.path.string() << '\n';
  }
  require_all_written(failures);
  return check.valid() ? kDone : kFailed;
}

void hold_to(const DistancesAsked& asked, const MeshCheck& found, FitReport& report) {
  if (!found.distance) return;
  hold_to(asked.mean_percent, "as written, the mean", found.mean_distance_percent(), report);
  hold_to(asked.max_percent, "as written, the largest", found.max_distance_percent(), report);
}

void hold_to(std::optional<double> most_percent, const char* which, double percent, FitReport& report) {
  if (report.stop_reason != StopReason::converged || !most_percent || percent <= *most_percent) return;
  report.stop_reason = StopReason::tolerance_missed;
  report.explanation =
      formatted("%s distance of %.6g %% is above the tolerance of %.6g %%", which, percent, *most_percent);
}

void hold_to_quality(std::optional<double> least, const MeshCheck& found, FitReport& report) {
  if (!least || !found.quality || report.stop_reason != StopReason::converged) return;
  if (found.quality->min_scaled_jacobian >= *least) return;
  report.stop_reason = StopReason::tolerance_missed;
  report.explanation = formatted("the least scaled Jacobian, %.3f, is below the %.3f asked for",
                                 found.quality->min_scaled_jacobian, *least);
}

std::vector<std::string> warnings_of_quality(double aim, const MeshCheck& found) {
  constexpr double kReachedAimTolerance = 0.01;  // a fit ends at an aim that is rounded
  if (aim == 0 || !found.quality || found.quality->worst_cells.empty()) return {};
  const QualityReport& quality = *found.quality;
  if (quality.min_scaled_jacobian >= aim - kReachedAimTolerance) return {};
  const auto poor = std::ranges::count_if(quality.cell_minima, [&](double least) { return least < aim; });
  const Vec3& place = quality.worst_cells.front().center;
  return {formatted(
      "the quality of %.2f that was aimed at is missed by %zu of %zu cells: the least scaled Jacobian is %.3f, "
      "at (%.6g, %.6g, %.6g)",
      aim, static_cast<std::size_t>(poor), quality.num_cells, quality.min_scaled_jacobian, place.x(), place.y(),
      place.z())};
}

}  // namespace subvol::cli
