// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/shell_output.h"

#include "export/gltf_writer.h"
#include "export/volume_writer.h"

#include <algorithm>
#include <cstdio>
#include <span>

namespace subvol::cli {
namespace {

/// What the thicknesses of one side are, in the mesh's unit.
struct ThicknessFigures {
  double mean = 0, least = 0, most = 0;

  explicit ThicknessFigures(std::span<const double> thickness) {
    for (const double t : thickness) mean += t / static_cast<double>(thickness.size());
    least = *std::min_element(thickness.begin(), thickness.end());
    most = *std::max_element(thickness.begin(), thickness.end());
  }
};

/// Calls visit(name, first strand) for every side that has layers.
template <class Visit>
void for_each_side(const ShellLayers& layers, const Visit& visit) {
  if (layers.inside > 0) visit("inside", std::size_t{0});
  if (layers.outside > 0) visit("outside", layers.num_columns());
}

/// Values per strand as values per vertex; those of the surface itself are the larger of both sides.
std::vector<double> by_vertex(const ShellLayers& layers, const std::vector<double>& by_strand) {
  const std::size_t n = layers.num_columns();
  std::vector<double> values;
  for (std::size_t i = 0; i < layers.num_sheets() * n; ++i) {
    const Index strand = layers.strand(static_cast<Index>(i));
    values.push_back(strand == kNoIndex ? std::max(by_strand[i % n], by_strand[n + i % n]) : by_strand[strand]);
  }
  return values;
}

Scene scene_of(const ShellResult& shell, const SurfaceSceneOptions& options) {
  const ShellLayers& layers = shell.layers;
  const std::vector<double> achieved = by_vertex(layers, shell.achieved), asked = by_vertex(layers, shell.asked);
  std::vector<SceneSheet> sheets;
  const auto add = [&](const char* name, int sheet) {
    SceneSheet& added = sheets.emplace_back();
    added.name = name;
    added.mesh = sheet_surface(layers, shell.mesh, sheet);
    added.attribute.name = "_THICKNESS";
    for (std::size_t v = 0; v < layers.num_columns(); ++v) {
      const Index vertex = layers.vertex(sheet, static_cast<Index>(v));
      added.attribute.values.push_back(achieved[vertex]);
      added.shades.push_back(achieved[vertex] / asked[vertex]);
    }
  };
  if (layers.inside > 0) add("inner", 0);
  add("base", layers.inside);
  if (layers.outside > 0) add("outer", layers.num_sheets() - 1);
  return sheet_scene(sheets, "viridis over achieved / asked thickness 0..1, above 1 as 1", options);
}

}  // namespace

void write_shell(const Output& output, const ShellResult& shell, const WritingOptions& options) {
  if (is_scene(output) && !output.cage) {
    write_gltf(output.path, scene_of(shell, scene_options(output, options)));
  } else if (output.extension == ".vtu" || output.extension == ".msh") {
    const VertexField fields[] = {{"thickness", by_vertex(shell.layers, shell.achieved)},
                                  {"thickness_asked", by_vertex(shell.layers, shell.asked)},
                                  {"thickness_limited", by_vertex(shell.layers, shell.limited)},
                                  {"clearance", by_vertex(shell.layers, shell.clearance)}};
    write_volume(output.path, shell.mesh, shell.quality.cell_minima, fields);
  } else {
    write_output(output, shell.mesh, options);
  }
}

Json thickness_json(const ShellResult& shell, double diagonal) {
  Json json = Json::object();
  const std::size_t n = shell.layers.num_columns();
  for_each_side(shell.layers, [&](const char* side, std::size_t first) {
    const auto figures = [&](const std::vector<double>& thickness) {
      const ThicknessFigures f({thickness.data() + first, n});
      return Json{{"mean", f.mean},
                  {"min", f.least},
                  {"max", f.most},
                  {"mean_percent", 100 * f.mean / diagonal},
                  {"min_percent", 100 * f.least / diagonal},
                  {"max_percent", 100 * f.most / diagonal}};
    };
    std::size_t num_limited = 0;
    for (std::size_t v = first; v < first + n; ++v) num_limited += shell.limited[v] < shell.asked[v];
    json[side] = {{"asked", figures(shell.asked)},
                  {"limited", figures(shell.limited)},
                  {"achieved", figures(shell.achieved)},
                  {"clearance", figures(shell.clearance)},
                  {"limited_vertices", num_limited}};
  });
  return json;
}

std::string thickness_text(const ShellResult& shell) {
  std::string text;
  const std::size_t n = shell.layers.num_columns();
  for_each_side(shell.layers, [&](const char* side, std::size_t first) {
    const ThicknessFigures asked({shell.asked.data() + first, n}), found({shell.achieved.data() + first, n});
    char line[200];
    std::snprintf(line, sizeof line, "thickness %-9s asked %.6g, achieved mean %.6g (%.1f %%), min %.6g, max %.6g\n",
                  side, asked.mean, found.mean, 100 * found.mean / asked.mean, found.least, found.most);
    text += line;
  });
  return text;
}

}  // namespace subvol::cli
