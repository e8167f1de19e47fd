// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/report_page.h"

#include "cli/runs/report_plots.h"
#include "subvol/base/error.h"
#include "subvol/export/color_map.h"
#include "subvol/export/vtu_arrays.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace subvol::cli {
namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --back: #fff; --card: #f4f5f7; --ink: #1b1f24; --soft: #5b6470; --line: #d5d9df;
  --good: #1a7f4b; --bad: #c0392b; --surface: #0b6bcb; --volume: #c2410c; --total: #5b6470; }
@media (prefers-color-scheme: dark) { :root { --back: #14171b; --card: #1e2329; --ink: #e6e9ed; --soft: #9aa4b0;
  --line: #353c45; --good: #4cc38a; --bad: #ff8170; --surface: #6cb6ff; --volume: #ffa657; --total: #9aa4b0; } }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.2rem; max-width: 72rem; background: var(--back); color: var(--ink);
  font: 16px/1.5 system-ui, sans-serif; }
h1 { font-size: 1.5rem; margin: 0 0 .3rem; overflow-wrap: anywhere; } h2 { font-size: 1.1rem; margin: 2rem 0 .6rem; }
.verdict { font-weight: 600; } .good { color: var(--good); } .bad { color: var(--bad); } .soft { color: var(--soft); }
.grid { display: grid; gap: 1rem; grid-template-columns: repeat(auto-fit, minmax(min(100%, 26rem), 1fr)); }
figure { margin: 0; padding: .8rem; background: var(--card); border-radius: .6rem; }
figure img, figure svg { display: block; width: 100%; height: auto; }
figcaption { font-size: .9rem; margin-top: .4rem; }
.scale { display: flex; gap: .5rem; align-items: center; font-size: .8rem; color: var(--soft); }
.scale i { flex: 1; height: .6rem; border-radius: .3rem; }
.plot { max-width: 46rem; margin: .8rem 0; } .wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; }
th, td { padding: .25rem .8rem .25rem 0; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap;
  font-variant-numeric: tabular-nums; }
th { color: var(--soft); font-weight: 500; } th:first-child, td:first-child { text-align: left; }
pre { background: var(--card); padding: .8rem; border-radius: .6rem; overflow-x: auto; font-size: .85rem; }
svg text { fill: var(--soft); font: 12px system-ui, sans-serif; } svg .axis { stroke: var(--line); fill: none; }
svg .bar { fill: var(--surface); } svg .surface { stroke: var(--surface); } svg .volume { stroke: var(--volume); }
svg .total { stroke: var(--total); } svg polyline { fill: none; stroke-width: 1.8; }
.key b { font-weight: 600; } .key .surface { color: var(--surface); } .key .volume { color: var(--volume); }
.key .total { color: var(--total); }
)";

template <class... Values>
std::string format(const char* form, Values... values) {
  char text[200];
  std::snprintf(text, sizeof text, form, values...);
  return text;
}

std::string number(double value) { return format("%.6g", value); }

/// A JSON value as text for people.
std::string words(const Json& value) {
  if (value.is_string()) return escaped(value.get<std::string>());
  if (value.is_number_float()) return number(value.get<double>());
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  return escaped(value.dump());
}

std::string row(std::initializer_list<std::string> cells) {
  std::string text = "<tr>";
  for (const std::string& cell : cells) text += "<td>" + cell + "</td>";
  return text + "</tr>\n";
}

std::string table(std::initializer_list<const char*> heads, const std::string& rows) {
  std::string text = "<div class=\"wide\"><table><tr>";
  for (const char* head : heads) text += std::string("<th>") + head + "</th>";
  return text + "</tr>\n" + rows + "</table></div>\n";
}

std::string section(const char* title, const std::string& body) {
  return body.empty() ? "" : std::string("<h2>") + title + "</h2>\n" + body;
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
  std::string text = "<h1>" + escaped(title) + "</h1>\n<p>";
  if (report.contains("valid"))
    text += report["valid"].get<bool>() ? "<span class=\"verdict good\">Valid.</span> "
                                        : "<span class=\"verdict bad\">Not valid.</span> ";
  if (report.contains("stop_reason"))
    text += "<span class=\"verdict " + std::string(report.value("converged", false) ? "good" : "bad") + "\">" +
            words(report["stop_reason"]) + "</span>: " + escaped(report.value("explanation", std::string())) + ".";
  return text + "</p>\n";
}

std::string colour_scale(const ReportPicture& picture) {
  if (picture.high.empty()) return {};
  std::string text = "<span class=\"scale\">" + escaped(picture.low) + "<i style=\"background:linear-gradient(90deg";
  constexpr int kStops = 8;
  for (int i = 0; i <= kStops; ++i) {
    const LinearColor color = quality_color(std::max(1e-9, double(i) / kStops));
    text += ",rgb(";
    for (int k = 0; k < 3; ++k) text += format(k ? ",%d" : "%d", int(std::lround(255 * std::pow(color[k], 1 / 2.2))));
    text += ')';
  }
  return text + ")\"></i>" + escaped(picture.high) + "</span>";
}

std::string gallery(std::span<const ReportPicture> pictures, std::span<const std::string> notes) {
  std::string text;
  if (!pictures.empty()) text += "<div class=\"grid\">\n";
  for (const ReportPicture& picture : pictures) {
    text += "<figure><img alt=\"" + escaped(picture.title) + "\" src=\"data:image/png;base64,";
    append_base64(text, picture.png);
    text += "\"><figcaption>" + escaped(picture.title) + colour_scale(picture) + "</figcaption></figure>\n";
  }
  if (!pictures.empty()) text += "</div>\n";
  for (const std::string& note : notes) text += "<p class=\"soft\">" + escaped(note) + "</p>\n";
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
  return table({"", "cells", "least scaled Jacobian", "mean distance, %", "max distance, %", "edges followed", "merit",
                ""},
               rows);
}

std::string missed_edges(const Json& report) {
  constexpr std::size_t kMostRows = 30;
  const Json edges = report.value("edges_not_followed", Json::array());
  std::string rows;
  for (std::size_t i = 0; i < std::min(edges.size(), kMostRows); ++i)
    rows += row({words(edges[i].at("length_percent")), place(edges[i].at("at")), words(edges[i].at("why"))});
  if (rows.empty()) return "";
  std::string text = table({"length, % of diagonal", "place", "why"}, rows);
  if (edges.size() > kMostRows) text += format("<p>... and %zu more</p>\n", edges.size() - kMostRows);
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
    rows += row({words(cell.at("cell")), words(cell.at("scaled_jacobian")), place(cell.at("centre"))});
  }
  return rows.empty() ? "" : table({"cell", "scaled Jacobian", "centre"}, rows);
}

std::string thicknesses(const Json& report) {
  std::string rows;
  for (const auto& [side, t] : part(report, "thickness").items())
    for (const char* kind : {"asked", "limited", "achieved", "clearance"})
      if (t.contains(kind))
        rows += row({escaped(side) + ", " + kind, words(t[kind].at("mean")), words(t[kind].at("min")),
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
  for (const auto& [name, seconds] : part(report, "seconds").items()) rows += row({escaped(name), words(seconds)});
  if (report.contains("peak_memory_bytes"))
    rows += row({"peak memory, MB", number(report["peak_memory_bytes"].get<double>() * 1e-6)});
  return rows.empty() ? "" : table({"part", "seconds"}, rows);
}

std::string command(const Json& report) {
  std::string text;
  for (const Json& word : report.value("command_line", Json::array())) {
    const std::string plain = word.get<std::string>();
    const bool quoted = plain.empty() || plain.find_first_of(" \t\"'$&|<>()*;") != std::string::npos;
    text += (text.empty() ? "" : " ") + (quoted ? '\'' + escaped(plain) + '\'' : escaped(plain));
  }
  if (!text.empty()) text = "<pre>" + text + "</pre>\n";
  std::string rows;
  for (const auto& [name, value] : part(report, "options").items()) rows += row({escaped(name), words(value)});
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
  constexpr int kDeepest = 20;
  const auto shallow = [&](int depth, Json::parse_event_t, const Json&) {
    if (depth > kDeepest) throw InputError(name + ": expected a report, found values nested more than " +
                                           std::to_string(kDeepest) + " deep");
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

std::string report_page(const Json& report, std::span<const ReportPicture> pictures,
                        std::span<const std::string> notes) {
  std::string page = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
                     "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                     "<link rel=\"icon\" href=\"data:,\">\n<title>" +
                     escaped("subvol " + report.value("command", std::string()) + ": " + input_name(report)) +
                     "</title>\n<style>";
  page += kStyle;
  page += "</style>\n</head>\n<body>\n";
  page += heading(report) + gallery(pictures, notes);
  page += section("Warnings", warnings(report));
  page += section("Distance", distances(report));
  page += section("Thickness", thicknesses(report));
  page += section("Quality", quality(report) + histogram(report));
  page += section("Worst cells", worst_cells(report));
  page += section("Sharp edges that are not followed", missed_edges(report));
  page += section("Templates that were tried", trials(report));
  page += section("Convergence", convergence(report) + stages(report));
  page += section("Time and memory", costs(report));
  page += section("Command", command(report));
  page += "<p class=\"soft\">subvol " + escaped(report.value("subvol", std::string())) + "</p>\n</body>\n</html>\n";
  return page;
}

}  // namespace subvol::cli
