// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/check_report.h"
#include "cli/runs/diagnosis_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/face_groups.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/loading.h"
#include "cli/runs/outputs.h"
#include "cli/runs/progress.h"
#include "cli/runs/report.h"
#include "cli/runs/standard_output.h"
#include "cli/runs/writing.h"
#include "cli/verbs/commands.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/process_memory.h"
#include "subvol/base/version.h"
#include "subvol/export/curved_file.h"
#include "subvol/fit/target/touching_solids.h"
#include "subvol/io/surface_io.h"

#include <iostream>
#include <memory>
#include <numeric>
#include <optional>

namespace subvol::cli {
namespace {

struct CheckArguments {
  RunOptions run;
  std::string mesh, target, region;
  double chord_percent = WritingOptions{}.chord_percent;
  bool json = false;
};

/// Results of checking the mesh in a file.
struct Checked {
  MeshCheck check;
  Json input;                             ///< description of the mesh
  std::optional<SubdivisionAudit> audit;  ///< for a mesh that may be subdivided
  std::optional<LagrangeCheck> lagrange;  ///< for the cells beside an exact map
  GroupsFound groups{};                   ///< of the mesh beside those of the target

  bool valid() const { return check.valid() && (!lagrange || lagrange->valid()); }
};

/// Calls check(geometry) with a pointer to the target's geometry, whatever its type; null if there is no target.
template <class Check>
MeshCheck against(const std::optional<Target>& target, const Check& check) {
  if (!target) return check(static_cast<const TriangleMesh*>(nullptr));
  return std::visit([&](const auto& geometry) { return check(&geometry); }, *target);
}

Checked check_linear(const CheckArguments& arguments, const VolumeMesh& mesh, const std::optional<Target>& target,
                     const WorkProgress& progress) {
  const std::optional<Target> outer = target ? std::optional(outer_target(*target, mesh)) : std::nullopt;
  Checked checked{against(outer, [&](auto geometry) { return check_mesh(mesh, geometry, {.progress = progress}); }),
                  describe(arguments.mesh, mesh), std::nullopt, std::nullopt};
  checked.audit = checked.check.subdivision_audit;
  if (outer && checked.check.quality) checked.groups = compare_groups(*outer, mesh);
  return checked;
}

Checked check_high_order(const CheckArguments& arguments, const HighOrderFile& file,
                         const std::optional<Target>& target, const WorkProgress& progress) {
  const HighOrderMesh& mesh = file.mesh;
  const CurvedBoundary boundary = curved_boundary(mesh, arguments.chord_percent);
  const MeshCheckOptions options{.labels = {file.references, file.regions}, .progress = progress};
  Checked checked{against(target, [&](auto geometry) { return check_mesh(mesh, boundary, geometry, options); }),
                  describe(arguments.mesh, mesh), std::nullopt, std::nullopt};
  if (arguments.region.empty() && holds_exact_map(arguments.mesh))
    checked.lagrange = check_lagrange_cells(arguments.mesh, mesh);
  if (target) checked.groups = compare_groups(*target, file);
  return checked;
}

Json report_json(const CheckArguments& arguments, const CLI::App& verb, const Checked& checked,
                 const std::vector<std::string>& warnings) {
  Json json{{"subvol", version()},
            {"command", "check"},
            {"options", options_in_force(verb)},
            {"input", {{"mesh", checked.input}}},
            {"valid", checked.valid()}};
  if (!arguments.target.empty()) json["input"]["target"] = arguments.target;
  json.update(check_json(checked.check));
  json["valid"] = checked.valid();
  if (checked.lagrange) json["lagrange_cells"] = lagrange_json(*checked.lagrange);
  if (checked.audit) json["audit"] = audit_json(*checked.audit);
  if (!checked.groups.groups.empty()) json["groups"] = groups_json(checked.groups.groups);
  json["warnings"] = warnings;
  json["peak_memory_bytes"] = internal::peak_memory_bytes();
  return json;
}

/// Moves the verdict to the end, as in the text of the check itself.
std::string text_of(const Checked& checked) {
  std::string text = to_text(checked.check);
  if (!checked.lagrange) return text;
  const std::size_t verdict = text.rfind('\n', text.size() - 2) + 1;
  return text.substr(0, verdict) + to_text(*checked.lagrange) + (checked.valid() ? "valid\n" : "NOT VALID\n");
}

void tell_check(const CheckArguments& arguments, const std::vector<std::string>& warnings, const Json& json,
                const std::string& text) {
  if (!arguments.run.quiet)
    for (const std::string& warning : warnings) std::cerr << "subvol: warning: " << warning << '\n';
  if (!arguments.run.report.empty()) write_report(arguments.run.report, json);
  if (arguments.json)
    print(json_text(json));
  else if (!arguments.run.quiet)
    print(text);
}

/// Returns the regions of a surface, if it has several.
std::optional<RegionSurface> regions_of_surface(const TriangleMesh& surface) {
  if (std::optional<internal::TouchingSolids> solids = internal::touching_solids(surface, interrupted))
    return std::move(solids->regions);
  return find_regions(surface);
}

/// Says what is in the way of filling a surface.
int check_surface(const CheckArguments& arguments, const PolygonMesh& polygons, const CLI::App& verb,
                  const std::vector<std::string>& warnings) {
  if (!arguments.target.empty())
    throw UsageError("--target: " + arguments.mesh + " is a surface; only a volume mesh is compared with a target");
  const FileSurface surface = file_surface(polygons);
  catch_interrupt();
  SurfaceDiagnosis diagnosis = diagnose(surface.mesh, interrupted);
  number_by_faces(diagnosis, surface);
  Json json{{"subvol", version()},
            {"command", "check"},
            {"options", options_in_force(verb)},
            {"input", {{"surface", describe(arguments.mesh, surface.mesh)}}}};
  json.update(diagnosis_json(diagnosis));
  std::string text = to_text(diagnosis);
  if (!diagnosis.is_cancelled && diagnosis.parts.size() > 1)
    if (const std::optional<RegionSurface> regions = regions_of_surface(surface.mesh)) {
      // A sheet between two regions counts for none in the sum over the triangles.
      diagnosis.volume = std::accumulate(regions->volumes.begin(), regions->volumes.end(), 0.0);
      json["volume"] = diagnosis.volume;
      json["regions"] = regions_json(*regions);
      text = to_text(*regions) + to_text(diagnosis);
    }
  if (!diagnosis.is_cancelled && !diagnosis.is_fillable()) {
    const FillingForecast forecast = forecast_filling(arguments.mesh, warnings);
    if (!interrupted()) {
      json["filling"] = filling_json(forecast);
      text += to_text(forecast);
    }
  }
  json["warnings"] = warnings;
  json["peak_memory_bytes"] = internal::peak_memory_bytes();
  tell_check(arguments, warnings, json, text);
  if (diagnosis.is_cancelled || interrupted()) return kInterrupted;
  return diagnosis.is_fillable() ? kDone : kFailed;
}

int run_check(const CheckArguments& arguments, const CLI::App& verb) {
  checked_outputs(arguments.run, {});
  apply_resources(arguments.run);
  require_known_file(arguments.mesh);
  require_choice_of_references(arguments.mesh, arguments.run.references);
  std::vector<std::string> warnings;
  LoadedMesh mesh = load_mesh(arguments.mesh, warnings, false, arguments.run.references);
  if (!arguments.region.empty()) {
    if (auto* cells = std::get_if<VolumeMesh>(&mesh))
      *cells = cells_of_region(*cells, arguments.region);
    else if (auto* curved = std::get_if<HighOrderFile>(&mesh))
      *curved = cells_of_region(*curved, arguments.region);
    else
      throw UsageError("--region: " + arguments.mesh + " is a surface, which has no cells to choose from");
  }
  if (const auto* surface = std::get_if<PolygonMesh>(&mesh)) return check_surface(arguments, *surface, verb, warnings);
  std::optional<Target> target;
  if (!arguments.target.empty()) target = load_target(arguments.target, warnings);
  ProgressTeller teller(arguments.run.progress, arguments.run.quiet || arguments.json);
  const auto* curved = std::get_if<HighOrderFile>(&mesh);
  const Checked checked = curved ? check_high_order(arguments, *curved, target, teller.work())
                                 : check_linear(arguments, std::get<VolumeMesh>(mesh), target, teller.work());
  teller.finish();
  warnings.insert(warnings.end(), checked.groups.warnings.begin(), checked.groups.warnings.end());
  tell_check(arguments, warnings, report_json(arguments, verb, checked, warnings), text_of(checked));
  return checked.valid() ? kDone : kFailed;
}

}  // namespace

void add_check_command(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("check",
                                      "Say what is true of a volume mesh (defects, quality, certificate, distance), or "
                                      "what is in the way of filling a surface");
  const auto arguments = std::make_shared<CheckArguments>();
  verb->add_option("MESH", arguments->mesh, "Mesh to check: " + cell_formats() + "; or surface: " + surface_formats())
      ->required()
      ->type_name("FILE");
  verb->add_option("--target", arguments->target,
                   "Measure the distance to this surface, or of these points: " + target_formats())
      ->type_name("SURFACE");
  verb->add_option("--chord", arguments->chord_percent,
                   "A curved boundary is measured as triangles this close to it, in percent of its box's diagonal")
      ->check(number_in(1e-4, 100.0))
      ->type_name("PERCENT")
      ->capture_default_str();
  add_references_option(*verb, arguments->run);
  verb->add_option("--region", arguments->region, "Check the linear cells of this region only: its name or reference")
      ->type_name("NAME");
  verb->add_flag("--json", arguments->json, "Print JSON instead of text");
  verb->add_option("--report", arguments->run.report, "Write the JSON to a file as well")->type_name("FILE.json");
  verb->add_flag("--force", arguments->run.force, "Replace a report that exists");
  verb->add_flag("--quiet", arguments->run.quiet, "Print only errors; the exit status says the rest");
  add_resource_options(*verb, arguments->run);
  verb->footer(R"(Exit status 0 if the mesh is valid (every cell proved positive, no defects), 1 if it is not.
For a surface: 0 if it bounds a solid as it stands, 1 if it does not.

Examples:
  subvol check bone_fine.mesh --target bone.off --json
  subvol check bone.off)");
  verb->callback([arguments, verb, &action] { action = [arguments, verb] { return run_check(*arguments, *verb); }; });
}

}  // namespace subvol::cli
