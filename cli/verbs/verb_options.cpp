// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/verb_options.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/scene_chord.h"
#include "subvol/base/error.h"
#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/target/surface_wrap.h"
#include "subvol/fit/tuning/tuned_numbers.h"

#include <algorithm>
#include <charconv>
#include <functional>
#include <initializer_list>
#include <sstream>
#include <utility>

namespace subvol::cli {
namespace {

// Numbers and booleans keep their type; everything else becomes text.
Json typed(const std::string& text) {
  const Json value = Json::parse(text, nullptr, false);
  return value.is_number() || value.is_boolean() ? value : Json(text);
}

Json typed(const std::vector<std::string>& texts) {
  Json all = Json::array();
  for (const std::string& text : texts) all.push_back(typed(text));
  return all;
}

constexpr std::size_t kLeastMemoryLimit = std::size_t{64} << 20, kMostMemoryLimit = std::size_t{1} << 50;

/// Sets the number that "NAME=VALUE" names; returns what is wrong with it, if anything is.
std::string set_number(Tuning& tuning, const std::string& word) {
  const std::size_t equals = word.find('=');
  const std::string value = equals == std::string::npos ? "" : word.substr(equals + 1);
  constexpr double kMostTunedNumber = 1e12;  // tuned numbers have their own ranges
  if (!is_number_in(value, -kMostTunedNumber, kMostTunedNumber)) return "must be NAME=VALUE with a number, not " + word;
  try {
    set_tuned_number(tuning, word.substr(0, equals), std::stod(value));
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

/// True if an option that excludes this one was given.
bool is_excluded(const CLI::Option& option) {
  const auto& others = option.get_excludes();
  return std::any_of(others.begin(), others.end(), [](const CLI::Option* other) { return other->count() > 0; });
}

/// Adds an option with two values by their names, of which the first is the default.
template <class Value>
void add_choice(CLI::App& verb, const char* name, Value& value, const std::pair<std::string, Value>& first,
                const std::pair<std::string, Value>& second, const std::string& help) {
  verb.add_option_function<std::string>(
          name,
          [&value, first, second](const std::string& text) {
            value = text == second.first ? second.second : first.second;
          },
          help)
      ->check(CLI::IsMember({first.first, second.first}))
      ->type_name(first.first + '|' + second.first)
      ->default_str(first.first);
}

}  // namespace

void add_memory_limit(CLI::App& verb, std::size_t& bytes, const std::string& help) {
  verb.add_option("--memory-limit", bytes, help)
      ->transform(CLI::AsSizeValue(false))
      ->check(whole_number_in(kLeastMemoryLimit, kMostMemoryLimit))
      ->type_name("SIZE");
}

void add_resource_options(CLI::App& verb, RunOptions& options) {
  verb.add_option("--threads", options.threads, "Number of threads (default: all cores)")
      ->check(whole_number_in(1, 1024))
      ->type_name("N");
  add_memory_limit(verb, options.memory_limit,
                   "Most memory to use: bytes, or 800M, 4G. A fit ends with the best result so far before a level\n"
                   "that would need more");
}

void add_output_options(CLI::App& verb, RunOptions& options, const std::string& output_help) {
  verb.add_option("-o,--output", options.outputs, output_help)->type_name("FILE")->allow_extra_args(false);
  verb.add_flag("--force", options.force, "Replace outputs that exist");
  verb.add_flag("--quiet", options.quiet, "Print only errors");
  add_resource_options(verb, options);
}

CLI::Option* add_references_option(CLI::App& verb, RunOptions& options) {
  return verb
      .add_option("--references", options.references,
                  "Cell data of a .vtk that become the cells' references (default: those with a name of materials or\n"
                  "regions, or else the first of whole numbers that are no ghosts or cell numbers); none: references\n"
                  "of any file are left out, and all cells are one region")
      ->type_name("NAME");
}

void add_regions_option(CLI::App& verb, std::string& rule) {
  verb.add_option(
          "--regions", rule,
          "What becomes of solids that touch, of closed parts inside others and of sheets inside a solid. auto\n"
          "(default): solids that have names and touch are regions, sheets make regions, and so do parts inside\n"
          "others, unless they face inward as walls of voids do; keep: whatever is enclosed is a region; merge:\n"
          "one region, solids that touch are united, parts inside others are the walls of voids")
      ->check(CLI::IsMember({"auto", "keep", "merge"}))
      ->type_name("auto|keep|merge");
}

void add_wrap_option(CLI::App& verb, std::optional<double>& percent) {
  verb.add_option(
          "--wrap", percent,
          "Fill a closed surface that follows this one, made of voxels this large, in percent of the diagonal\n"
          "(default: 0.5 if the surface bounds no solid, although parts are united and holes covered). What is\n"
          "thinner or narrower than two voxels may be lost or closed, and sharp edges are cut off by up to one")
      ->check(number_in(kLeastWrapPercent, kMostWrapPercent))
      ->type_name("PERCENT")
      ->excludes(verb.get_option("--regions"));  // the wrap has one region
}

RegionRule region_rule(const std::string& rule) {
  for (const RegionRule one : {RegionRule::keep, RegionRule::merge})
    if (rule == to_string(one)) return one;
  return RegionRule::automatic;
}

CLI::Option* add_map_tolerance(CLI::App& verb, WritingOptions& options) {
  return verb
      .add_option("--map-tolerance", options.map_tolerance_percent,
                  "Largest distance between curved cells and the polynomials that stand for them in .vtu and .msh, in\n"
                  "percent of the diagonal; if it is larger, the program says so and ends with status 4")
      ->check(number_in(0.0, 100.0))
      ->type_name("PERCENT")
      ->capture_default_str();
}

void add_long_run_options(CLI::App& verb, RunOptions& options) {
  verb.add_option("--report", options.report, "Write what was done and what is true of the result")
      ->type_name("FILE.json");
  verb.add_option("--progress", options.progress,
                  "How progress is shown: bar (default on a terminal) or plain on stderr, json on stdout, none")
      ->check(CLI::IsMember({"bar", "plain", "json", "none"}))
      ->type_name("KIND");
  verb.add_option("--seed", options.seed, "Recorded in the report; nothing here draws random numbers")->type_name("N");
}

void require_fitting_options(const CLI::App& verb, bool points) {
  const auto given = [&](const char* name) {
    const CLI::Option* option = verb.get_option_no_throw(name);
    return option ? option->results() : std::vector<std::string>{};
  };
  if (!points) {
    if (!given("--point-weights").empty())
      throw UsageError("--point-weights: the target is a surface; its triangles count by their areas");
    return;
  }
  if (!given("--crease-angle").empty())
    throw UsageError("--crease-angle: the target holds points, between which no edges can be seen");
  if (!given("--keep-groups").empty()) throw UsageError("--keep-groups: the target holds points, which have no groups");
  if (const auto kind = given("--correspondence"); !kind.empty() && kind.back() == "voronoi")
    throw UsageError("--correspondence voronoi: the target holds points, which have no area to be cut into cells");
}

void warn_of_missing_groups(const CLI::App& verb, const TriangleMesh& target, std::vector<std::string>& warnings) {
  const CLI::Option* option = verb.get_option_no_throw("--keep-groups");
  if (option && option->count() > 0 && group_borders(target, target).empty())
    warnings.emplace_back("--keep-groups has no effect: the target's faces have no borders between groups");
}

void add_checkpoint_options(CLI::App& verb, RunOptions& options) {
  const auto group = "Long runs";
  CLI::Option* checkpoint =
      verb.add_option("--checkpoint", options.checkpoint, "Keep in FILE what --resume needs, as the run goes on")
          ->type_name("FILE")
          ->group(group);
  verb.add_option("--every", options.every_seconds, "Least time between two writes of the checkpoint")
      ->check(number_in(0, 1e9))
      ->type_name("SECONDS")
      ->capture_default_str()
      ->needs(checkpoint)
      ->group(group);
  verb.add_option("--resume", options.resume,
                  "Go on from the checkpoint of a run of the same inputs and options, to the same result")
      ->type_name("FILE")
      ->group(group);
}

void add_msh_version_option(CLI::App& verb, WritingOptions& options) {
  add_choice(verb, "--msh-version", options.msh_version, {"4.1", MshVersion::v4_1}, {"2.2", MshVersion::v2_2},
             "Version of .msh files: 4.1, or 2.2, which more programs read");
}

void add_writing_options(CLI::App& verb, WritingOptions& options) {
  add_msh_version_option(verb, options);
  add_choice(verb, "--vtu-cells", options.vtu_cells, {"lagrange", VtuCells::lagrange}, {"bezier", VtuCells::bezier},
             "How a .vtu holds curved cells: Lagrange cells, or Bezier cells, whose points are control points");
  const auto group = "Surfaces for DCC tools";
  options.chord_percent = kSceneChordPercent;
  verb.add_option("--chord", options.chord_percent,
                  "Largest distance between a limit surface and its triangles, in percent of its box's diagonal")
      ->check(number_in(1e-4, 100.0))
      ->type_name("PERCENT")
      ->capture_default_str()
      ->group(group);
  verb.add_option("--unit", options.meters_per_unit, "Length of the mesh's unit")
      ->check(number_in(1e-12, 1e12))
      ->type_name("METERS")
      ->capture_default_str()
      ->group(group);
  verb.add_option("--up", options.up_axis, "Axis of the mesh that points up")
      ->check(CLI::IsMember({"y", "z"}))
      ->type_name("y|z")
      ->capture_default_str()
      ->group(group);
  verb.add_option_function<std::string>(
          "--cut",
          [&options](const std::string& text) {
            if (const std::string error = parse_cut(text, options.cut); !error.empty())
              throw CLI::ValidationError("--cut", error);
          },
          "Plane of cutaway:FILE: the axis that it is perpendicular to, and its place between the outermost cells,\n"
          "from 0 to 1 (default: the axis along which the mesh is shortest, and 0.5)")
      ->type_name("x|y|z[:SHARE]")
      ->group(group);
  verb.add_flag("--no-wireframe", options.no_wireframe, "Leave the edges of the cells out of .glb and .gltf")
      ->group(group);
  verb.add_flag("--quantize", options.quantize,
                "Small .glb and .gltf: positions in 16 bits, normals in 8 (KHR_mesh_quantization)")
      ->group(group);
}

std::vector<std::string> unused_output_options(const CLI::App& verb, std::span<const Output> outputs) {
  std::vector<std::string> warnings;
  const auto warn_unless = [&](const auto& is_used_by, std::initializer_list<const char*> names, const char* missing) {
    if (std::ranges::any_of(outputs, is_used_by)) return;
    for (const std::string name : names)
      if (const CLI::Option* option = verb.get_option_no_throw(name); option && option->count() > 0)
        warnings.push_back(name + " has no effect: no output is " + missing);
  };
  const auto has_unit = [](const Output& output) { return output.is_scene() || output.extension == ".usda"; };
  const auto is_cutaway = [](const Output& output) { return output.part == Part::cutaway; };
  const auto is_msh = [](const Output& output) { return output.extension == ".msh"; };
  const auto is_vtu = [](const Output& output) { return output.extension == ".vtu"; };
  const auto shows_limit = [](const Output& output) {
    return output.part == Part::result && !output.is_volume() && output.extension != ".usda";
  };
  warn_unless(&Output::is_scene, {"--no-wireframe", "--quantize"}, "a scene (.glb, .gltf)");
  warn_unless(has_unit, {"--unit", "--up"}, "a scene (.glb, .gltf) or .usda");
  warn_unless(is_cutaway, {"--cut"}, "a cutaway (cutaway:FILE)");
  warn_unless(is_msh, {"--msh-version"}, "a .msh");
  warn_unless(is_vtu, {"--vtu-cells"}, "a .vtu");
  warn_unless(shows_limit, {"--limit"}, "a surface or a scene");
  return warnings;
}

void add_tune_option(CLI::App& verb, Tuning& tuning) {
  const auto check = [](const std::string& word) -> std::string {
    Tuning scratch;
    return set_number(scratch, word);
  };
  const std::function<void(const std::vector<std::string>&)> set = [&tuning](const std::vector<std::string>& words) {
    for (const std::string& word : words) set_number(tuning, word);
  };
  verb.add_option_function("--tune", set,
                           "For experiments: set a tuned number of the method, such as fitting.coarse_lambda=0.02;\n"
                           "docs/cli.md tells where their names are listed; may be given several times")
      ->check(CLI::Validator(check, ""))
      ->type_name("NAME=VALUE");
}

CLI::Validator number_in(double low, double high) {
  std::ostringstream range;
  range << low << " .. " << high;
  const auto check = [low, high, text = range.str()](const std::string& word) -> std::string {
    if (is_number_in(word, low, high)) return {};
    return "must be a number in " + text + ", not " + word;
  };
  return CLI::Validator(check, "");
}

CLI::Validator whole_number_in(std::int64_t low, std::int64_t high) {
  const auto check = [low, high](const std::string& word) -> std::string {
    std::int64_t value = 0;
    const char* end = word.data() + word.size();
    const auto [rest, error] = std::from_chars(word.data(), end, value);
    if (error == std::errc{} && rest == end && std::to_string(value) == word && value >= low && value <= high)
      return {};
    return "must be a whole number in " + std::to_string(low) + " .. " + std::to_string(high) + ", not " + word;
  };
  return CLI::Validator(check, "");
}

Json options_in_force(const CLI::App& verb) {
  Json all = Json::object();
  for (const CLI::Option* option : verb.get_options()) {
    const std::string name = option->get_single_name();
    if (name == "help" || name == "output" || option->get_positional()) continue;
    const auto& given = option->results();
    if (!given.empty()) {
      all[name] = option->get_items_expected_max() > 1 ? typed(given) : typed(given.back());
    } else if (is_excluded(*option)) {
      continue;
    } else if (option->get_expected_min() == 0) {
      all[name] = false;
    } else if (!option->get_default_str().empty()) {
      all[name] = typed(option->get_default_str());
    }
  }
  return all;
}

Json options_of_result(const CLI::App& verb) {
  Json options = options_in_force(verb);
  for (const char* name : {"force", "quiet", "threads", "memory-limit", "time-limit", "report", "progress", "config",
                           "checkpoint", "every", "resume"})
    options.erase(name);
  return options;
}

RunIdentity run_identity(const CLI::App& verb, const std::vector<std::pair<std::string, std::string>>& inputs) {
  return run_identity(verb.get_name(), options_of_result(verb), inputs);
}

}  // namespace subvol::cli
