// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/report_plots.h"

#include "subvol/base/format.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

namespace subvol::cli {

using namespace internal;
namespace {

constexpr double kPlotWidth = 640, kPlotHeight = 240, kPlotLeftMargin = 48, kPlotBottomMargin = 20, kPlotTopMargin = 10;

std::string open_svg(const char* title) {
  return formatted("<svg viewBox=\"0 0 %g %g\" role=\"img\" aria-label=\"%s\">", kPlotWidth, kPlotHeight, title) +
         formatted("<path class=\"axis\" d=\"M%g %gV%gH%g\"/>", kPlotLeftMargin, kPlotTopMargin,
                   kPlotHeight - kPlotBottomMargin, kPlotWidth);
}

}  // namespace

std::string energy_plot(const Json& stages) {
  static constexpr std::array<const char*, 3> kTerms{"surface", "volume", "total"};
  std::array<std::vector<double>, 3> energies;
  std::vector<std::size_t> ends;
  for (const Json& stage : stages) {
    for (const Json& step : stage.value("history", Json::array()))
      for (std::size_t k = 0; k < kTerms.size(); ++k)
        energies[k].push_back(step.at("energy").at(kTerms[k]).get<double>());
    ends.push_back(energies[0].size());
  }
  const std::size_t num_steps = energies[0].size();
  if (num_steps == 0) return {};
  double low = 1e300, high = 0;
  for (const auto& list : energies)
    for (const double e : list)
      if (e > 0) low = std::min(low, e), high = std::max(high, e);
  if (!(high > 0)) return {};
  const double bottom = std::floor(std::log10(low)), top = std::max(bottom + 1, std::ceil(std::log10(high)));
  const auto x = [&](double step) {
    return kPlotLeftMargin +
           (kPlotWidth - kPlotLeftMargin) * step / static_cast<double>(std::max<std::size_t>(1, num_steps - 1));
  };
  const auto y = [&](double e) {
    const double t = e > 0 ? (std::log10(e) - bottom) / (top - bottom) : 0;
    return kPlotHeight - kPlotBottomMargin -
           (kPlotHeight - kPlotBottomMargin - kPlotTopMargin) * std::clamp(t, 0.0, 1.0);
  };
  std::string svg = open_svg("energies by step");
  const int every = std::max(1, static_cast<int>((top - bottom) / 6));
  for (int decade = static_cast<int>(bottom); decade <= static_cast<int>(top); decade += every)
    svg += formatted("<path class=\"axis\" d=\"M%g %.1fH%g\"/><text x=\"4\" y=\"%.1f\">1e%d</text>", kPlotLeftMargin,
                     y(std::pow(10.0, decade)), kPlotWidth, y(std::pow(10.0, decade)) + 4, decade);
  for (const std::size_t end : ends)
    if (end < num_steps)
      svg += formatted("<path class=\"axis\" d=\"M%.1f %gV%g\"/>", x(double(end) - 0.5), kPlotTopMargin,
                       kPlotHeight - kPlotBottomMargin);
  for (std::size_t k = kTerms.size(); k-- > 0;) {
    svg += formatted("<polyline class=\"%s\" points=\"", kTerms[k]);
    for (std::size_t i = 0; i < num_steps; ++i) svg += formatted("%.1f,%.1f ", x(double(i)), y(energies[k][i]));
    svg += "\"/>";
  }
  return svg + formatted("<text x=\"%g\" y=\"%g\" text-anchor=\"end\">%zu steps</text></svg>", kPlotWidth,
                         kPlotHeight - 5, num_steps);
}

std::string histogram_plot(const Json& counts) {
  std::vector<double> values;
  for (const Json& count : counts) values.push_back(count.get<double>());
  const double most = values.empty() ? 0 : *std::max_element(values.begin(), values.end());
  if (!(most > 0)) return {};
  std::string svg = open_svg("histogram");
  const double width = (kPlotWidth - kPlotLeftMargin) / static_cast<double>(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] > 0)) continue;
    const double height = std::max(1.0, (kPlotHeight - kPlotBottomMargin - kPlotTopMargin) * values[i] / most);
    svg += formatted(
        "<rect class=\"bar\" x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\"><title>%.15g</title></rect>",
        kPlotLeftMargin + width * double(i) + 1, kPlotHeight - kPlotBottomMargin - height, width - 2, height,
        values[i]);
  }
  for (int i = 0; i <= 4; ++i)
    svg += formatted("<text x=\"%.1f\" y=\"%g\" text-anchor=\"%s\">%g</text>",
                     kPlotLeftMargin + (kPlotWidth - kPlotLeftMargin) * i / 4, kPlotHeight - 5,
                     i == 4 ? "end" : "middle", -1 + 0.5 * i);
  return svg + formatted("<text x=\"4\" y=\"%g\">%.0f</text></svg>", kPlotTopMargin + 10, most);
}

}  // namespace subvol::cli
