// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/report_page.h"

#include "cli/runs/page_parts.h"
#include "cli/runs/report_plots.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/markup.h"
#include "subvol/export/color_map.h"
#include "subvol/export/vtu_arrays.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace subvol::cli {

using namespace internal;
namespace {

/// A JSON value as text for people.
std::string words(const Json& value) {
  if (value.is_string()) return escaped_markup(value.get<std::string>());
  if (value.is_number_float()) return number(value.get<double>());
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  return escaped_markup(value.dump());
}

const Json& part(const Json& report, const char* name) {
  static const Json none = Json::object();
  return report.contains(name) && report[name].is_object() ? report[name] : none;
}

std::string input_name(const Json& report) {
  for (const auto& [kind, input] : part(report, "input").items())
    if (input.is_object() && input.contains("path")) {
      const std::string path = input["path"].get<std::string>();
      return path.substr(path.find_last_of("/\\") + 1);
    }
  return {};
}

std::string heading(const Json& report) {
  const std::string title = "subvol " + report.value("command", std::string()) + ": " + input_name(report);
  std::string text = "<h1>" + escaped_markup(title) + "</h1>\n<p>";
  if (report.contains("valid"))
    text += std::string(report["valid"].get<bool>() ? "<span class=\"verdict good\">Valid"
                                                    : "<span class=\"verdict bad\">Not valid") +
            (report.contains("stop_reason") ? ",</span> " : ".</span> ");
  if (report.contains("stop_reason"))
    text += "<span class=\"verdict " + std::string(report.value("converged", false) ? "good" : "bad") + "\">" +
            words(report["stop_reason"]) + "</span>: " + escaped_markup(report.value("explanation", std::string())) +
            ".";
  return text + "</p>\n";
}

std::string color_scale(const ReportPicture& picture) {
  if (picture.high.empty()) return {};
  std::string text =
      "<span class=\"scale\">" + escaped_markup(picture.low) + "<i style=\"background:linear-gradient(90deg";
  constexpr int kColorScaleSteps = 8;
  for (int i = 0; i <= kColorScaleSteps; ++i) {
    const LinearColor color = quality_color(std::max(1e-9, double(i) / kColorScaleSteps));
    text += ",rgb(";
    for (int k = 0; k < 3; ++k)
      text += formatted(k ? ",%d" : "%d", int(std::lround(255 * std::pow(color[k], 1 / 2.2))));
    text += ')';
  }
  return text + ")\"></i>" + escaped_markup(picture.high) + "</span>";
}

std::string gallery(std::span<const ReportPicture> pictures, std::span<const std::string> notes) {
  std::string text;
  if (!pictures.empty()) text += "<div class=\"grid\">\n";
  for (const ReportPicture& picture : pictures) {
    text += picture_figure(picture.title, picture.png, escaped_markup(picture.title) + color_scale(picture));
  }
  if (!pictures.empty()) text += "</div>\n";
  for (const std::string& note : notes) text += "<p class=\"soft\">" + escaped_markup(note) + "</p>\n";
  return text;
}

std::string distances(const Json& report) {
  std::string rows;
  const auto add = [&](const char* name, const char* entry) {
    const Json& d = part(report, entry);
    if (d.contains("mean_percent"))
      rows += row({name, number(d.at("mean_percent").get<double>()), number(d.at("max_percent").get<double>())});
  };
  add("at the start", "initial_distance");
  add("mesh", "distance");
  add("limit surface", "limit_surface_distance");
  if (rows.empty()) return "";
  std::string text = table({"distance to the surface", "mean, % of diagonal", "max, % of diagonal"}, rows);
  const Json& normals = part(report, "normal_deviation");
  if (normals.contains("mean_degrees"))
    text += "<p>The normals deviate by " + words(normals["mean_degrees"]) + " degrees on average, and by less than " +
            words(normals.at("percentile_95_degrees")) + " degrees on 95 % of the area.</p>\n";
  return text;
}

/// A point as text for people.
std::string place(const Json& point) {
  std::string text;
  for (const Json& x : point) text += (text.empty() ? "" : ", ") + words(x);
  return text;
}

std::string regions(const Json& report) {
  const Json& all = part(report, "regions");
  std::string cells, interfaces;
  const auto entry = [](const Json& one, const char* target, const char* start) {
    return one.contains(target) ? words(one[target]) : one.contains(start) ? words(one[start]) : "";
  };
  for (const Json& region : all.value("cells", Json::array()))
    cells += row({region.contains("name") ? words(region["name"]) : "region " + words(region.at("reference")),
                  words(region.at("cells")), words(region.at("volume")), entry(region, "target_volume", "start_volume"),
                  words(region.at("min_scaled_jacobian"))});
  for (const Json& one : all.value("interfaces", Json::array()))
    interfaces += row({place(one.at("references")), words(one.at("faces")), words(one.at("area")),
                       entry(one, "target_area", "start_area")});
  if (cells.empty()) return "";
  std::string text = table({"", "cells", "volume", "wanted", "least scaled Jacobian"}, cells);
  if (!interfaces.empty()) text += table({"interface", "faces", "area", "wanted"}, interfaces);
  return text;
}

std::string trials(const Json& report) {
  const Json& made = part(report, "template");
  std::string rows;
  std::size_t count = 0;
  for (const Json& trial : made.value("trials", Json::array())) {
    const auto entry = [&](const char* name) { return trial.contains(name) ? words(trial[name]) : ""; };
    const std::string edges =
        trial.contains("sharp_edges") ? entry("followed_edges") + " of " + entry("sharp_edges") : "";
    const bool chosen = made.value("chosen", Json()) == count;
    rows += row({std::to_string(++count), entry("cells"), entry("min_scaled_jacobian"), entry("mean_percent"),
                 entry("max_percent"), edges, entry("merit"), chosen ? "chosen" : ""});
  }
  if (rows.empty()) return "";
  return table(
      {"", "cells", "least scaled Jacobian", "mean distance, %", "max distance, %", "edges followed", "merit", ""},
      rows);
}

std::string missed_edges(const Json& report) {
  constexpr std::size_t kMostMissedEdgeRows = 30;
  const Json edges = report.value("edges_not_followed", Json::array());
  std::string rows;
  for (std::size_t i = 0; i < std::min(edges.size(), kMostMissedEdgeRows); ++i)
    rows += row({words(edges[i].at("length_percent")), place(edges[i].at("at")), words(edges[i].at("why"))});
  if (rows.empty()) return "";
  std::string text = table({"length, % of diagonal", "place", "why"}, rows);
  if (edges.size() > kMostMissedEdgeRows)
    text += formatted("<p>... and %zu more</p>\n", edges.size() - kMostMissedEdgeRows);
  return text;
}

std::string quality(const Json& report) {
  const Json& q = part(report, "quality");
  if (!q.contains("cells")) return {};
  std::string rows;
  for (const char* entry : {"cells", "min_scaled_jacobian", "mean_scaled_jacobian", "inverted_cells", "certified_cells",
                            "invalid_cells", "undecided_cells"}) {
    if (!q.contains(entry)) continue;
    std::string name = entry;
    for (char& c : name)
      if (c == '_') c = ' ';
    rows += row({name, words(q[entry])});
  }
  if (report.contains("boundary_self_intersections"))
    rows += row({"self-intersections of the boundary", words(report["boundary_self_intersections"])});
  return table({"cells", ""}, rows);
}

std::string worst_cells(const Json& report) {
  std::string rows;
  for (const Json& cell : part(report, "quality").value("worst_cells", Json::array())) {
    rows += row({words(cell.at("cell")), words(cell.at("scaled_jacobian")), place(cell.at("center"))});
  }
  return rows.empty() ? "" : table({"cell", "scaled Jacobian", "center"}, rows);
}

std::string thicknesses(const Json& report) {
  std::string rows;
  for (const auto& [side, t] : part(report, "thickness").items())
    for (const char* kind : {"asked", "limited", "achieved", "clearance"})
      if (t.contains(kind))
        rows += row({escaped_markup(side) + ", " + kind, words(t[kind].at("mean")), words(t[kind].at("min")),
                     words(t[kind].at("max"))});
  return rows.empty() ? "" : table({"thickness", "mean", "min", "max"}, rows);
}

std::string stages(const Json& report) {
  std::string rows;
  int count = 0;
  for (const Json& stage : report.value("stages", Json::array())) {
    const Json energy = stage.value("energy", Json::object());
    const auto entry = [&](const Json& from, const char* name) { return from.contains(name) ? words(from[name]) : ""; };
    rows += row({std::to_string(++count), words(stage.at("name")), entry(stage, "unknowns"), entry(stage, "iterations"),
                 entry(energy, "surface"), entry(energy, "volume"), entry(stage, "mean_distance_percent"),
                 entry(stage, "seconds"), stage.value("kept", true) ? "" : "undone"});
  }
  if (rows.empty()) return "";
  return table({"", "stage", "unknowns", "steps", "surface", "volume", "mean distance, %", "seconds", ""}, rows);
}

std::string convergence(const Json& report) {
  const std::string plot = energy_plot(report.value("stages", Json::array()));
  if (plot.empty()) return {};
  return "<figure class=\"plot\">" + plot +
         "<figcaption class=\"key\">Energy by step, logarithmic: <b class=\"surface\">surface</b>, "
         "<b class=\"volume\">volume</b> (without its weight), <b class=\"total\">total</b>. Lines part stages."
         "</figcaption></figure>\n";
}

std::string histogram(const Json& report) {
  const std::string plot = histogram_plot(part(report, "quality").value("histogram", Json::array()));
  if (plot.empty()) return {};
  return "<figure class=\"plot\">" + plot +
         "<figcaption>Cells by their least scaled Jacobian, -1 to 1</figcaption></figure>\n";
}

std::string costs(const Json& report) {
  std::string rows;
  for (const auto& [name, seconds] : part(report, "seconds").items())
    rows += row({escaped_markup(name), words(seconds)});
  if (report.contains("peak_memory_bytes"))
    rows += row({"peak memory, MB", number(report["peak_memory_bytes"].get<double>() * 1e-6)});
  return rows.empty() ? "" : table({"part", "seconds"}, rows);
}

std::string command(const Json& report) {
  std::string text;
  for (const Json& word : report.value("command_line", Json::array())) {
    const std::string plain = word.get<std::string>();
    const bool quoted = plain.empty() || plain.find_first_of(" \t\"'$&|<>()*;") != std::string::npos;
    text += (text.empty() ? "" : " ") + (quoted ? '\'' + escaped_markup(plain) + '\'' : escaped_markup(plain));
  }
  if (!text.empty()) text = "<pre>" + text + "</pre>\n";
  std::string rows;
  for (const auto& [name, value] : part(report, "options").items()) rows += row({escaped_markup(name), words(value)});
  if (rows.empty()) return text;
  return text + "<details><summary>All options in force</summary>" + table({"option", "value"}, rows) + "</details>\n";
}

std::string warnings(const Json& report) {
  std::string text;
  for (const Json& warning : report.value("warnings", Json::array())) text += "<li>" + words(warning) + "</li>\n";
  return text.empty() ? "" : "<ul>" + text + "</ul>\n";
}

}  // namespace

Json parse_report(std::string_view bytes, const std::string& name) {
  constexpr int kDeepestReportNesting = 20;
  const auto shallow = [&](int depth, Json::parse_event_t, const Json&) {
    if (depth > kDeepestReportNesting)
      throw InputError(name + ": expected a report, found values nested more than " +
                       std::to_string(kDeepestReportNesting) + " deep");
    return true;
  };
  Json report;
  try {
    report = Json::parse(bytes, shallow);
  } catch (const Json::exception& error) {
    throw InputError(name + ": expected a report in JSON: " + error.what());
  }
  if (!report.is_object() || !report.contains("subvol") || !report.contains("command"))
    throw InputError(name + ": expected a report as subvol writes it, with \"subvol\" and \"command\"");
  return report;
}

std::string report_page(const Json& report, std::string_view viewer, std::span<const ReportPicture> pictures,
                        std::span<const std::string> notes) {
  std::string page = page_begin("subvol " + report.value("command", std::string()) + ": " + input_name(report));
  page += heading(report);
  page += viewer;
  page += gallery(pictures, notes);
  page += section("Warnings", warnings(report));
  page += section("Distance", distances(report));
  page += section("Thickness", thicknesses(report));
  page += section("Quality", quality(report) + histogram(report));
  page += section("Regions", regions(report));
  page += section("Worst cells", worst_cells(report));
  page += section("Sharp edges that are not followed", missed_edges(report));
  page += section("Templates that were tried", trials(report));
  page += section("Convergence", convergence(report) + stages(report));
  page += section("Time and memory", costs(report));
  page += section("Command", command(report));
  return page + page_end(report.value("subvol", std::string()));
}

}  // namespace subvol::cli
