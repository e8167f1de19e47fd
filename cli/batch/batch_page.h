// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/batch/batch_summary.h"

#include <functional>
#include <string>
#include <vector>

namespace subvol::cli {

/// A model that is shown with a picture.
struct ShownModel {
  std::size_t model;  ///< number in the summary
  std::string title;  ///< plain text
  std::string png;    ///< empty: there is no picture
};

/// A comparison with an earlier batch.
struct PageComparison {
  const BatchSummary& before;
  Comparison comparison;
  std::string name;  ///< of the earlier batch
};

/// Returns the summary of a batch as one HTML page that loads nothing: share of valid results, classes with reasons,
/// quantiles, the worst results, differences from an earlier batch, and a table of models.
///
/// link  address of what a model has left, relative to the page; empty: it is not linked.
/// Tables end after 200 rows and say how many are left out, so that the page of a million models can be opened.
std::string batch_page(const std::string& title, const BatchSummary& summary, const std::vector<ShownModel>& worst,
                       const PageComparison* comparison, const std::function<std::string(const ModelFigures&)>& link);

}  // namespace subvol::cli
