// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/cage_run.h"

#include "subvol/base/format.h"
#include "subvol/fit/mesh_check.h"

#include <variant>

namespace subvol::cli {

using namespace internal;

void CageRun::write_cage(const VolumeMesh& cage, const VolumeMesh& mesh, std::span<const FitState> states,
                         const WritingOptions& writing) {
  const auto write = [&](bool with_limit) {
    write_each(
        [&](const Output& output) {
          if (output.part == Part::animation)
            write_animation(output, cage, mesh, states, writing);
          else
            write_output(output, cage, mesh, &limit_, writing);
        },
        [&](const Output& output) { return shows_surface(output) == with_limit; });
  };
  write(false);  // written first: if memory is short, it is the limit surface that may not fit
  limit_ = watched([&](auto progress) { return tessellated_limit(cage, writing, progress); });
  write(true);
}

void CageRun::measure_limit(const VolumeMesh& cage, const Target& target, const WritingOptions& writing) {
  WritingOptions fine;
  fine.chord_percent = measured_chord_percent(writing);
  if (fine.chord_percent < writing.chord_percent)
    limit_ = watched([&](auto progress) { return tessellated_limit(cage, fine, progress); });
  limit_distance_ = std::visit([&](const auto& t) { return surface_distance(triangles_of(limit_), t); }, target);
}

Json CageRun::cage_json(const VolumeMesh& cage, double diagonal) const {
  Json distance = distance_json(limit_distance_, diagonal);
  distance["chord_error_percent"] = 100 * limit_.chord_error / diagonal;
  return {{"limit_surface_distance", std::move(distance)}, {"cage", describe("", cage)}};
}

std::string CageRun::limit_text(double diagonal) const {
  const double percent = 100 / diagonal;
  return formatted("%s: mean %g %%, max %g %% of the diagonal\n",
                   limit_distance_.one_sided ? "points to limit surface" : "limit surface to target",
                   limit_distance_.mean() * percent, limit_distance_.max() * percent);
}

}  // namespace subvol::cli
