// SPDX-License-Identifier: GPL-3.0-or-later
// The verbs under `template` that make or edit a mesh by hand: grid, carve, extrude, pillow, refine, collapse, merge,
// split.

#include "cli/runs/check_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/loading.h"
#include "cli/runs/losses.h"
#include "cli/runs/outputs.h"
#include "cli/verbs/template_command.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/shell/extrude.h"
#include "subvol/surface/welded_surface.h"
#include "subvol/templates/carve.h"
#include "subvol/templates/cell_sheet.h"
#include "subvol/templates/cell_split.h"
#include "subvol/templates/pillow.h"
#include "subvol/templates/refine.h"
#include "subvol/templates/vertex_merge.h"
#include "subvol/templates/voxel_grid.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol::cli {
namespace {

constexpr int kUsualParts = 2;  // of `split --into parts`

/// Options of all edits; each verb offers those that it reads.
struct EditArguments : TemplateRun {
  std::string mesh, other, inside;
  std::vector<double> box, direction;
  std::vector<int> counts;
  std::vector<Index> cells, vertices;
  double size = 0, margin = 5, share = 0.5, thickness = 0, growth = 1, tolerance = 1e-6;
  int layers = 1;
  std::optional<int> parts;  ///< none: kUsualParts
  bool invert = false, thin = false;
  Marks read;
  std::string what;
};

Vec3 low_corner(const std::vector<double>& box) { return {box[0], box[1], box[2]}; }
Vec3 high_corner(const std::vector<double>& box) { return {box[3], box[4], box[5]}; }

VolumeMesh load_edited(EditArguments& arguments, const std::string& path) {
  VolumeMesh mesh = load_volume(path, arguments.warnings, true, arguments.run.references);
  const Marks marks = marks_of(mesh);
  arguments.read.references += marks.references;
  arguments.read.creases += marks.creases;
  arguments.read.corners += marks.corners;
  arguments.read.groups += marks.groups;
  return mesh;
}

VolumeMesh make_grid(EditArguments& arguments) {
  if (arguments.box.empty() == arguments.mesh.empty())
    throw UsageError("template grid: give a SURFACE or --box, one of them");
  if (arguments.counts.empty() == (arguments.size == 0))
    throw UsageError("template grid: give --counts or --size, one of them");
  Vec3 low, high;
  if (arguments.mesh.empty()) {
    low = low_corner(arguments.box);
    high = high_corner(arguments.box);
  } else {
    const auto box = box_around(load_surface(arguments.mesh, arguments.warnings), arguments.margin);
    low = box[0];
    high = box[1];
  }
  return voxel_mesh(arguments.counts.empty()
                        ? box_grid(low, high, arguments.size)
                        : box_grid(low, high, {arguments.counts[0], arguments.counts[1], arguments.counts[2]}));
}

/// Loads the surface of --inside. Nothing lies inside a surface that faces inward, so it is turned.
TriangleMesh load_outward(EditArguments& arguments) {
  TriangleMesh surface = load_surface(arguments.inside, arguments.warnings);
  if (internal::signed_volume_of(surface) >= 0) return surface;
  for (auto& triangle : surface.triangles) std::swap(triangle[1], triangle[2]);
  arguments.warnings.push_back(arguments.inside + ": its triangles face inward; they were turned");
  return surface;
}

/// The cells selected by --inside, --box, --list or --thin, of which exactly one must be given.
std::vector<char> chosen_cells(EditArguments& arguments, const VolumeMesh& mesh, const std::string& choices) {
  const int given = !arguments.inside.empty() + !arguments.box.empty() + !arguments.cells.empty() + arguments.thin;
  if (given != 1) throw UsageError("template " + choices);
  if (arguments.thin) return thin_cells(mesh);
  if (!arguments.inside.empty()) return cells_inside(mesh, load_outward(arguments), arguments.share);
  return arguments.box.empty() ? cells_listed(mesh, arguments.cells)
                               : cells_in_box(mesh, low_corner(arguments.box), high_corner(arguments.box));
}

VolumeMesh make_carved(EditArguments& arguments) {
  const VolumeMesh mesh = load_edited(arguments, arguments.mesh);
  const std::vector<char> chosen = chosen_cells(arguments, mesh, "carve: give one of --inside, --box and --list");
  return carve(mesh, [&](std::size_t c) { return (chosen[c] != 0) != arguments.invert; });
}

VolumeMesh make_refined(EditArguments& arguments) {
  const VolumeMesh mesh = load_edited(arguments, arguments.mesh);
  const std::vector<char> chosen =
      chosen_cells(arguments, mesh, "refine: give one of --inside, --box, --list and --thin");
  if (std::find(chosen.begin(), chosen.end(), 1) == chosen.end())
    arguments.warnings.push_back("no cell is chosen: the mesh stays as it is");
  return refine_at(mesh, vertices_of(mesh, chosen));
}

VolumeMesh make_extruded(EditArguments& arguments) {
  TaggedPolygons surface = load_tagged_polygons(arguments.mesh, arguments.warnings);
  ExtrudeOptions options{.thickness = arguments.thickness, .layers = arguments.layers, .growth = arguments.growth};
  if (!arguments.direction.empty())
    options.direction = Vec3(arguments.direction[0], arguments.direction[1], arguments.direction[2]);
  options.tags = std::move(surface.tags);
  return extrude(surface.polygons, options);
}

VolumeMesh make_collapsed(EditArguments& arguments) {
  const VolumeMesh mesh = load_edited(arguments, arguments.mesh);
  const Index a = arguments.vertices[0], b = arguments.vertices[1];
  VolumeMesh result = arguments.what == "edge"   ? collapse_edge(mesh, a, b)
                      : arguments.what == "face" ? collapse_face(mesh, a, b)
                                                 : collapse_sheet(mesh, a, b);
  if (internal::region_references(mesh).size() > 1)
    for (std::string& warning :
         warnings_of_volumes(measure_regions(result, nullptr), measure_regions(mesh, nullptr), "input"))
      arguments.warnings.push_back(std::move(warning));
  return result;
}

/// Warns of names that both of two meshes have, and of names that get another number beside those of the first.
void warn_of_same_names(std::span<const Group> first, std::span<const Group> second, const char* what,
                        std::vector<std::string>& warnings) {
  for (const Group& b : second) {
    const auto same = std::ranges::find(first, b);
    if (same != first.end()) {
      warnings.push_back(
          internal::formatted("both meshes have the %s %s: in the result it is one", what, label_of(b).c_str()));
    } else if (std::ranges::find(first, b.number, &Group::number) != first.end()) {
      warnings.push_back(
          internal::formatted("the %s %s of the second mesh gets another number: the first mesh has another %s %d",
                              what, label_of(b).c_str(), what, b.number));
    }
  }
}

VolumeMesh make_merged(EditArguments& arguments) {
  VolumeMesh mesh = load_edited(arguments, arguments.mesh);
  if (!arguments.other.empty()) {
    const VolumeMesh other = load_edited(arguments, arguments.other);
    warn_of_same_names(mesh.face_groups.groups, other.face_groups.groups, "group", arguments.warnings);
    warn_of_same_names(mesh.regions, other.regions, "region", arguments.warnings);
    mesh = joined(mesh, other);
  }
  Eigen::AlignedBox3d box;
  for (const Index v : mesh.cell_vertices) box.extend(mesh.positions[v]);
  return glue(mesh, arguments.tolerance / 100 * box.diagonal().norm());
}

VolumeMesh make_split(EditArguments& arguments) {
  const VolumeMesh mesh = load_edited(arguments, arguments.mesh);
  if (arguments.what == "tets" && !arguments.vertices.empty())
    throw UsageError("template split: --into tets cuts all cells; leave --edge out");
  if (arguments.what != "parts" && arguments.parts)
    throw UsageError("template split: --parts goes with --into parts, not with --into " + arguments.what);
  if (arguments.what == "tets") return split_into_tets(mesh);
  if (arguments.vertices.empty()) throw UsageError("template split: --into " + arguments.what + " needs --edge A B");
  const Index a = arguments.vertices[0], b = arguments.vertices[1];
  return arguments.what == "prisms" ? split_into_prisms(mesh, a, b)
                                    : split_sheet(mesh, a, b, arguments.parts.value_or(kUsualParts));
}

VolumeMesh make_pillowed(EditArguments& arguments) {
  return pillow(load_edited(arguments, arguments.mesh), arguments.cells);
}

using Maker = VolumeMesh (*)(EditArguments&);

int run_edit(EditArguments arguments, const CLI::App& verb, Maker make) {
  const std::vector<Output> outputs = template_outputs(arguments, verb);
  arguments.writing.source = arguments.mesh;
  const VolumeMesh mesh = make(arguments);
  warn_of_losses(arguments.read, marks_of(mesh), outputs, arguments.warnings);
  return write_template(arguments, verb, outputs, mesh, {{"input", arguments.mesh}});
}

/// Adds a verb with the options common to all edits; its own options follow.
/// example  arguments of the verb.
CLI::App* add_edit(CLI::App& group, Action& action, const std::shared_ptr<EditArguments>& arguments, const char* name,
                   const char* help, Maker make, const std::string& example) {
  CLI::App* verb = group.add_subcommand(name, help);
  verb->footer("Example:\n  subvol template " + std::string(name) + " " + example);
  add_template_options(*verb, *arguments);
  verb->callback([arguments, verb, make, &action] {
    action = [arguments, verb, make] { return run_edit(*arguments, *verb, make); };
  });
  return verb;
}

CLI::Option* add_mesh(CLI::App& verb, EditArguments& arguments) {
  add_references_option(verb, arguments.run);
  return verb.add_option("MESH", arguments.mesh, "Mesh to edit: " + volume_mesh_formats())
      ->required()
      ->type_name("FILE");
}

CLI::Option* add_box(CLI::App& verb, EditArguments& arguments, const char* help) {
  return verb.add_option("--box", arguments.box, help)->expected(6)->type_name("X0 Y0 Z0 X1 Y1 Z1");
}

CLI::Option* add_cell_list(CLI::App& verb, EditArguments& arguments, const char* help) {
  return verb.add_option("--list", arguments.cells, help)
      ->delimiter(',')
      ->check(whole_number_in(0, kMostIndex))
      ->type_name("CELL,...");
}

CLI::Option* add_vertices(CLI::App& verb, EditArguments& arguments, const char* name, const char* help) {
  return verb.add_option(name, arguments.vertices, help)
      ->expected(2)
      ->check(whole_number_in(0, kMostIndex))
      ->type_name("A B");
}

void add_grid(CLI::App& group, Action& action) {
  const auto a = std::make_shared<EditArguments>();
  CLI::App* verb =
      add_edit(group, action, a, "grid", "Fill a box with equal hexes", make_grid, "bone.off --size 2 -o grid.mesh");
  verb->add_option("SURFACE", a->mesh, "Take the box around this surface")->type_name("FILE");
  CLI::Option* box = add_box(*verb, *a, "Or take this box");
  verb->add_option("--counts", a->counts, "Cells along each axis")
      ->expected(3)
      ->check(whole_number_in(1, 100'000))
      ->type_name("NX NY NZ");
  verb->add_option("--size", a->size, "Or the approximate length of a cell")
      ->check(number_in(1e-300, 1e300))
      ->type_name("LENGTH");
  verb->add_option("--margin", a->margin,
                   "Distance between the surface and the box, in percent of the surface's diagonal")
      ->check(number_in(0.0, 1000.0))
      ->type_name("PERCENT")
      ->capture_default_str()
      ->excludes(box);
}

/// Adds --inside with --share, --box and --list.
void add_choice(CLI::App& verb, EditArguments& arguments) {
  CLI::Option* inside =
      verb.add_option("--inside", arguments.inside, "Cells that lie in this surface, by winding number")
          ->type_name("SURFACE");
  verb.add_option("--share", arguments.share, "Least share of a cell's volume that must lie inside")
      ->check(number_in(1e-6, 1.0))
      ->type_name("SHARE")
      ->capture_default_str()
      ->needs(inside);
  add_box(verb, arguments, "Cells whose center lies in a box");
  add_cell_list(verb, arguments, "These cells, numbered from 0");
}

void add_carve(CLI::App& group, Action& action) {
  const auto a = std::make_shared<EditArguments>();
  CLI::App* verb =
      add_edit(group, action, a, "carve", "Keep some cells", make_carved, "grid.mesh --inside bone.off -o core.mesh");
  add_mesh(*verb, *a);
  add_choice(*verb, *a);
  verb->add_flag("--invert", a->invert, "Keep the others instead");
}

void add_refine(CLI::App& group, Action& action) {
  const auto a = std::make_shared<EditArguments>();
  CLI::App* verb = add_edit(group, action, a, "refine", "Cut some hexes in 27, and those around so that they fit",
                            make_refined, "core.mesh --thin -o finer.mesh");
  add_mesh(*verb, *a);
  add_choice(*verb, *a);
  verb->add_flag("--thin", a->thin, "Cells that alone separate two sides of the mesh");
}

void add_extrude(CLI::App& group, Action& action) {
  const auto a = std::make_shared<EditArguments>();
  CLI::App* verb = add_edit(group, action, a, "extrude", "Stack hexes and prisms on the faces of a surface",
                            make_extruded, "plate.obj --thickness 3 --layers 2 -o slab.mesh");
  verb->add_option("SURFACE", a->mesh, "Surface of triangles and quads: " + surface_formats())
      ->required()
      ->type_name("FILE");
  verb->add_option("--thickness", a->thickness, "Thickness of all layers together")
      ->required()
      ->check(number_in(1e-300, 1e300))
      ->type_name("LENGTH");
  verb->add_option("--layers", a->layers, "Number of layers")
      ->check(whole_number_in(1, 10'000))
      ->type_name("N")
      ->capture_default_str();
  verb->add_option("--growth", a->growth, "Thickness of a layer relative to that of the one below")
      ->check(number_in(0.01, 100.0))
      ->type_name("FACTOR")
      ->capture_default_str();
  verb->add_option("--direction", a->direction, "Direction of the columns (default: along the surface's normals)")
      ->expected(3)
      ->type_name("X Y Z");
}

void add_pillow(CLI::App& group, Action& action) {
  const auto a = std::make_shared<EditArguments>();
  CLI::App* verb =
      add_edit(group, action, a, "pillow", "Put a layer of cells inside the boundary, or around some cells",
               make_pillowed, "core.mesh -o template.mesh");
  add_mesh(*verb, *a);
  add_cell_list(*verb, *a, "Around these cells, numbered from 0 (default: all)");
}

void add_collapse(CLI::App& group, Action& action) {
  const auto a = std::make_shared<EditArguments>();
  CLI::App* verb = add_edit(group, action, a, "collapse", "Take cells out by shrinking a sheet, a face or an edge",
                            make_collapsed, "template.mesh --vertices 0 1 -o coarser.mesh");
  add_mesh(*verb, *a);
  verb->add_option("--what", a->what,
                   "The sheet of edge A B; the quad with opposite corners A B, and its column; the edge A B")
      ->check(CLI::IsMember({"sheet", "face", "edge"}))
      ->default_str("sheet")
      ->type_name("sheet|face|edge");
  add_vertices(*verb, *a, "--vertices", "Two vertices, numbered from 0")->required();
}

void add_merge(CLI::App& group, Action& action) {
  const auto a = std::make_shared<EditArguments>();
  CLI::App* verb = add_edit(group, action, a, "merge", "Glue faces that lie on each other, of one mesh or two",
                            make_merged, "left.mesh right.mesh -o both.mesh");
  add_mesh(*verb, *a);
  verb->add_option("OTHER", a->other, "Second mesh, whose cells are added first")->type_name("FILE");
  verb->add_option("--tolerance", a->tolerance,
                   "Distance up to which vertices are one, in percent of the box's diagonal")
      ->check(number_in(0.0, 10.0))
      ->type_name("PERCENT")
      ->capture_default_str();
}

void add_split(CLI::App& group, Action& action) {
  const auto a = std::make_shared<EditArguments>();
  a->what = "parts";
  CLI::App* verb = add_edit(group, action, a, "split", "Cut a sheet into layers, or all cells into prisms or tets",
                            make_split, "template.mesh --into tets -o tets.mesh");
  add_mesh(*verb, *a);
  verb->add_option("--into", a->what, "Layers of the sheet of an edge; prisms along an edge; tets")
      ->check(CLI::IsMember({"parts", "prisms", "tets"}))
      ->type_name("parts|prisms|tets")
      ->capture_default_str();
  add_vertices(*verb, *a, "--edge", "Ends of the edge, numbered from 0");
  verb->add_option("--parts", a->parts, "Number of layers into which the sheet is cut")
      ->check(whole_number_in(2, 1000))
      ->type_name("N")
      ->default_str(std::to_string(kUsualParts));
}

}  // namespace

void add_template_edits(CLI::App& group, Action& action) {
  add_grid(group, action);
  add_carve(group, action);
  add_extrude(group, action);
  add_pillow(group, action);
  add_refine(group, action);
  add_collapse(group, action);
  add_merge(group, action);
  add_split(group, action);
}

}  // namespace subvol::cli
