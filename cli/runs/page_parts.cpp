// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/page_parts.h"

#include "cli/runs/report_plots.h"
#include "subvol/base/base64.h"
#include "subvol/base/format.h"
#include "subvol/base/markup.h"

namespace subvol::cli {

using namespace internal;
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

}  // namespace

std::string page_begin(const std::string& title) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
         "<link rel=\"icon\" href=\"data:,\">\n<title>" +
         escaped_markup(title) + "</title>\n<style>" + kStyle + "</style>\n</head>\n<body>\n";
}

std::string page_end(const std::string& version) {
  return "<p class=\"soft\">subvol " + escaped_markup(version) + "</p>\n</body>\n</html>\n";
}

std::string number(double value) { return formatted("%.6g", value); }

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

std::string picture_figure(const std::string& title, std::string_view png, const std::string& caption) {
  std::string text = "<figure><img alt=\"" + escaped_markup(title) + "\" src=\"data:image/png;base64,";
  append_base64(text, png);
  return text + "\"><figcaption>" + caption + "</figcaption></figure>\n";
}

}  // namespace subvol::cli
