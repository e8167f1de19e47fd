// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/batch_page.h"

#include "cli/runs/page_parts.h"
#include "cli/runs/report_plots.h"
#include "subvol/base/format.h"
#include "subvol/base/markup.h"
#include "subvol/base/version.h"

#include <algorithm>
#include <cmath>

namespace subvol::cli {

using namespace internal;
namespace {

constexpr std::size_t kMostBatchPageRows = 200, kMostReasons = 20;

using Link = std::function<std::string(const ModelFigures&)>;

std::string linked_id(const ModelFigures& model, const Link& link) {
  const std::string address = link(model);
  if (address.empty()) return escaped_markup(model.id);
  return "<a href=\"" + escaped_markup(address) + "\">" + escaped_markup(model.id) + "</a>";
}

std::string text_of(double value) { return std::isnan(value) ? "" : number(value); }

std::string percent(std::size_t count, std::size_t all) {
  return formatted("%.1f %%", all > 0 ? 100 * static_cast<double>(count) / static_cast<double>(all) : 0.0);
}

std::string left_out(std::size_t all, std::size_t shown) {
  return all > shown ? formatted("<p class=\"soft\">... and %zu more</p>\n", all - shown) : "";
}

std::string heading(const std::string& title, const BatchSummary& summary) {
  const std::size_t all = summary.models.size(), valid = summary.count(Outcome::valid),
                    partial = summary.count(Outcome::not_converged), failed = all - valid - partial;
  std::string text = "<h1>" + escaped_markup(title) + "</h1>\n<p>" + std::to_string(all) + " models: ";
  text += formatted("<span class=\"verdict good\">%zu valid</span> (%s)", valid, percent(valid, all).c_str());
  if (partial > 0) text += formatted(", %zu not converged (%s)", partial, percent(partial, all).c_str());
  if (failed > 0)
    text += formatted(", <span class=\"verdict bad\">%zu failed</span> (%s)", failed, percent(failed, all).c_str());
  text += ".</p>\n";
  if (summary.num_damaged > 0)
    text += formatted("<p class=\"bad\">%zu lines of the records are damaged.</p>\n", summary.num_damaged);
  return text;
}

std::string classes(const BatchSummary& summary) {
  std::string rows;
  for (std::size_t i = 0; i < kNumOutcomes; ++i) {
    const auto outcome = static_cast<Outcome>(i);
    if (summary.counts[i] > 0)
      rows += row({std::string(name_of(outcome)), std::to_string(summary.counts[i]),
                   percent(summary.counts[i], summary.models.size()), std::string(meaning_of(outcome))});
  }
  return rows.empty() ? "" : table({"class", "models", "share", ""}, rows);
}

std::string failures(const BatchSummary& summary, const Link& link) {
  std::string text;
  for (std::size_t i = 1; i < kNumOutcomes; ++i) {
    std::string rows;
    std::size_t shown = 0;
    for (const ModelFigures& model : summary.models) {
      if (model.outcome != static_cast<Outcome>(i)) continue;
      if (++shown > kMostReasons) break;
      rows += row({linked_id(model, link), escaped_markup(model.reason)});
    }
    if (rows.empty()) continue;
    text +=
        table({name_of(static_cast<Outcome>(i)).data(), "reason"}, rows) + left_out(summary.counts[i], kMostReasons);
  }
  return text;
}

std::string quantiles(const BatchSummary& summary) {
  std::string rows;
  for (std::size_t k = 0; k < kNumFigures; ++k) {
    const Quantiles& found = summary.quantiles[k];
    if (found.count == 0) continue;
    const FigureKind& kind = figure_kinds()[k];
    const auto value = [&](std::size_t i) { return number(kind.scale * found.values[i]); };
    rows += row({kind.title, value(0), value(1), value(2), value(3), value(4), value(5), value(6),
                 number(kind.scale * found.mean), std::to_string(found.count)});
  }
  if (rows.empty()) return "";
  return table({"", "least", "5 %", "25 %", "median", "75 %", "95 %", "most", "mean", "models"}, rows) +
         "<p class=\"soft\">Quality, distances and cells are those of the models that did not fail.</p>\n";
}

/// Counts of the least scaled Jacobians in 20 bins over [-1, 1].
std::string histogram(const BatchSummary& summary) {
  constexpr int kScaledJacobianBins = 20;
  std::vector<std::size_t> counts(kScaledJacobianBins);
  for (const ModelFigures& model : summary.models) {
    const double quality = model.figures[kMinQuality];
    if (!std::isnan(quality))
      ++counts[static_cast<std::size_t>(
          std::clamp(int((quality + 1) / 2 * kScaledJacobianBins), 0, kScaledJacobianBins - 1))];
  }
  const std::string plot = histogram_plot(counts);
  if (plot.empty()) return {};
  return "<figure class=\"plot\">" + plot +
         "<figcaption>Models by their least scaled Jacobian, -1 to 1</figcaption></figure>\n";
}

std::string gallery(const BatchSummary& summary, const std::vector<ShownModel>& worst, const Link& link) {
  std::string text;
  for (const ShownModel& shown : worst) {
    const ModelFigures& model = summary.models[shown.model];
    const std::string caption =
        linked_id(model, link) + formatted(": least scaled Jacobian %.4g", model.figures[kMinQuality]);
    text += shown.png.empty() ? "<figure><figcaption>" + caption + "; no picture</figcaption></figure>\n"
                              : picture_figure(shown.title, shown.png, caption);
  }
  return text.empty() ? "" : "<div class=\"grid\">\n" + text + "</div>\n";
}

std::string models(const BatchSummary& summary, const Link& link) {
  std::string rows;
  for (std::size_t i = 0; i < std::min(summary.models.size(), kMostBatchPageRows); ++i) {
    const ModelFigures& model = summary.models[i];
    const auto& f = model.figures;
    rows += row({linked_id(model, link), std::string(name_of(model.outcome)), text_of(f[kCells]),
                 text_of(f[kMinQuality]), text_of(f[kMeanQuality]), text_of(f[kMeanDistance]), text_of(f[kMaxDistance]),
                 text_of(f[kWallSeconds]), text_of(f[kPeakMemory] * figure_kinds()[kPeakMemory].scale)});
  }
  if (rows.empty()) return "";
  return table({"model", "class", "cells", "least SJ", "mean SJ", "mean distance, %", "max distance, %", "seconds",
                "memory, MB"},
               rows) +
         left_out(summary.models.size(), kMostBatchPageRows);
}

std::string comparison_text(const PageComparison& page, const BatchSummary& now, const Link& link) {
  const Comparison& found = page.comparison;
  std::string text =
      "<p>Compared with " + escaped_markup(page.name) + formatted(": %zu models in both", found.num_common);
  if (found.num_only_before > 0) text += formatted(", %zu only there", found.num_only_before);
  if (found.num_only_now > 0) text += formatted(", %zu only here", found.num_only_now);
  text +=
      formatted(". %zu fail that did not; %zu do not fail any more.</p>\n", found.failing.size(), found.mended.size());
  const auto list = [&](const char* title, const std::vector<Compared>& pairs, const auto& value) {
    std::string rows;
    for (std::size_t i = 0; i < std::min(pairs.size(), kMostBatchPageRows); ++i) {
      const ModelFigures &old = page.before.models[pairs[i].before], &fresh = now.models[pairs[i].now];
      rows += row({linked_id(fresh, link), value(old), value(fresh), escaped_markup(fresh.reason)});
    }
    if (!rows.empty()) text += table({title, "before", "now", ""}, rows) + left_out(pairs.size(), kMostBatchPageRows);
  };
  const auto outcome = [](const ModelFigures& model) { return std::string(name_of(model.outcome)); };
  const auto figure = [](Figure k) { return [k](const ModelFigures& model) { return text_of(model.figures[k]); }; };
  list("fails now", found.failing, outcome);
  list("fails no more", found.mended, outcome);
  list("fails in another way", found.changed, outcome);
  list("lower least scaled Jacobian", found.worse, figure(kMinQuality));
  list("larger mean distance, %", found.farther, figure(kMeanDistance));
  list("more processor seconds", found.slower, figure(kProcessorSeconds));
  return text;
}

}  // namespace

std::string batch_page(const std::string& title, const BatchSummary& summary, const std::vector<ShownModel>& worst,
                       const PageComparison* comparison, const Link& link) {
  std::string page = page_begin("subvol batch: " + title) + heading("subvol batch: " + title, summary);
  page += section("Classes", classes(summary));
  if (comparison != nullptr) page += section("Differences", comparison_text(*comparison, summary, link));
  page += section("Worst results", gallery(summary, worst, link));
  page += section("Quantiles", quantiles(summary) + histogram(summary));
  page += section("Models without a valid result", failures(summary, link));
  page += section("Models", models(summary, link));
  return page + page_end(version());
}

}  // namespace subvol::cli
